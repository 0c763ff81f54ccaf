#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compute/volume/sequence_motion.h"
#include "module/scene/grid_place.h"
#include "module/scene/motion_map.h"

namespace palpate {

/// One motion for a whole sequence laid out for the hand: at each sample all terms of u next to
/// each other (volume space, m) and the confidence, 12 bytes a term and 4 more. Trilinear, border
/// held. Immutable, any thread; reads are real-time safe and finite wherever x is, NaN included.
class SequenceMap {
 public:
  /// `confidence` may be null (1 everywhere) and may have another grid. Looks for folds at and
  /// between all frames, in parallel. Where a vector of a term is not finite the material stands
  /// still, with confidence 0, and the cells around count as folded.
  static std::shared_ptr<const SequenceMap> of(const SequenceMotion& motion,
                                               const Confidence* confidence = nullptr);

  /// u(x, t), its Jacobian and the confidence. The Jacobian is that of the trilinear field, so it
  /// jumps at cell faces; along an axis beyond the outermost samples it is zero.
  MotionSample sample(glm::dvec3 x_m, const TimeWeights& time) const noexcept;
  glm::dvec3 displacement(glm::dvec3 x_m, const TimeWeights& time) const noexcept;

  const TimeBasis& basis() const { return basis_; }
  size_t reference() const { return reference_; }
  /// Bounds over all cells, at all frames and midway between them, as MotionMap has them.
  float worst_contraction() const { return worst_contraction_; }
  float worst_determinant() const { return worst_determinant_; }
  size_t folded_cells() const { return folded_cells_; }  ///< most at one of these times
  double largest_u_m() const { return largest_u_m_; }
  /// Share of the samples that move by more than a hundredth of a cell at one of these times.
  double moving_share() const { return moving_share_; }
  size_t bytes() const { return samples_.size() * sizeof(float); }
  /// Edge of a cell along its shortest axis, m.
  double cell_m() const { return cell_m_; }
  const GridPlace& place() const { return place_; }
  /// 3 terms() + 1 floats a sample: the terms in order, then the confidence. Shape (nz, ny, nx).
  std::span<const float> samples() const { return samples_; }
  size_t floats_per_sample() const { return 3 * basis_.terms() + 1; }

 private:
  SequenceMap() = default;
  GridPlace place_;
  TimeBasis basis_;
  size_t reference_ = 0;
  std::vector<float> samples_;
  float worst_contraction_ = 0, worst_determinant_ = 1;
  size_t folded_cells_ = 0;
  double largest_u_m_ = 0, cell_m_ = 0, moving_share_ = 0;
};

}  // namespace palpate
