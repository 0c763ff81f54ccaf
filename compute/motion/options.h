#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Settings of one level of the pyramid. Lengths are multiples of h, the level's voxel edge in mm.
struct LevelOptions {
  int iterations = 25;      ///< at most; convergence stops earlier
  int cell = 2;             ///< image voxels per field cell along each axis finer than 1.5 h
  double window = 3.0;      ///< Gaussian over the normal equations, SD in h
  double smoothness = 0.3;  ///< weight of the total variation, in h
};

/// How the field is estimated. The presets are good defaults for everything here; a number is only
/// for experiments.
struct MotionOptions {
  std::string preset = "balanced";
  /// From the finest level (h = the image's finest voxel edge) to the coarsest; the last entry
  /// serves all coarser ones.
  std::vector<LevelOptions> levels;
  int finest_level = 0;   ///< 1 stops at twice the voxel edge, 2 at four times
  int coarse_levels = 0;  ///< number of levels; 0: until the coarsest image is about 16 voxels wide
  double damping = 0.2;   ///< alpha of the normal equations, per h; dimensionless
  double momentum = 0.5;  ///< share of the last change that is added before the next
  double largest_step = 1.0;  ///< of one update, in h
  double huber_mm =
      0.05;              ///< differences of neighbours below this are smoothed, above kept as edges
  int filter_steps = 3;  ///< dual steps of the total variation filter per iteration, warm-started
  bool normalise = true;  ///< local normalisation of intensities; off for images of equal contrast
  double noise = 0.02;    ///< noise SD in units of the fixed image's p99 - p1
  double converged =
      0.0;  ///< a level stops when the field moves less than this (in h) per iteration; 0: never
  double min_determinant = 0.01;  ///< no voxel corner of the result has a smaller det(I + grad u)
  bool skip_still = true;         ///< leave out bricks in which nothing moves
};

/// "fast", "balanced" or "best"; nothing for another name.
std::optional<MotionOptions> motion_preset(std::string_view name);

/// Names of the presets, for messages.
inline constexpr std::array<std::string_view, 3> kMotionPresets = {"fast", "balanced", "best"};

}  // namespace palpate
