#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Whether the frames follow each other like those of a movement. With d_k the steps of the
/// material from frame to frame, and products summed over all samples:
///   to_and_fro = sum_k max(0, min(-d_{k-1} d_k, -d_k d_{k+1})) / sum_k d_k d_k,
/// the share of steps that lead back and are led back again, 0 for a movement with four frames or
/// more in a cycle;
///   onward = sum_k d_k d_{k+1} / sum_k d_k d_k,
/// near 1 for a slow movement, near -1/2 for frames in random order.
struct FrameOrder {
  size_t frames = 0;
  double to_and_fro = 0.0;
  double onward = 1.0;
  /// The frame at which the path leads back the most; rms distances over all samples, mm: from the
  /// frame before it, to the frame after it, and between these two.
  size_t frame = 0;
  double before_mm = 0.0, after_mm = 0.0, apart_mm = 0.0;
  double voxel_mm = 1.0;  ///< of the finest axis of the image
};

/// Collects the steps of a sequence as they become known. One thread at a time; uses all cores.
class FrameOrderMeter {
 public:
  /// The points are samples of the fields' grid inside the mask (null, or on that grid); of very
  /// many every n-th. The mask should leave out what shows no structure, where noise moves.
  FrameOrderMeter(const Grid& grid, const Mask* mask, double voxel_mm);
  /// The next step as a field of the frame it begins in: the points move on by it.
  void follow(const Field& u);
  /// The next step as the difference of two fields of the same material, on the meter's grid.
  void take(const Field& from, const Field& to);
  /// What was found. `cyclic`: the last step led back to the first frame.
  FrameOrder found(bool cyclic) const;

 private:
  void add(std::vector<glm::vec3> step_mm);

  Grid grid_;
  double voxel_mm_;
  std::vector<size_t> samples_;
  std::vector<glm::dvec3> places_mm_;
  std::vector<glm::vec3> first_, last_;
  std::vector<double> squares_;   ///< d_k d_k, summed over the points
  std::vector<double> products_;  ///< d_k d_{k+1}
};

}  // namespace palpate
