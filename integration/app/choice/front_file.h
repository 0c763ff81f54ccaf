#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "integration/app/choice/motion_front.h"

namespace palpate::app {

/// Where the front that was measured on this machine is kept; empty where no state can be.
std::filesystem::path front_path();

/// Keeps a front; kBadOutput where the folder can not be written.
Status write_front(const MotionFront& front);

/// The front that was kept. kBadInput, with what to run, where there is none, or where it was
/// measured on another device than `device`.
Result<MotionFront> read_front(const std::string& device);

/// The settings for a pair on this grid, from the front that was measured on this device. For a
/// deadline: one. For an error: the fastest first, then better ones to try if it is not good
/// enough. One of the two arguments is not empty. Errors: kBadInput with what to do.
Result<std::vector<Choice>> choose_settings(const std::string& within, const std::string& error,
                                            const Grid& grid, const std::string& device);

}  // namespace palpate::app
