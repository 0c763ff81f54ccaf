#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include "tests/lab/stability/shell.h"

namespace palpate::stability {

constexpr int kThinFrames = 4;

/// The beating shell's surface alone, as thick as one voxel of the grid, in frame k: the most
/// difficult wall to hold.
inline Volume thin_frame(const Grid& grid, int k) {
  Volume frame{grid, std::vector<float>(grid.count())};
  const double radius = shell_radius_mm(k, kThinFrames);
  for (int z = 0; z < grid.size.z; ++z)
    for (int y = 0; y < grid.size.y; ++y)
      for (int x = 0; x < grid.size.x; ++x) {
        // The share of a voxel that the wall fills.
        const double r = glm::length(grid.lps_from_index({x, y, z}));
        const double share = 1.0 - std::abs(r - radius) / grid.finest_mm();
        frame.values[grid.offset(x, y, z)] = float(1000.0 * std::max(0.0, share));
      }
  return frame;
}

/// The same as a moving volume of 1 mm, cyclic. Volumes of any rate share the same frames and
/// motion.
inline std::shared_ptr<const MovingVolume> thin_shell(double frames_per_second) {
  static const MovingVolume made = [] {
    MovingVolume volume = *shell(kThinFrames, 1.0);
    volume.frames.clear();
    for (int k = 0; k < kThinFrames; ++k)
      volume.frames.push_back(sampled_scalar(thin_frame(shell_grid(1.0), k)));
    return volume;
  }();
  auto volume = std::make_shared<MovingVolume>(made);
  for (int k = 0; k < kThinFrames; ++k) volume->times.times_s[size_t(k)] = k / frames_per_second;
  volume->times.cycle_s = kThinFrames / frames_per_second;
  return volume;
}

}  // namespace palpate::stability
