#pragma once

#include <array>
#include <glm/glm.hpp>

#include "module/haptics/proxy/balance.h"

namespace palpate {

/// The general case of balance(): the proxy of any planes, lines and points, no two of which need
/// to meet. With y the proxy and everything divided by the stiffness (strengths become reaches in
/// m), the minimum of
///   1/2 |y - probe|^2 + sum_i r_i phi_i(y)
/// is where forces f_i exist with y = probe + sum f_i and f_i a subgradient of -r_i phi_i at y.
///
/// Method: of multipliers (augmented Lagrangian). Each kink is rounded off over a width e_i:
///   f_i(y) = P_i(f_i' - (r_i / e_i) w_i(y)),
/// w_i the offset of y from the primitive, f_i' its force of the round before, P_i the projection
/// on what it can give (a plane: t q, 0 <= t <= r; a line: the disc of radius r perpendicular to
/// it; a point: the ball). A round is a smooth, strongly convex problem in three unknowns: Newton's
/// method (semismooth, as f_i has kinks) with a search along the step between those kinks. f_i is
/// exactly a subgradient at w_i + (f_i - f_i') e_i / r_i, so primitive i is misplaced by
/// e_i |f_i - f_i'| / r_i and no more. The rounds end when that is round-off for all; widths shrink
/// by 1000 where it is not.
///
/// Bounds: |f_i - f_i'| <= 2 r_i, so a width of half the round-off ends the rounds for primitive i
/// whatever the forces do: at most 6 rounds need it, and primitives mostly share them. Within a
/// round every step from the 13th on lowers the round's energy (but for round-off), so Newton's
/// method ends. Both are capped, kMaxRounds and kMaxIterations, and converged says if a cap was
/// met. Where forces are not unique (planes that repeat) they are shared in proportion to strength,
/// whatever the order.
///
/// Most rounds only improve digits of a result whose active set is right already. So after each
/// round solve_active() computes the exact solution for the present active set, and it is taken if
/// it satisfies all constraints.
///
/// Round-off: offsets and spring are numbers of their own that are only updated, so near the
/// solution they are small and it is their relative precision that counts. The proxy then is the
/// exact one of primitives that are moved by a few units in the last place of the largest
/// coordinate (at least 1 mm), and forces are balanced to kResidualN there.
///
/// A pass that meets a cap is done once more with fresh widths, from where it ended: of a million
/// random sets (balance_sets_test, PALPATE_BALANCE_SETS) two need it.
///
/// Which cases need this solver: heart, shell and molecule, felt with their own modes, never do;
/// balance() has closed forms for them. Tests of several modes, volumes and commands of the hand
/// do: two planes with friction, also with one or two forces, and a plane with a point.
///
/// Real-time safe: no allocation, noexcept, at most 2 kMaxIterations of cost O(primitives log
/// primitives).
class ConvexBalance {
 public:
  static constexpr int kMaxRounds = 40;
  static constexpr int kMaxIterations = 100;
  static constexpr double kResidualN = 1e-9;

  ConvexBalance(glm::dvec3 probe, double stiffness_n_per_m) noexcept
      : probe_(probe), stiffness_(stiffness_n_per_m) {}

  /// Each at most PrimitiveSet::kCapacity times. q needs not be of unit length.
  void add_plane(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept;
  void add_line(glm::dvec3 position, glm::dvec3 q, double strength_n) noexcept;
  void add_point(glm::dvec3 position, double strength_n) noexcept;

  /// May be called again after primitives were added; starts where the last call ended.
  /// shares_matter: plane_force_n() will be called afterwards; this takes longer where forces are
  /// not unique. The hint is tried first and updated.
  Balance solve(bool shares_matter, BalanceHint::Stage* hint) noexcept;

  /// Force of the i-th plane that was added, in N, after solve(): 0 to its strength.
  double plane_force_n(int i) const noexcept { return planes_[size_t(i)].force * stiffness_; }

 private:
  /// Sign: the force is force * q, height < 0 behind the plane.
  struct Plane {
    glm::dvec3 position, q;
    double reach, width, slack;
    double height, step;       // of the proxy; and how it changes along the Newton step
    double force, next_force;  // of the round before; and now
    bool active, would_be_active;
    double exact_height, exact_force;  // of solve_active()
  };
  /// A line; or a point, which is a line without a direction.
  struct Line {
    glm::dvec3 position, q;
    double reach, width, slack;
    glm::dvec3 offset, step;
    glm::dvec3 force, next_force;
    bool active, would_be_active;
    glm::dvec3 exact_offset, exact_force;
  };
  /// Symmetric.
  struct SymmetricMatrix {
    double xx, xy, xz, yy, yz, zz;
  };

  static constexpr size_t kMaxKinks = 6 * PrimitiveSet::kCapacity;

  Balance pass(bool shares_matter, BalanceHint::Stage* hint) noexcept;
  void start() noexcept;
  void place() noexcept;
  double slack(glm::dvec3 position) const noexcept;
  template <bool kPredicted = false>
  void evaluate(double along) noexcept;
  void aim() noexcept;
  void predict() noexcept;
  size_t kinks(std::array<double, kMaxKinks>& places) const noexcept;
  void step_to(double along) noexcept;
  double search(double slope, bool strict) noexcept;
  bool newton() noexcept;
  bool end_round() noexcept;
  /// The exact solution for the present active set: up to three directions are fixed exactly, and
  /// Newton's method without kinks solves for the rest. True, with proxy and forces set, if every
  /// primitive can give the force that this needs; else nothing is changed. Where more directions
  /// are active than are independent and shares matter, this works only once the rounds have found
  /// the shares.
  bool solve_active() noexcept;
  struct ActiveSet;
  ActiveSet active_set() noexcept;
  bool go_to_active(const ActiveSet& active, glm::dvec3& proxy, glm::dvec3& rest) noexcept;
  bool solve_active_of(const BalanceHint::Stage& hint) noexcept;
  void remember(BalanceHint::Stage& hint) const noexcept;
  glm::dvec3 exact_rest(glm::dvec3 proxy) noexcept;
  SymmetricMatrix sliding_curvature() const noexcept;
  bool all_can() const noexcept;
  static glm::dvec3 solve(const SymmetricMatrix& a, glm::dvec3 b) noexcept;

  glm::dvec3 probe_;
  double stiffness_;
  std::array<Plane, PrimitiveSet::kCapacity> planes_;
  std::array<Line, 2 * PrimitiveSet::kCapacity> lines_;
  size_t plane_count_ = 0, line_count_ = 0;
  bool started_ = false, shares_matter_ = true;

  glm::dvec3 proxy_{0.0}, proxy_low_{0.0};  // their sum is the proxy
  glm::dvec3 spring_{0.0};                  // proxy - probe
  glm::dvec3 newton_step_{0.0};
  glm::dvec3 rest_{0.0};  // gradient: what is left of spring and forces
  SymmetricMatrix curvature_{};
  double tolerance_ = 0.0, farthest_ = 0.0, smallest_ = 0.0;
  int iterations_ = 0, exact_steps_ = 0;
};

}  // namespace palpate
