#pragma once

#include <cstddef>

#include "compute/motion/noise.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate {

/// The moving volume resampled onto a grid of the fixed frame: W(x) = M(x + u(x)), trilinear,
/// clamped to the edge.
Volume warped(const Volume& moving, const Field& u, const Grid& onto);

/// How well two frames match through a field. Computed in blocks of about 7 voxels of the finest
/// axis. Correlations are Pearson's: a gain change or a bias field between the frames does not
/// lower them, a wrong match does. Three sets of blocks, each a subset of the one before:
/// - textured: the SD in the fixed frame is above three times its white noise (noise_sd());
/// - compared: textured, and u leaves at least half of it inside the moving volume;
/// - clear: compared, and the SD is either among the highest tenth, or above three times the part
///   that the frames do not share, SD_F sqrt(1 - r^2), in the quietest tenth of the compared
///   blocks. This excludes noise that a scanner has blurred: it looks like texture in one frame,
///   but is not in the other.
struct Match {
  double noise_sd_fixed = 0.0;  ///< as noise_sd()
  double noise_sd_moving = 0.0;
  double difference_sd_before = 0.0;  ///< SD of F - M over the compared blocks
  double difference_sd_after = 0.0;   ///< SD of F - W there, where x + u(x) is inside moving
  size_t blocks = 0;                  ///< blocks at least half inside the mask
  size_t textured = 0;
  size_t textured_moving = 0;  ///< textured in moving at the same place, before any motion
  size_t compared = 0;
  size_t clear = 0;
  /// mean over the clear blocks, F against M; 0 if there are none
  double correlation_before = 0.0;
  double correlation_after = 0.0;  ///< the same, F against W
  double mismatched = 1.0;  ///< share of the clear blocks whose correlation after is below 0.5
  double leaving = 0.0;     ///< share of the voxels of textured blocks that u takes out of moving
  /// The motion that remains between F and W, mean over the clear blocks. It is the length of the
  /// step d, in voxels of each axis, that aligns F and W in a block and its clear neighbours (3 x 3
  /// x 3, to average noise),
  ///   (I + sum g g^T / q) d = sum r g / q,  r = F - W, g = (grad F + grad W) / 2,
  /// with F, W and g less their means, F and W scaled to SD 1, and q the mean r^2, block by block
  /// (Lucas and Kanade 1981; I is the prior that d is about one voxel). It measures errors of up to
  /// a few voxels that are smooth over 20 voxels; larger ones lower the correlation.
  double motion_left_voxels = 0.0;
  /// Share of the clear blocks that still show a motion of more than half a voxel. It is the step d
  /// as above, but of a plane of 3 x 3 blocks, in any of the three planes, with noise that may be
  /// blurred, so that n = 8 voxels (two along each axis) show the same of it,
  ///   (n I + sum g g^T / q) d = sum r g / q,
  /// where |d|^2 is above 1/4 + twice what such noise makes of it. A wave that cancels out in 3 x 3
  /// x 3 blocks adds up in the plane along its crests.
  double moving_share = 0.0;

  double textured_share() const { return blocks ? double(textured) / double(blocks) : 0.0; }
  double textured_share_moving() const {
    return blocks ? double(textured_moving) / double(blocks) : 0.0;
  }
  double clear_share() const { return blocks ? double(clear) / double(blocks) : 0.0; }
};

/// Compares fixed F with moving M before and after motion correction by u. mask: null, or on
/// fixed's grid. structure: null, or set to the voxels of the clear blocks inside the mask. Errors:
/// kBadInput if the mask is on another grid or empty. Any thread; uses all cores.
Result<Match> match(const Volume& fixed, const Volume& moving, const Field& u,
                    const Mask* mask = nullptr, Mask* structure = nullptr);

}  // namespace palpate
