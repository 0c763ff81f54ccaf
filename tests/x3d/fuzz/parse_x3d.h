#pragma once

#include <string_view>

namespace palpate::x3d::fuzz {

/// Hands untrusted bytes to the reader of X3D and checks what every answer must hold: a sentence,
/// or a scene that is sound and comes back from what is written of it. Ends the process if not.
void parse_x3d_file(std::string_view bytes);

}  // namespace palpate::x3d::fuzz
