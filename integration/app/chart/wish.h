#pragma once

#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "integration/studies/motion_choice.h"

namespace palpate::app {

/// The settings for a deadline (one) or an error (the fastest first, then better ones, for where it
/// does not do) of a pair on this grid, from the front that was measured on this device. One of the
/// two is not empty. Errors: kBadInput with what to do.
Result<std::vector<studies::Choice>> choose_settings(const std::string& within,
                                                     const std::string& error, const Grid& grid,
                                                     const std::string& device);

}  // namespace palpate::app
