#pragma once

#include <string_view>

namespace palpate::x3d::fuzz {

/// Gives untrusted bytes to the reader of X3D. Each result must be an error message, or a valid
/// scene that is the same after it was written and read again. Ends the process if it is neither.
void parse_x3d_file(std::string_view bytes);

}  // namespace palpate::x3d::fuzz
