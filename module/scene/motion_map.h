#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compute/volume/field.h"
#include "module/scene/grid_place.h"

namespace palpate {

/// No data move by a kilometre; beyond that float squares would overflow in the certificates.
inline constexpr float kAbsurdM = 1e3F;

/// A motion field at a point of its fixed frame.
struct MotionSample {
  glm::dvec3 u_m;       ///< displacement to the next frame, volume space, m
  glm::dmat3 jacobian;  ///< column j is du/dx_j, no unit
  double confidence;    ///< 0 to 1
};

/// How safely the motion x + g u(x), g in [0, 1], can be inverted, over one cell of the field:
/// equation (29) bounded.
struct CellCertificate {
  /// q: bound of |u(b) - u(a)| / |b - a| within the cell; below 1 the fixed point converges for
  /// every g
  float contraction;
  /// a lower bound of det(I + g du/dx) over the cell and all g in [0, 1]; above 0: no fold
  float determinant;
};

/// One motion field laid out for the hand: 16 bytes a sample (u in volume space, m, and
/// confidence), trilinear, border clamped. Immutable, any thread, reads are real-time safe and
/// finite wherever x is, NaN included.
class MotionMap {
 public:
  /// `confidence` may be null (1 everywhere) and may have another grid. Computes the certificates,
  /// in parallel. A vector that is not finite becomes zero with confidence 0, and the cells around
  /// it count as folded. The field must have samples.
  static std::shared_ptr<const MotionMap> of(const Field& field,
                                             const Confidence* confidence = nullptr);

  /// Displacement, Jacobian and confidence from one read of 8 samples. The Jacobian is that of the
  /// trilinear field, so it jumps at cell faces; along an axis beyond the outermost samples it is
  /// zero.
  MotionSample sample(glm::dvec3 x_m) const noexcept;
  glm::dvec3 displacement(glm::dvec3 x_m) const noexcept;
  /// Of the cell that holds x. The clamped border has cells too.
  CellCertificate certificate(glm::dvec3 x_m) const noexcept;

  float worst_contraction() const { return worst_contraction_; }
  float worst_determinant() const { return worst_determinant_; }
  size_t folded_cells() const { return folded_cells_; }  ///< cells whose determinant bound is <= 0
  double largest_u_m() const { return largest_u_m_; }
  /// Share of the samples that move by more than a hundredth of a cell.
  double moving_share() const { return moving_share_; }
  size_t bytes() const {
    return samples_.size() * sizeof(glm::vec4) + cells_.size() * sizeof(CellCertificate);
  }
  /// Edge of a cell along its shortest axis, m: the unit "voxel" of residuals.
  double cell_m() const { return cell_m_; }
  /// Where the samples lie, and what they are: u in volume space (m) and confidence.
  const GridPlace& place() const { return place_; }
  std::span<const glm::vec4> samples() const { return samples_; }

 private:
  MotionMap() = default;
  GridPlace place_;
  std::vector<glm::vec4> samples_;
  /// (size + 1) along each axis: the first and the last are the clamped border
  std::vector<CellCertificate> cells_;
  float worst_contraction_ = 0, worst_determinant_ = 1;
  size_t folded_cells_ = 0;
  double largest_u_m_ = 0, cell_m_ = 0, moving_share_ = 0;
};

}  // namespace palpate
