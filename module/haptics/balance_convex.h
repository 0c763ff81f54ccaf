#pragma once

#include <array>
#include <glm/glm.hpp>

#include "module/haptics/balance.h"

namespace palpate {

/// The general case of balance(): the proxy of any planes, lines and points, no two of which need
/// to meet. With y the proxy and everything divided by the stiffness (strengths become reaches in
/// m), the minimum of
///   1/2 |y - probe|^2 + sum_i r_i phi_i(y)
/// is where forces f_i exist with y = probe + sum f_i and f_i a subgradient of -r_i phi_i at y.
///
/// Method: of multipliers (augmented Lagrangian). Each kink is rounded off over a width e_i:
///   f_i(y) = P_i(f_i' - (r_i / e_i) w_i(y)),
/// w_i the offset of y from the primitive, f_i' the force of the round before, P_i the projection
/// on what the primitive can give (a plane: t q, 0 <= t <= r; a line: the disc of radius r
/// perpendicular to it; a point: the ball). Each round has a smooth strongly convex problem in
/// three unknowns, solved by Newton's method (semismooth: f_i has kinks) with a search along the
/// line that never passes the minimum by much. f_i is exactly a subgradient at w_i + (f_i - f_i')
/// e_i / r_i, so primitive i is wrong by e_i |f_i - f_i'| / r_i metres and no more; the rounds end
/// when that is within round-off of positions for all. Widths shrink by a fixed factor where it is
/// not. As |f_i - f_i'| <= 2 r_i, a width of half the round-off ends the rounds whatever the
/// forces do: their number is bounded by kMaxRounds. Where the forces are not unique (planes that
/// repeat), they are shared in proportion to strength, whatever the order.
///
/// Round-off: offsets and the spring are kept as numbers of their own and only updated, so near the
/// solution they are small and their relative precision is what counts.
/// Real-time safe: no allocation, noexcept, at most kMaxIterations of cost O(primitives).
class ConvexBalance {
 public:
  static constexpr int kMaxRounds = 12;
  static constexpr int kMaxIterations = 200;
  /// Forces are balanced to this: a tenth is kept for the round-off of adding them.
  static constexpr double kResidualN = 1e-9;

  ConvexBalance(glm::dvec3 probe, double stiffness_n_per_m) noexcept
      : probe_(probe), stiffness_(stiffness_n_per_m) {}

  /// Each at most PrimitiveSet::kCapacity times. q needs not be of unit length.
  void add_plane(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept;
  void add_line(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept;
  void add_point(glm::dvec3 position, double strength_n) noexcept;

  /// May be called again after more was added; starts where the last call ended.
  Balance solve() noexcept;

  /// Force of the i-th plane that was added, in N, after solve(): 0 to its strength.
  double plane_force_n(int i) const noexcept { return planes_[size_t(i)].force * stiffness_; }

 private:
  /// Sign: the force is force * q, height < 0 behind the plane.
  struct Plane {
    glm::dvec3 position, q;
    double reach, width, slack;
    double height, step;       // of the proxy; and how it changes along the Newton step
    double force, next_force;  // of the round before; and now
    bool held, would_hold;
  };
  /// A line; or a point, which is a line without a direction.
  struct Line {
    glm::dvec3 position, q;
    double reach, width, slack;
    glm::dvec3 offset, step;
    glm::dvec3 force, next_force;
    bool held, would_hold;
  };
  /// Symmetric.
  struct Matrix {
    double xx, xy, xz, yy, yz, zz;
  };

  static constexpr size_t kMaxKinks = 6 * PrimitiveSet::kCapacity;

  void start() noexcept;
  void place() noexcept;
  double slack(glm::dvec3 position) const noexcept;
  template <bool kPredicted = false>
  void evaluate(double along) noexcept;
  void aim() noexcept;
  void predict() noexcept;
  size_t kinks(std::array<double, kMaxKinks>& places) const noexcept;
  void step_to(double along) noexcept;
  double search(double slope) noexcept;
  bool newton() noexcept;
  bool end_round() noexcept;
  static glm::dvec3 solve(const Matrix& a, glm::dvec3 b) noexcept;

  glm::dvec3 probe_;
  double stiffness_;
  std::array<Plane, PrimitiveSet::kCapacity> planes_;
  std::array<Line, 2 * PrimitiveSet::kCapacity> lines_;
  size_t plane_count_ = 0, line_count_ = 0;
  bool started_ = false;

  glm::dvec3 proxy_{0.0}, proxy_low_{0.0};  // their sum is the proxy
  glm::dvec3 spring_{0.0};                  // proxy - probe
  glm::dvec3 newton_step_{0.0};
  glm::dvec3 rest_{0.0};  // gradient: what is left of spring and forces
  Matrix curvature_{};
  double tolerance_ = 0.0, farthest_ = 0.0, smallest_ = 0.0;
  int iterations_ = 0;
};

}  // namespace palpate
