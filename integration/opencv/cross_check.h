#pragma once

#include <string>
#include <vector>

#include "compute/motion/quality.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// An independent check of a motion field by a method that shares nothing with it: OpenCV's dense
/// optical flow, which is two-dimensional, on slices of the three orientations.
namespace palpate::opencv {

enum class FlowMethod { kDis, kFarneback };

/// "DIS" or "Farneback".
const char* name(FlowMethod method);

/// Where the two can be compared, and when they agree. "Voxel" is the finest axis of the fixed
/// grid.
struct CrossCheckOptions {
  int slices = 12;  ///< at most this many per orientation, evenly spaced
  /// A slice shows in-plane motion only while the material stays in it: |u_through| at most this.
  double through_voxels = 0.5;
  /// Enough structure: the weaker direction of the fixed slice's gradient is at least this many
  /// times its noise.
  double structure_noises = 2.0;
  /// The flow itself must be reliable: flow forward and backward returns to within this.
  double return_voxels = 0.3;
  /// They agree if the median difference is at most this, for the better method of each
  /// orientation. With exactly known motion (chest CT moved by up to 15 mm, heart phantom, sliding
  /// organ, 2 % noise) it was 0.08 to 0.23 at 1 to 19 % of the slices; with a field of zeros on the
  /// same chest 0.68.
  double agree_voxels = 0.5;
  /// And if the 95th percentile is at most this, since a field may be wrong in one place only.
  /// Known motion gave 0.2 to 0.7.
  double agree_p95_voxels = 2.0;
  /// An orientation with fewer compared pixels is ignored.
  size_t least_pixels = 500;
};

/// The result of one method on the slices of one orientation.
struct FlowComparison {
  int normal_axis = 0;  ///< the index axis (0 i, 1 j, 2 k) that the slices are normal to
  FlowMethod method = FlowMethod::kDis;
  size_t slices = 0;
  size_t pixels = 0;     ///< of all slices, inside the mask
  size_t compared = 0;   ///< of these, where the two can agree
  Distances difference;  ///< |flow - in-plane part of u| over the compared pixels
  /// median in-plane |u| there, for comparison with the difference
  double motion_voxels = 0.0;

  double share() const { return pixels ? double(compared) / double(pixels) : 0.0; }
};

enum class Agreement {
  kAgree,
  kDisagree,
  kCanNotTell,  ///< nowhere enough pixels to compare
};

struct CrossCheck {
  std::vector<FlowComparison> comparisons;  ///< up to three orientations x two methods
  Agreement agreement = Agreement::kCanNotTell;
  double share_compared = 0.0;  ///< of all pixels of all slices, for the method with more
  std::string summary;          ///< one sentence for the user, with the numbers
};

/// Compares u (fixed x -> x + u(x) in moving, mm, LPS) with optical flow from fixed to moving
/// slices. Slices are resampled to square pixels of their finer edge, so anisotropic spacing and
/// oblique directions are honoured; both frames are windowed to 8 bit by their own 1st and 99th
/// percentile, so a gain change does not matter. Orientations whose slices are under 32 pixels in
/// one direction are left out. mask: null, or on fixed's grid. Errors: kBadInput if the mask is on
/// another grid. Any thread; uses OpenCV's threads; allocates.
Result<CrossCheck> cross_check(const Volume& fixed, const Volume& moving, const Field& u,
                               const CrossCheckOptions& options = {}, const Mask* mask = nullptr);

}  // namespace palpate::opencv
