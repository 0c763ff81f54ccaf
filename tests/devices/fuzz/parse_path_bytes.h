#pragma once

#include <string_view>

namespace palpate::devices::fuzz {

/// Gives untrusted bytes to the parser of paths. Each result must be an error message, or a path
/// that is valid everywhere. Ends the process if it is neither.
void parse_path_bytes(std::string_view bytes);

}  // namespace palpate::devices::fuzz
