#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "integration/app/choice/motion_front.h"

namespace palpate::app {

/// The file with the front that was measured on this machine; empty if there is no place for state.
std::filesystem::path front_path();

/// Writes a front; kBadOutput if the folder can not be written.
Status write_front(const MotionFront& front);

/// Reads the front. Errors: kBadInput, with the command to run, if there is none or if it was
/// measured on another device than `device`.
Result<MotionFront> read_front(const std::string& device);

/// The settings for a pair on this grid, from the front measured on this device. For a deadline
/// (`within`): one. For an error: the fastest first, then more accurate ones to try if it is not
/// good enough. One of the two arguments is not empty. Errors: kBadInput with what to do.
Result<std::vector<Choice>> choose_settings(const std::string& within, const std::string& error,
                                            const Grid& grid, const std::string& device);

}  // namespace palpate::app
