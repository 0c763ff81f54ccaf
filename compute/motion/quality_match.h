#pragma once

#include <cstddef>

#include "compute/motion/noise.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate {

/// The moving volume brought onto a grid of the fixed frame: W(x) = M(x + u(x)), trilinear, border
/// values held.
Volume warped(const Volume& moving, const Field& u, const Grid& onto);

/// What the frames themselves say about a field. Correlations are Pearson's, inside blocks of about
/// 7 voxels of the finest axis: a gain change or a bias field between the frames does not lower
/// them, a wrong match does. Only textured blocks count: those whose SD in the fixed frame is above
/// three times its noise.
struct Match {
  double noise_sd_fixed = 0.0;  ///< as noise_sd()
  double noise_sd_moving = 0.0;
  double difference_sd_before = 0.0;  ///< SD of F - M over the mask
  double difference_sd_after =
      0.0;              ///< SD of F - W over the mask, where x + u(x) is inside the moving volume
  size_t blocks = 0;    ///< blocks at least half inside the mask
  size_t textured = 0;  ///< of these, textured in fixed
  size_t textured_moving =
      0;  ///< of these, textured in moving at the same place, before any motion
  size_t compared =
      0;  ///< textured blocks of which u leaves at least half inside the moving volume
  double correlation_before =
      0.0;  ///< mean over the compared blocks, F against M; 0 if there are none
  double correlation_after = 0.0;  ///< the same, F against W
  double mismatched = 0.0;  ///< share of the compared blocks whose correlation after is below 0.5
  double leaving =
      0.0;  ///< share of the voxels of textured blocks that u takes out of the moving volume

  double textured_share() const { return blocks ? double(textured) / double(blocks) : 0.0; }
  double textured_share_moving() const {
    return blocks ? double(textured_moving) / double(blocks) : 0.0;
  }
};

/// Compares fixed F with moving M before and after motion correction by u. mask: null, or on
/// fixed's grid. Errors: kBadInput if the mask is on another grid or empty. Any thread; uses all
/// cores; needs memory for a few slices.
Result<Match> match(const Volume& fixed, const Volume& moving, const Field& u,
                    const Mask* mask = nullptr);

/// The voxels of the textured blocks of a volume: where motion can be seen at all.
Mask textured_voxels(const Volume& volume);

}  // namespace palpate
