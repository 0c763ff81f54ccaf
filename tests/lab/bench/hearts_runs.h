#pragma once

#include <array>
#include <string>

#include "module/haptics/servo/statistics.h"
#include "module/haptics/tick.h"
#include "tests/lab/bench/hearts_data.h"

namespace palpate::bench {

/// The result of a hand that leans on a place.
enum class Outcome {
  kNothingMet,  ///< there is no surface within 8 mm behind the place
  /// Never below 0.3 N after it pressed.
  kHeld,
  /// Weaker for a time, but the hand was outside of the wall: the wall moved away.
  kLeft,
  /// Weaker for a time with the hand inside, for a reported cause.
  kFaded,
  /// The hand or the proxy went behind the wall.
  kFell,
};
const char* word(Outcome outcome);

/// The largest change of the force from one tick to the next, and its conditions.
struct LargestChange {
  double n_per_ms = 0.0;
  double by_hand_n = 0.0;  ///< stiffness times the hand's step relative to the material
  /// The largest amount by which a change exceeds this.
  double beyond_n = 0.0;
  Cause cause = Cause::kNone;  ///< of its tick
  /// A point could not be found in this tick.
  bool held = false;
  double at_s = 0.0;
};

struct RunResult {
  Outcome outcome = Outcome::kNothingMet;
  /// Share of the time behind the wall with less force than the wall should give.
  double weak = 0.0;
  /// Share of the time with less force than the wall should give, wherever the hand is.
  double absent = 0.0;
  /// While the wall had to hold.
  double least_n = 0.0, mean_n = 0.0;
  /// Of the proxy's material behind the place where it was met.
  double deepest_mm = 0.0;
  double fell_at_s = -1.0;
  LargestChange change;
  /// Ticks with each cause while the wall had to hold.
  std::array<int, 32> causes{};
  /// The hand's target in the motion's reference frame, each ms from the first press.
  std::vector<glm::dvec3> meant;
  /// Places while touching, at the times of frames: frame, place.
  std::vector<std::pair<int, glm::dvec3>> proxies;
};

/// The hand's path along the wall while it leans on it.
enum class Way { kHold, kStroke, kCircle };
const char* word(Way way);

/// A human hand (measured impedance) moves along the wall's normal while the heart stands still,
/// and leans on it with 1 N, or means to follow a path (MeantPath). Then the sequence plays for
/// `seconds` while the hand holds, strokes or circles (20 mm, or the path's). Deterministic: ticks
/// of 1 ms, no clock but for `ticks`. along: `meant` of a run in motion. The hand then takes the
/// same path over the material while this stands still, which separates effects of the motion from
/// those of the wall.
RunResult lean_on(const Subject& subject, const Wall& wall, const Felt& felt, bool moving,
                  const Place& place, Way way, double seconds, Histogram* ticks = nullptr,
                  const std::vector<glm::dvec3>* along = nullptr);

}  // namespace palpate::bench
