#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "compute/volume/sequence_motion.h"
#include "module/scene/grid_place.h"
#include "module/scene/lanes.h"
#include "module/scene/motion_map.h"
#include "module/scene/spline.h"

namespace palpate {

/// One motion for a whole sequence laid out for the hand: at each sample all summands of u
/// (TimeBasis) next to each other (volume space, m) and the confidence, 12 bytes each and 4 more.
/// Between the samples u is the cubic B-spline of spline.h: a motion from one reference frame is
/// steep, and a trilinear one would bend a carried wall at the faces of its cells. Measured on
/// heart_cine (cells of 3.3 mm, u above 1 mm): such edges had 1.2 degrees in the median, 9 at one
/// in a hundred. Beyond the outermost samples the last one is repeated. Immutable, any thread.
class SequenceMap {
 public:
  /// `confidence` may be null (1 everywhere) and may have another grid. Searches for folds at all
  /// samples, at all frames and, unless the grid is large, midway between them; uses all cores.
  /// Where a vector of a term is not finite the material stands still, with confidence 0.
  static std::shared_ptr<const SequenceMap> of(const SequenceMotion& motion,
                                               const Confidence* confidence = nullptr);

  /// u(x, t). For many reads at one time see SequenceSnapshot. Real-time safe; finite wherever x
  /// is, NaN included.
  glm::dvec3 displacement(glm::dvec3 x_m, const TimeWeights& time) const noexcept;

  const TimeBasis& basis() const { return basis_; }
  size_t reference() const { return reference_; }
  /// The least det(I + du/dx) that was found.
  double least_determinant() const { return least_determinant_; }
  bool may_fold() const { return !(least_determinant_ > 0.0); }
  /// The largest number at one of the times that were searched.
  size_t folded_samples() const { return folded_; }
  double largest_u_m() const { return largest_u_m_; }
  /// Share of the samples that move by more than a hundredth of a cell at one of these times.
  double moving_share() const { return moving_share_; }
  size_t bytes() const { return coefficients_.size() * sizeof(float); }
  /// Edge of a cell along its shortest axis, m.
  double cell_m() const { return cell_m_; }
  const GridPlace& place() const { return place_; }

  /// The spline's coefficients: 3 summands() + 1 floats a sample, the summands in order, then the
  /// confidence. Shape (nz, ny, nx).
  std::span<const float> coefficients() const { return coefficients_; }
  size_t floats_per_sample() const { return 3 * basis_.summands() + 1; }

  /// The summands of u, m, at the samples of a grid `factor` (1 or more) times as fine, the first
  /// and last sample in common: for readers with another interpolation. Shape (summands, nz, ny,
  /// nx). Uses all cores.
  struct Samples {
    GridPlace place;
    std::vector<glm::vec3> u_m;
  };
  Samples samples(int factor) const;

 private:
  friend class SequenceSnapshot;
  SequenceMap() = default;
  void look_for_folds();
  GridPlace place_;
  TimeBasis basis_;
  size_t reference_ = 0;
  std::vector<float> coefficients_;
  double least_determinant_ = 1;
  size_t folded_ = 0;
  double largest_u_m_ = 0, cell_m_ = 0, moving_share_ = 0;
};

/// A SequenceMap at one time. Terms are summed once for each cell that is read, and then the reads
/// there cost no more than those of one field. One thread; real-time safe; the map must outlive it.
class SequenceSnapshot {
 public:
  SequenceSnapshot(const SequenceMap& map, const TimeWeights& time) noexcept : map_(map) {
    set(time);
  }
  void set(const TimeWeights& time) noexcept {
    time_ = time;
    blocks_[0].known = blocks_[1].known = false;
  }

  /// Reads blend from another motion to this one: the share (0 to 1) of this one. Both are
  /// described from the same frame; `before` is set by its owner, must outlive this, and is null
  /// for none.
  void blend_from(SequenceSnapshot* before, double share) noexcept {
    before_ = before;
    share_ = share;
  }

  const SequenceMap& map() const { return map_; }
  bool may_fold() const { return map_.may_fold() || (before_ && before_->may_fold()); }
  /// u, its Jacobian and the confidence.
  MotionSample sample(glm::dvec3 x_m) noexcept;
  glm::dvec3 displacement(glm::dvec3 x_m) noexcept;

 private:
  /// The 4 x 4 x 4 coefficients around a cell, summed.
  struct CoefficientBlock {
    bool known = false;
    glm::ivec3 cell{0};
    std::array<lanes::Float4, 64> u;
  };
  spline::Blend<lanes::Quad> read(glm::dvec3 x_m) noexcept;
  const CoefficientBlock& block(const spline::Around& around) noexcept;

  const SequenceMap& map_;
  TimeWeights time_;
  std::array<CoefficientBlock, 2> blocks_;  ///< a way may lead to and fro over a face
  int newest_ = 0;
  SequenceSnapshot* before_ = nullptr;
  double share_ = 1.0;
};

}  // namespace palpate
