#pragma once

#include <array>
#include <cstdint>

#include "compute/volume/field.h"
#include "module/haptics/proxy/back_track.h"
#include "tests/lab/stability/back_track_maps.h"
#include "tests/support/random.h"

namespace palpate::stability {

/// A field of 24^3 samples of 1 mm; the contraction bound of its worst cell is q.
Field flow_field(Flow flow, double q, test::Random& random);

/// The results of many searches for points.
struct Searches {
  /// The number of searches by the number of field reads after the first.
  std::array<int64_t, 65> steps{};
  int64_t count = 0;
  /// The point is wrong, or the search reports a failure.
  int64_t missed = 0;
  /// The point is wrong, and the search reports no failure.
  int64_t unseen = 0;
  /// Does not fit or is inverted, and the search reports no failure.
  int64_t wrong = 0;
  /// Largest residual of the searches that report no failure.
  double worst_cells = 0.0;
  double seconds = 0.0;
  int quantile(double q) const;  ///< of the steps
  void operator+=(const Searches& other);
};

/// `count` seeded searches as the haptic loop makes them: a hand of up to 1 m/s, and up to a tenth
/// of a step since the last search. phase: below zero, a random one for each. Every result is
/// checked independently of the search's own report.
Searches searched(const MotionMap& map, double phase, BackTracking method, test::Random random,
                  int count);

}  // namespace palpate::stability
