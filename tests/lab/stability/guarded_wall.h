#pragma once

#include <functional>
#include <memory>

#include "module/haptics/proxy/haptics.h"
#include "tests/lab/stability/spring_wall.h"

namespace palpate::stability {

/// palpate's whole haptic step at a wall of data at x > 0, in one dimension: scene, sweep, tank,
/// lead and every guard, after the start ramp.
class GuardedWall {
 public:
  /// knows: the device reports the stiffness that it can render, b / (T/2 + delay), and palpate
  /// uses no more; else it reports nothing, and only the guards act.
  GuardedWall(const StabilityCase& at, bool knows, const HapticsOptions& options = {});
  /// The force along x for a position, and time since the last one.
  double push_n(double x_m, double dt_s) noexcept;
  /// The present stiffness of the wall, N/m: not above the device's limit.
  double stiffness_n_per_m() const { return haptics_.run()->stiffness_n_per_m; }
  /// Whether a guard has reported that it lowers the force, since forget() or the start.
  bool heard() const { return heard_; }
  void forget() { heard_ = false; }

 private:
  Haptics haptics_;
  TickInput input_;
  bool heard_ = false;
};

/// run_stability() with palpate's whole step between encoder and motor; `heard`: a guard lowered
/// the force in the watched part.
StabilityResult run_guarded(const StabilityCase& at, bool knows,
                            const HapticsOptions& options = {});

}  // namespace palpate::stability
