#pragma once

#include <string_view>

namespace palpate::fuzz {

/// Gives untrusted bytes to the reader of recordings, as they are and with a corrected hash at
/// their end. Each result must be an error message, or a recording whose ticks can be read to the
/// end. Ends the process if it is neither.
void parse_recording(std::string_view bytes);

}  // namespace palpate::fuzz
