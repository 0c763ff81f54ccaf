#pragma once

#include <string_view>

namespace palpate::devices::fuzz {

/// Hands untrusted bytes to the paths' parser and checks what every answer must hold: a sentence,
/// or a path that is sound everywhere. Ends the process if it does not.
void parse_path_bytes(std::string_view bytes);

}  // namespace palpate::devices::fuzz
