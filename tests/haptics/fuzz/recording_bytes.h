#pragma once

#include <string_view>

namespace palpate::fuzz {

/// Hands untrusted bytes to the reader of recordings, as they are and with the hash at their end
/// put right, and checks what every answer must hold: a sentence, or a recording whose ticks can be
/// read to the end. Ends the process if it does not.
void parse_recording(std::string_view bytes);

}  // namespace palpate::fuzz
