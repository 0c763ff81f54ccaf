#include "module/haptics/proxy/back_track.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>

#include "compute/volume/phantom.h"
#include "module/scene/transform.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

/// A smooth random field whose certificate is `q`; usually not at rest at its border.
std::shared_ptr<const MotionMap> smooth_map(const Grid& grid, Random& random, double shortest_mm,
                                            double q) {
  const Field field = test::smooth_field(grid, random, shortest_mm);
  const double now = MotionMap::of(field)->worst_contraction();
  return MotionMap::of(test::scaled(field, q / now));
}

double residual_m(const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 closing,
                  glm::dvec3 x) {
  return glm::length(x + phase * (map.displacement(x) + closing) - target);
}

glm::dvec3 some_place(const Grid& grid, Random& random, double beyond) {
  return volume_from_lps(grid.lps_from_index(test::some_index(grid, random, beyond)));
}

/// The number of back-trackings for each number of steps.
struct Histogram {
  std::array<int, 65> count{};
  int total = 0;
  void add(int steps) {
    ++count[size_t(steps)];
    ++total;
  }
  /// The number of steps that is enough for all but a share `beyond`.
  int quantile(double beyond) const {
    int left = total;
    for (size_t steps = 0; steps < count.size(); ++steps) {
      left -= count[steps];
      if (left <= beyond * total) return int(steps);
    }
    return int(count.size());
  }
  std::string text() const {
    std::string line;
    for (size_t steps = 0; steps < count.size(); ++steps)
      if (count[steps]) line += std::to_string(steps) + ": " + std::to_string(count[steps]) + "  ";
    return line;
  }
};

TEST(BackTrack, TurnsALinearMotionAroundInOneStep) {
  const Grid grid = test::oblique_grid();
  const glm::dmat3 slope(0.2, -0.1, 0.3, 0.0, 0.4, 0.1, -0.3, 0.2, -0.4);
  const auto map = MotionMap::of(test::linear_field(grid, {0.5, -0.4, 0.3}, slope));
  const glm::dvec3 x = volume_from_lps(grid.lps_from_index({6.2, 5.1, 3.3}));
  for (const double phase : {0.0, 0.3, 1.0}) {
    const glm::dvec3 target = x + phase * map->displacement(x);
    const BackTrack back = back_track(*map, phase, target, x + glm::dvec3(4e-4, 3e-4, -2e-4));
    EXPECT_TRUE(back.ok);
    EXPECT_EQ(back.steps, 1);
    // The slope of the stored field is right to 1e-6, over a distance of 0.5 mm.
    EXPECT_LT(glm::length(back.x_m - x), 1e-9);
    EXPECT_LT(glm::length(back.at.u_m - map->displacement(back.x_m)), 1e-15);
  }
}

TEST(BackTrack, ReadsOnceWhereTheStartIsTheAnswer) {
  Random random(3);
  const Grid grid = test::cube_grid(12, 1.5);
  const auto map = smooth_map(grid, random, 6.0, 0.8);
  const glm::dvec3 x = some_place(grid, random, 0.0);
  const glm::dvec3 closing(1e-4, -2e-4, 3e-4);
  const glm::dvec3 target = x + 0.7 * (map->displacement(x) + closing);
  const BackTrack back = back_track(*map, 0.7, target, x, closing);
  EXPECT_TRUE(back.ok);
  EXPECT_EQ(back.steps, 0);
  EXPECT_EQ(back.x_m, x);
}

TEST(BackTrack, IsRightEverywhereWhereTheFieldContracts) {
  Histogram warm, cold;
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const Grid grid = seed % 3 ? test::cube_grid(24, 1.0) : test::oblique_grid();
    const auto map = smooth_map(grid, random, random.draw(4.0, 16.0), random.draw(0.2, 0.99));
    for (int draw = 0; draw < 2000; ++draw) {
      const glm::dvec3 x = some_place(grid, random, 3.0);
      const glm::dvec3 closing = random.vector(1e-4);
      const double phase = random.draw(0.0, 1.0);
      const glm::dvec3 target = x + phase * (map->displacement(x) + closing);
      // As in use: the hand moves by up to 1 m/s and the data by up to a frame in 10 ms. So the
      // point of the last millisecond is at most a millimetre and a tenth of the displacement away.
      const glm::dvec3 last =
          x + random.vector(5e-4) + random.draw(-0.1, 0.1) * map->displacement(x);
      const BackTrack from_last = back_track(*map, phase, target, last, closing);
      const BackTrack from_target = back_track(*map, phase, target, target, closing);
      for (const BackTrack* back : {&from_last, &from_target}) {
        ASSERT_TRUE(back->ok) << "seed " << seed << " draw " << draw << " steps " << back->steps;
        const double left = residual_m(*map, phase, target, closing, back->x_m) / map->cell_m();
        ASSERT_LE(left, 1.01e-6) << "seed " << seed << " draw " << draw;
        // The map is one to one, so the point must be the one that was moved. det may be as small
        // as (1 - q)^3.
        ASSERT_LE(glm::length(back->x_m - x), 1e-4 * map->cell_m()) << "seed " << seed;
      }
      warm.add(from_last.steps);
      cold.add(from_target.steps);
    }
  }
  RecordProperty("warm_steps", warm.text());
  RecordProperty("cold_steps", cold.text());
  EXPECT_LE(warm.quantile(1e-3), 4) << warm.text();
  EXPECT_LE(cold.quantile(1e-3), 4) << cold.text();
}

TEST(BackTrack, TakesOneStepFromAFewMicrometres) {
  Random random(11);
  const Grid grid = test::cube_grid(24, 1.0);
  const auto map = smooth_map(grid, random, 8.0, 0.6);
  Histogram steps;
  for (int draw = 0; draw < 20000; ++draw) {
    const glm::dvec3 x = some_place(grid, random, 0.0);
    const double phase = random.draw(0.0, 1.0);
    const glm::dvec3 target = x + phase * map->displacement(x);
    const BackTrack back = back_track(*map, phase, target, x + random.vector(3e-6));
    ASSERT_TRUE(back.ok);
    steps.add(back.steps);
  }
  // A second step is needed only if a cell face is in between: 3 faces, 6 um of 1 mm on either
  // side.
  EXPECT_LE(steps.quantile(0.02), 1) << steps.text();
  EXPECT_LE(steps.quantile(0.0), 3) << steps.text();
}

TEST(BackTrack, IsNeverOkAtAWrongOrFoldedPointOfAnyField) {
  int refused = 0, accepted = 0;
  for (uint32_t seed = 1; seed <= 80; ++seed) {
    Random random(seed);
    const Grid grid = seed % 3 ? test::cube_grid(12, 1.0) : test::oblique_grid();
    const bool rough = seed % 2;
    const auto map = rough ? MotionMap::of(test::rough_field(grid, random, random.draw(0.2, 4.0)))
                           : smooth_map(grid, random, 5.0, random.draw(1.0, 6.0));
    for (int draw = 0; draw < 1000; ++draw) {
      const glm::dvec3 target = some_place(grid, random, 2.0);
      const glm::dvec3 start = target + random.vector(random.draw(0.0, 5e-3));
      const double phase = random.draw(0.0, 1.0);
      for (const BackTracking method : {BackTracking::kNewton, BackTracking::kPicard}) {
        const BackTrack back = back_track(*map, phase, target, start, glm::dvec3(0.0), method);
        const std::string where = "seed " + std::to_string(seed) + " draw " + std::to_string(draw);
        ASSERT_TRUE(std::isfinite(back.x_m.x + back.x_m.y + back.x_m.z)) << where;
        ASSERT_TRUE(std::isfinite(back.residual_m + back.at.u_m.x)) << where;
        const double left = residual_m(*map, phase, target, glm::dvec3(0.0), back.x_m);
        ASSERT_NEAR(left, back.residual_m, 1e-12) << where;
        ++(back.ok ? accepted : refused);
        if (!back.ok) continue;
        ASSERT_LE(left, 1.01e-6 * map->cell_m()) << where;
        const glm::dmat3 m = glm::dmat3(1.0) + phase * map->sample(back.x_m).jacobian;
        ASSERT_GT(glm::determinant(m), 0.0) << where;
      }
    }
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(accepted, 1000);
}

/// u = -1.5 x for |x| < 4 mm, and back to zero beyond: x + u folds between two sheets.
Field folding_field(const Grid& grid) {
  Field field = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const double x = grid.lps_from_index(glm::dvec3(i, j, k)).x;
        const double u = std::abs(x) < 4.0 ? -1.5 * x : -6.0 * (x > 0 ? 1.0 : -1.0);
        field.u_mm[grid.offset(i, j, k)].x = float(u);
      }
  return field;
}

TEST(BackTrack, DoesNotJumpOverAFoldToAnotherPartOfTheMaterial) {
  const Grid grid = test::cube_grid(33, 1.0);
  const auto map = MotionMap::of(folding_field(grid));
  EXPECT_GT(map->folded_cells(), 0U);
  // x = 7 mm is moved to 1 mm at the end of the step. So is x = -5 mm, on the other side of the
  // fold, and x = -2 mm within the fold.
  const glm::dvec3 target(1e-3, 0.0, 0.0), here(7e-3, 0.0, 0.0), there(-5e-3, 0.0, 0.0);
  const BackTrack from_here = back_track(*map, 1.0, target, here + glm::dvec3(2e-4, 0, 0));
  EXPECT_TRUE(from_here.ok);
  EXPECT_LT(glm::length(from_here.x_m - here), 1e-8);
  const BackTrack within = back_track(*map, 1.0, target, {-2e-3, 1e-4, 0.0});
  EXPECT_FALSE(within.ok);
  EXPECT_TRUE(back_track(*map, 1.0, target, there + glm::dvec3(2e-4, 0, 0)).ok);
  for (double start_m = -5e-3; start_m <= 3.9e-3; start_m += 1e-4) {
    const BackTrack back = back_track(*map, 1.0, target, {start_m, 0.0, 0.0});
    // A result from the far side or from inside the fold must never be x = 7 mm.
    if (back.ok) {
      EXPECT_LT(glm::length(back.x_m - there), 1e-8) << start_m;
    }
  }
  // Half of the step does not fold: 1 - 0.5 * 1.5 > 0.
  EXPECT_TRUE(back_track(*map, 0.5, {1e-3, 0.0, 0.0}, {0.0, 0.0, 0.0}).ok);
}

TEST(BackTrack, RefusesWhatIsNotANumber) {
  Random random(2);
  const Grid grid = test::cube_grid(6, 1.0);
  const auto map = smooth_map(grid, random, 6.0, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  const glm::dvec3 good(1e-3, 0.0, 0.0);
  const std::array<BackTrack, 6> all{back_track(*map, 0.5, {nan, 0, 0}, good),
                                     back_track(*map, 0.5, good, {0, inf, 0}),
                                     back_track(*map, nan, good, good),
                                     back_track(*map, 0.5, good, good, {0, 0, nan}),
                                     back_track(*map, 0.5, {0, -inf, inf}, {nan, 0, 0}),
                                     back_track(*map, 0.5, {1e300, 0, 0}, good)};
  for (const BackTrack& back : all) {
    EXPECT_FALSE(back.ok);
    EXPECT_TRUE(std::isfinite(back.x_m.x + back.x_m.y + back.x_m.z));
    EXPECT_TRUE(std::isfinite(back.at.u_m.x));
    EXPECT_FALSE(std::isnan(back.residual_m));
  }
}

TEST(BackTrack, PicardConvergesBelowOneAndDivergesBeyond) {
  const Grid grid = test::cube_grid(64, 1.0);
  const glm::dvec3 x(2e-3, 1e-3, -1e-3);
  for (const double slope : {0.5, 0.8, 1.2, 1.5}) {
    // x + u = (1 + slope) x does not fold, but the fixed-point iteration multiplies its error by
    // -slope.
    const auto map = MotionMap::of(test::linear_field(grid, glm::dvec3(0.0), glm::dmat3(slope)));
    const glm::dvec3 target = (1.0 + slope) * x;
    const glm::dvec3 start = x + glm::dvec3(1e-4);
    const BackTrack picard =
        back_track(*map, 1.0, target, start, glm::dvec3(0.0), BackTracking::kPicard);
    const BackTrack newton = back_track(*map, 1.0, target, start);
    EXPECT_EQ(picard.ok, slope < 1.0) << slope;
    EXPECT_TRUE(newton.ok) << slope;
    EXPECT_EQ(newton.steps, 1) << slope;
    if (slope < 1.0) {
      EXPECT_LT(glm::length(picard.x_m - newton.x_m), 1e-8) << slope;
      // From 0.1 mm to 1e-6 mm: log(1e-5) / log(q) steps, and some more for the length of the
      // diagonal.
      EXPECT_NEAR(picard.steps,
                  std::log(1e-6 / (0.1 * std::sqrt(3.0) * (1 + slope))) / std::log(slope), 2.0);
    }
  }
}

TEST(BackTrack, FollowsTheBeatingHeartToItsTruth) {
  const Grid grid = heart_grid(64);
  Histogram steps;
  for (int frame = 0; frame < 4; ++frame) {
    const auto map = MotionMap::of(shell_truth(grid, frame, (frame + 1) % 4));
    EXPECT_GT(map->worst_determinant(), 0.0F);
    Random random{uint32_t(frame)};
    for (int draw = 0; draw < 5000; ++draw) {
      const glm::dvec3 x = random.vector(0.045);
      const double phase = random.draw(0.0, 1.0);
      const glm::dvec3 target = x + phase * map->displacement(x);
      const BackTrack back = back_track(*map, phase, target, target);
      ASSERT_TRUE(back.ok);
      ASSERT_LT(glm::length(back.x_m - x), 1e-7);
      steps.add(back.steps);
    }
  }
  EXPECT_LE(steps.quantile(1e-3), 4) << steps.text();
}

}  // namespace
}  // namespace palpate
