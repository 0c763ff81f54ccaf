#pragma once

#include <filesystem>

#include "compute/volume/result.h"

namespace palpate::running {

/// Writes a recording's ticks as an MCAP file for ROS 2 tools and Foxglove. Returns how many.
/// Topics: /palpate/hand (the grip in the space "device", with its rotation where the device senses
/// it), /palpate/probe and /palpate/proxy ("world") as geometry_msgs/msg/PoseStamped.
/// /palpate/force (what the device was given, "device") and /palpate/scene_force (before the
/// guards, "world") as geometry_msgs/msg/WrenchStamped; a torque (N m) stands in the first.
/// /palpate/cause, std_msgs/msg/String, the word for what limits the force, where it changes.
/// Lengths m, forces N. Times are the loop's monotonic clock. kBadInput: no recording, or a damaged
/// one; kBadOutput. Not real-time safe.
Result<uint64_t> write_mcap(const std::filesystem::path& recording,
                            const std::filesystem::path& output);

}  // namespace palpate::running
