#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::headset {

/// A part of the controllers, and what it does.
using ButtonHelp = std::pair<std::string, std::string>;

/// What the buttons of controllers of this interaction profile do, from the table of bindings
/// (module/xr/bindings.h). Empty for a profile that is not in it.
/// trigger: what the trigger (simple controllers: the right menu) does; empty: nothing.
std::vector<ButtonHelp> button_help(std::string_view profile, const std::string& trigger);

}  // namespace palpate::headset
