#pragma once

#include <array>
#include <cstdint>

#include "compute/volume/field.h"
#include "module/haptics/back_track.h"
#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/draws.h"

namespace palpate::stability {

/// A field of 24^3 samples of 1 mm whose worst cell has the contraction bound q.
Field flow_field(Flow flow, double q, Draws& draws);

/// What came of many searches for points.
struct Searches {
  std::array<int64_t, 65> steps{};  ///< how many searches took so many reads after the first
  int64_t count = 0;
  int64_t missed = 0;        ///< the point is not right, or the search says so
  int64_t unseen = 0;        ///< the point is not right, and the search does not say so
  int64_t wrong = 0;         ///< does not fit or is inside out, and the search does not say so
  double worst_cells = 0.0;  ///< largest residual of those that are not called missed
  double seconds = 0.0;
  int quantile(double q) const;  ///< of the steps
  void operator+=(const Searches& other);
};

/// `count` seeded searches as a hand asks for them: up to 1 m/s of its own, and up to a tenth of a
/// step since the last time. phase: below zero, another one for each. Every answer is judged
/// afresh: the search's own word is not taken for it.
Searches searched(const MotionMap& map, double phase, BackTracking method, Draws draws, int count);

}  // namespace palpate::stability
