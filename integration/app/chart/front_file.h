#pragma once

#include <filesystem>

#include "integration/studies/motion_choice.h"

namespace palpate::app {

/// Where the front that was measured on this machine is kept; empty where no state can be.
std::filesystem::path front_path();

/// Keeps a front; kBadOutput where the folder can not be written.
Status write_front(const studies::MotionFront& front);

/// The front that was kept. kBadInput, with what to run, where there is none, or where it was
/// measured on another device than `device`.
Result<studies::MotionFront> read_front(const std::string& device);

}  // namespace palpate::app
