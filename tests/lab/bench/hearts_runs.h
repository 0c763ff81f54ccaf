#pragma once

#include <array>
#include <string>

#include "module/haptics/statistics.h"
#include "module/haptics/tick.h"
#include "tests/lab/bench/hearts_data.h"

namespace palpate::bench {

/// What came of a hand that leans on a place.
enum class Outcome {
  kNothingMet,  ///< there is no surface within 8 mm behind the place
  kHeld,        ///< never below 0.3 N once it pressed
  kLeft,        ///< weaker for a time, but the hand was outside of the wall: the wall went away
  kFaded,       ///< weaker for a time with the hand inside, for a reason that was said
  kFell,        ///< the hand or the proxy went in behind the wall
};
const char* word(Outcome outcome);

/// The largest change of the force from one tick to the next, and what was there.
struct LargestChange {
  double n_per_ms = 0.0;
  double by_hand_n = 0.0;      ///< stiffness times the hand's step relative to the material
  double beyond_n = 0.0;       ///< the largest change that exceeds this, by how much
  Cause cause = Cause::kNone;  ///< of its tick
  bool held = false;           ///< a point could not be found in it
  double at_s = 0.0;
};

struct RunResult {
  Outcome outcome = Outcome::kNothingMet;
  double weak = 0.0;  ///< share of the time behind the wall with less than it should hold
  double least_n = 0.0, mean_n = 0.0;  ///< while it was to hold
  double deepest_mm = 0.0;             ///< of the proxy's material behind where it was met
  double fell_at_s = -1.0;
  LargestChange change;
  std::array<int, 32> causes{};  ///< ticks with each cause while it was to hold
  /// Where the hand meant to be, in the motion's reference frame, each ms from when it pressed.
  std::vector<glm::dvec3> meant;
  /// places while touching, at the times of frames: frame, place
  std::vector<std::pair<int, glm::dvec3>> proxies;
};

/// The hand's way along the wall while it leans on it.
enum class Way { kHold, kStroke, kCircle };

/// A human hand (measured impedance) comes along the wall's normal while the heart stands still,
/// leans on it with 1 N, and then the sequence plays for `seconds` while the hand holds, strokes or
/// circles (20 mm). Deterministic: ticks of 1 ms, no clock but for `ticks`. along: `meant` of a run
/// in motion: the hand goes the same way over the material while that stands still, which tells
/// what the motion does from what the wall is.
RunResult lean_on(const Subject& subject, const Wall& wall, const Felt& felt, bool moving,
                  const Place& place, Way way, double seconds, Histogram* ticks = nullptr,
                  const std::vector<glm::dvec3>* along = nullptr);

}  // namespace palpate::bench
