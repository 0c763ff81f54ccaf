#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "compute/motion/quality_folds.h"
#include "compute/motion/quality_inverse.h"
#include "compute/motion/quality_match.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// How good a motion field is: distances to a known motion, to landmarks, to its own inverse, and
/// around a cycle. Folds, the inverse, and the comparison of the frames are in the headers included
/// above; verdict.h makes a verdict of them. All functions may be called from any thread, use all
/// cores, allocate, and are not real-time safe.
namespace palpate {

/// Statistics of a set of distances >= 0, in the unit of the input. All zero if count is.
struct Spread {
  size_t count = 0;
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

/// The statistics of the values, which are reordered. Percentile p is the smallest value that at
/// least the share p of all do not exceed (nearest rank). A NaN among the values makes max NaN, so
/// that it is noticed.
Spread spread_of(std::vector<float>& values);

/// The same distances in three units: in mm; in voxels of the finest axis of the grid; and with
/// each component along the index axes in voxels of its own axis, which suits thick slices.
struct Distances {
  Spread mm;
  Spread voxels;
  Spread own_voxels;
};

/// Statistics of the lengths of offsets (LPS mm) in all three units.
Distances distances_of(std::span<const glm::vec3> offsets_mm, const Grid& grid);

/// Statistics of |u| at the samples of a field, mm. mask: null, or on the field's grid; only its
/// samples count. All zero if the mask is empty.
Spread lengths_mm(const Field& u, const Mask* mask = nullptr);

/// Endpoint error |u(x) - truth(x)| at the sample centres x of truth's grid, normally the image's:
/// u may be coarser and is interpolated. mask: null, or on truth's grid; only its voxels count.
/// Errors: kBadInput if the mask is on another grid or empty.
Result<Distances> endpoint_error(const Field& u, const Field& truth, const Mask* mask = nullptr);

/// Target registration error |x_n + u(x_n) - y_n| of landmark pairs, LPS mm: x_n in fixed, y_n the
/// same spot in moving. Errors: kBadInput if the lists are empty or of different length.
Result<Spread> target_registration_error_mm(const Field& u,
                                            std::span<const glm::dvec3> fixed_lps_mm,
                                            std::span<const glm::dvec3> moving_lps_mm);

/// Inverse consistency |u(x) + w(x + u(x))| of a forward field u (fixed to moving) and a backward
/// field w (moving to fixed), at the sample centres of `image`; of very many every n-th, so that
/// about a quarter of a million remain. mask: null, or on that grid. Points that u moves out of w's
/// grid do not count, since w is not defined there. Errors: kBadInput if the mask is on another
/// grid, or no point remains.
Result<Distances> inverse_consistency(const Field& u, const Field& w, const Grid& image,
                                      const Mask* mask = nullptr);

/// Where a point of frame 0 is after moving with fields[0], fields[1], ..., LPS mm.
glm::dvec3 followed(std::span<const Field> fields, glm::dvec3 lps_mm);

/// Drift |followed(x) - x| from the given points, after the fields of one cycle (the last one leads
/// back to frame 0); 0 is ideal. Errors: kBadInput if there are no points or no fields.
Result<Spread> cycle_drift_mm(std::span<const Field> fields,
                              std::span<const glm::dvec3> points_lps_mm);

/// Points of frame 0 that are moved by the fields of a cycle as these become known. The points are
/// the sample centres of a grid inside the mask (null, or on that grid); of very many every n-th,
/// so that about a quarter of a million remain. One thread at a time.
class CyclePoints {
 public:
  explicit CyclePoints(const Grid& grid, const Mask* mask = nullptr);
  /// x <- x + u(x). Uses all cores.
  void follow(const Field& u);
  /// Distances of the points from where they started; after the last field of the cycle this is its
  /// drift, 0 is ideal. All zero if there are no points.
  Distances drift() const;

 private:
  Grid grid_;
  std::vector<glm::dvec3> start_mm_, now_mm_;
};

/// The drift of the fields of one cycle, from CyclePoints. Errors: kBadInput if there are no points
/// or no fields, or for a mask on another grid.
Result<Distances> cycle_drift(std::span<const Field> fields, const Grid& grid,
                              const Mask* mask = nullptr);

/// Below this confidence a vector is more likely wrong by more than half a voxel than right.
inline constexpr double kLowConfidence = 0.5;

/// The share of a mask's voxels (of all, without a mask) at which the confidence is below `low`, 0
/// to 1. Errors: kBadInput if the mask is empty.
Result<double> low_confidence_share(const Confidence& confidence, const Mask* mask = nullptr,
                                    double low = kLowConfidence);

/// The radius within which a vector with this deviation (along and across, mm) is right with a
/// probability of 95 %: kErrorRadius sqrt(along^2 + 2 across^2). Its error is below t with P = 1 /
/// (1 + (radius / t)^kErrorTail / 19) (shaders/interface/motion.h).
double error_radius_mm(glm::dvec2 deviation_mm);

/// The radius, mm, within which `share` of a mask's voxels are right (of all, without a mask; share
/// above 0, below 1): the mean of P over the cells whose centres lie in the mask is `share`.
/// Errors: kBadInput if there is no such cell, or if the deviation is not known.
Result<double> error_radius_mm(const Deviation& deviation, const Mask* mask = nullptr,
                               double share = 0.95);

}  // namespace palpate
