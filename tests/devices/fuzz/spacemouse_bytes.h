#pragma once

#include <string_view>

namespace palpate::devices::fuzz {

/// Gives bytes to the reader of a puck's reports, cut into reports by their own values, and checks
/// the guarantees for its state. Ends the process if they do not hold.
void read_spacemouse_bytes(std::string_view bytes);

}  // namespace palpate::devices::fuzz
