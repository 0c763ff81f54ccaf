#pragma once

#include <string>

#include "compute/volume/grid.h"
#include "integration/studies/motion_choice.h"

namespace palpate::app {

/// The setting for a deadline or an error (one of the two is not empty) of a pair on this grid,
/// from the front that was measured on this device. Errors: kBadInput with what to do.
Result<studies::Choice> choose_setting(const std::string& within, const std::string& error,
                                       const Grid& grid, const std::string& device);

}  // namespace palpate::app
