#pragma once

#include <functional>
#include <memory>

#include "module/haptics/haptics.h"
#include "tests/lab/stability/spring_wall.h"

namespace palpate::stability {

/// palpate's whole haptic step at a wall of data that lies at x > 0, one dimension: scene, sweep,
/// tank, lead and every guard, started and on.
class GuardedWall {
 public:
  /// knows: the device says which stiffness it holds, b / (T/2 + delay), so that palpate asks for
  /// no more; else it says nothing and only the guards are left.
  GuardedWall(const StabilityCase& at, bool knows, const HapticsOptions& options = {});
  /// The force along x for a position, and time since the last one.
  double push_n(double x_m, double dt_s) noexcept;
  /// What the wall's stiffness is by now, N/m: not above what the device holds.
  double stiffness_n_per_m() const { return haptics_.run()->stiffness_n_per_m; }
  /// A guard said that it lowers the force, since forget() or the start.
  bool heard() const { return heard_; }
  void forget() { heard_ = false; }

 private:
  Haptics haptics_;
  TickInput input_;
  bool heard_ = false;
};

/// run_stability() with palpate's whole step between encoder and motor; `heard` tells that a guard
/// lowered the force in the part that was watched.
StabilityResult run_guarded(const StabilityCase& at, bool knows,
                            const HapticsOptions& options = {});

}  // namespace palpate::stability
