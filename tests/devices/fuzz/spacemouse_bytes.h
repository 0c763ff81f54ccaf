#pragma once

#include <string_view>

namespace palpate::devices::fuzz {

/// Hands bytes to the reader of a puck's reports, cut into reports by their own values, and checks
/// what its state must hold at all times. Ends the process if it does not.
void read_spacemouse_bytes(std::string_view bytes);

}  // namespace palpate::devices::fuzz
