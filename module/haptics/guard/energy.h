#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "module/scene/scene_spec.h"

namespace palpate {

/// How much a scene may push. Values that make no sense (negative, NaN) count as 0.
struct EnergyTankOptions {
  /// the most it stores, and what it starts with: the energy that one push may cost
  double capacity_j = 0.1;
  double allowance_w = 0.05;  ///< flows in continuously: so much power may move the hand
  /// the share, 0 to 1, of what the scene took out of the spring that flows back
  double dissipated_share = 1.0;
};

/// What happened to the spring's energy since the start, J.
struct EnergyLedger {
  double put_in_j = 0.0;  ///< by the scene: moving data and transforms, forces, a stiffer spring
  double dissipated_j = 0.0;  ///< taken out by the scene: yielding, friction, a retreating surface
  /// made by sampling: the force is constant while the hand moves on (zero-order hold)
  double sampling_j = 0.0;
  double refused_j = 0.0;  ///< asked for by the scene and not given
  double charged_j = 0.0;  ///< flowed into the tank
  int64_t slips = 0;       ///< frames in which the surface slipped past
};

/// One spring of the tool in a haptic frame, m.
struct SpringMove {
  glm::dvec3 from{0.0};   ///< the proxy after the last frame
  glm::dvec3 to{0.0};     ///< after carrying and solving
  glm::dvec3 probe{0.0};  ///< its other end, now
  /// The part of the probe's way since the last frame for which the hand felt nothing: a turn of
  /// the grip on a device that gives no torque.
  glm::dvec3 turned{0.0};
};

/// Measures the energy that a moving scene puts into the spring between probe and proxy, and lets
/// the surface slip past the hand when the scene has spent its budget.
///
/// In one haptic frame first the hand moves the probe p by dp while the force is constant, then the
/// scene moves the proxy from x to x'. With f = k (x - p) the force on the hand, exactly
///   f.dp = -change of (k/2 |x - p|^2) + (k/2 |x' - p|^2 - k/2 |x - p|^2 after dp) + k/2 |dp|^2:
/// the work done on the hand is the spring's loss, plus what the scene put in (booked as put in or
/// as dissipated, by its sign), plus the sampling energy. A change of k between two frames is the
/// scene's: it is booked at the proxy and probe of the frame in which it shows. So is what a turn
/// of the grip that the hand does not feel does to the spring, between hand and scene. A tool of
/// several points has a spring for each; f, x, p and dp are then those of all. Over any run
///   work on the hand = put in - dissipated + sampling - (spring's energy at the end - at the
/// start). The tank pays for what is put in and is charged by the allowance and by a share of what
/// was dissipated beyond the sampling energy (in free motion the spring "loses" k/2 |dp|^2 that no
/// hand ever gave), so
///   put in <= capacity + charged  and, with a share <= 1,
///   work on the hand <= capacity + allowance * time + sampling + the spring's energy at the start.
/// The sampling energy is the loop's own lack of passivity; the device's damping and the guards
/// have to cover it. The coupling's damping kd only removes energy and is not counted.
///
/// A value; no clock, no allocation. Space: the one in which proxy and probe are, m. Where the
/// world is a magnified device space, one joule here is 1/scale joule at the hand.
class EnergyTank {
 public:
  explicit EnergyTank(const EnergyTankOptions& options = {}) noexcept;

  /// Sets each spring's `to` to what the scene can pay for: as it is if it can, else
  /// from + a (to - from) with the largest a in [0, 1] that it can, the same for all. Call once a
  /// haptic frame. stiffness: of each spring, > 0. If a rise of the stiffness and turns alone are
  /// more than the tank holds, the proxies are drawn towards their probes until they are not. As
  /// the result is between `from` and `to`, the force of a spring steps by at most max(step without
  /// the tank, k |dp|). Anything not finite: `from`, nothing booked. dt_s not finite or <= 0: no
  /// allowance. 1 to kMostToolPoints springs, as many as in the frame before, or call restart().
  /// Real-time safe.
  void limit(std::span<SpringMove> springs, double stiffness_n_per_m, double dt_s) noexcept;

  /// Pays for the work, J, that a force other than the spring's did on the hand; negative work is
  /// booked as dissipated. Work beyond the tank's content is booked as put in too, and repaid
  /// before the tank fills again. Not finite: nothing. Real-time safe.
  void pay(double joule) noexcept;

  /// Forgets the last frame's probes and stiffness: call when the proxy is put to the probe (start,
  /// scene change). Energy and ledger stay.
  void restart() noexcept { known_ = false; }

  double energy_j() const noexcept { return energy_j_; }
  /// What the scene put into the spring in the last frame; negative: took out.
  double last_j() const noexcept { return last_j_; }
  bool slipped() const noexcept { return slipped_; }
  EnergyLedger ledger() const noexcept;

 private:
  // A sum that keeps what rounding drops, so that small amounts add up correctly over a day.
  struct CompensatedSum {
    double high = 0.0, low = 0.0;
    void add(double value) noexcept;
    double value() const noexcept { return high + low; }
  };
  void charge(double joule) noexcept;
  void book(double joule, double sampling_j) noexcept;

  EnergyTankOptions options_;
  double energy_j_ = 0.0, last_j_ = 0.0;
  double debt_j_ = 0.0;  // what rounding overdrew
  bool slipped_ = false, known_ = false;
  std::array<glm::dvec3, kMostToolPoints> last_probes_{};
  double last_stiffness_ = 0.0;
  CompensatedSum put_in_, dissipated_, sampling_, refused_, charged_;
  int64_t slips_ = 0;
};

}  // namespace palpate
