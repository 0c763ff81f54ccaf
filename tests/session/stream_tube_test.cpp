// Stream tubes laid by the hand: field lines of flows whose lines are given by a formula, and tubes
// carried by a motion that is given by a formula.
#include "module/session/stream_tube.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "compute/volume/phantom.h"
#include "module/scene/field_line.h"
#include "module/scene/make_volume.h"
#include "tests/session/made_session.h"

namespace palpate {
namespace {

constexpr double kCell_m = 1e-3;

/// 48^3 samples of 1 mm around the origin of volume space.
Grid tube_cube(int n = 48) {
  Grid grid;
  grid.size = glm::ivec3(n);
  grid.origin_mm = glm::dvec3(-0.5 * (n - 1));
  return grid;
}

/// A vector frame from a formula over volume space (m), values along volume space's axes.
template <class Formula>
std::shared_ptr<const FrameData> vectors(const Formula& formula) {
  const Grid grid = tube_cube();
  std::vector<glm::vec3> values;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 v = formula(volume_from_lps(grid.lps_from_index({i, j, k})));
        values.emplace_back(1e-3 * lps_from_volume(v));
      }
  return sampled_vector(grid, std::move(values));
}

template <class Formula>
Field field(const Grid& grid, const Formula& u_m) {
  Field made{grid, {}};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        made.u_mm.emplace_back(
            lps_from_volume(u_m(volume_from_lps(grid.lps_from_index({i, j, k})))));
  return made;
}

/// Rotation about the z axis, in metres per second at one metre.
glm::dvec3 turning(glm::dvec3 x) {
  return {-x.y, x.x, 0.0};
}

double apart_m(const std::vector<glm::dvec3>& a, const std::vector<glm::dvec3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0.0;
  for (size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    most = std::max(most, glm::distance(a[k], b[k]));
  return most;
}

TEST(FieldLine, IsOfFourthOrder) {
  constexpr double kRadius_m = 0.010;
  LineOptions options{glm::dvec3(-1.0), glm::dvec3(1.0)};
  double before_m = 0.0;
  for (const int steps : {256, 512, 1024}) {
    options.most_steps = steps;
    options.step_m = 2.0 * std::numbers::pi * kRadius_m / steps;
    const FieldLine line = field_line(turning, {kRadius_m, 0.0, 0.0}, 1.0, options);
    ASSERT_EQ(line.places_m.size(), size_t(steps) + 1);
    const double error_m = glm::distance(line.places_m.back(), line.places_m.front());
    if (before_m > 0.0) {
      EXPECT_NEAR(std::log2(before_m / error_m), 4.0, 0.15);
    }
    before_m = error_m;
  }
}

TEST(StreamTube, OfACircularFlowIsAClosedCircle) {
  const auto volume = test::still(vectors(turning));
  for (const double radius_m : {0.004, 0.010, 0.020}) {
    const auto tube = StreamTube::release(volume, true, TubeField::kVectors, {},
                                          {0.6 * radius_m, 0.8 * radius_m, 0.003});
    ASSERT_TRUE(tube) << tube.error().message;
    EXPECT_TRUE(tube->closed());
    EXPECT_EQ(tube->released_m().front(), tube->released_m().back());
    // One whole turn and no further, in steps of at most half a cell.
    const double round_m = 2.0 * std::numbers::pi * radius_m;
    double length_m = 0.0;
    for (size_t k = 1; k < tube->released_m().size(); ++k) {
      const double step_m = glm::distance(tube->released_m()[k - 1], tube->released_m()[k]);
      EXPECT_LT(step_m, 0.501 * kCell_m);
      length_m += step_m;
    }
    EXPECT_NEAR(length_m, round_m, 0.001 * round_m);
    double most_m = 0.0;
    for (size_t k = 0; k < tube->released_m().size(); ++k) {
      const glm::dvec3 x = tube->released_m()[k];
      most_m = std::max(most_m, std::abs(std::hypot(x.x, x.y) - radius_m));
      most_m = std::max(most_m, std::abs(x.z - 0.003));
      // The spline of a linear field is exact but for float rounding and the border.
      EXPECT_NEAR(tube->lengths()[k], radius_m, 1e-4 * radius_m);
    }
    // In one turn the Runge-Kutta method leaves the circle by about 2 pi (h / r)^5 / 144 of the
    // radius ...
    const double h = 0.5 * kCell_m / radius_m;
    EXPECT_LT(most_m, 2.0 * std::numbers::pi * std::pow(h, 5) / 144.0 * radius_m + 1e-4 * kCell_m)
        << "radius " << radius_m;
    RecordProperty("most_off_cells_at_" + std::to_string(int(1e3 * radius_m)) + "_mm",
                   std::to_string(most_m / kCell_m));
  }
}

TEST(StreamTube, OfAVortexWithACoreIsACircleToo) {
  // The flow is curved in space, so the interpolation error of the direction is measured here.
  const double core_m = 0.006;
  const auto volume = test::still(vectors([&](glm::dvec3 x) {
    const double r2 = (x.x * x.x + x.y * x.y) / (core_m * core_m);
    return turning(x) * std::exp(-r2);
  }));
  const auto tube =
      StreamTube::release(volume, true, TubeField::kVectors, {}, {0.007, 0.0, -0.002});
  ASSERT_TRUE(tube) << tube.error().message;
  EXPECT_TRUE(tube->closed());
  double most_m = 0.0;
  for (const glm::dvec3 x : tube->released_m())
    most_m = std::max(most_m, std::abs(std::hypot(x.x, x.y) - 0.007));
  EXPECT_LT(most_m, 0.005 * kCell_m);
  RecordProperty("most_off_cells", std::to_string(most_m / kCell_m));
}

TEST(StreamTube, OfAScrewRunsBothWaysFromTheHand) {
  constexpr double kRise = 0.002;
  const auto volume =
      test::still(vectors([](glm::dvec3 x) { return turning(x) + glm::dvec3(0.0, 0.0, kRise); }));
  const glm::dvec3 seed(0.012, 0.0, 0.0);
  const auto tube = StreamTube::release(volume, true, TubeField::kVectors, {}, seed);
  ASSERT_TRUE(tube) << tube.error().message;
  EXPECT_FALSE(tube->closed());
  ASSERT_GT(tube->seed(), 10U);
  EXPECT_EQ(tube->released_m()[tube->seed()], seed);
  // Upstream is below, downstream above, and the angle of each point follows from its height.
  double turns = 0.0, angle = 0.0;
  for (size_t k = tube->seed(); k < tube->released_m().size(); ++k) {
    const glm::dvec3 x = tube->released_m()[k];
    const double now = std::atan2(x.y, x.x);
    turns += std::remainder(now - angle, 2.0 * std::numbers::pi);
    angle = now;
    EXPECT_NEAR(x.z, kRise * turns, 1e-3 * kCell_m);
  }
  EXPECT_GT(turns, 6.0);
  EXPECT_LT(tube->released_m().front().z, -0.01);
}

/// A flow across, in two frames: in the second it is twice as fast and rotated by a right angle.
/// The material rises by 4 mm.
std::shared_ptr<const MovingVolume> stream_that_turns() {
  MovingVolume volume;
  volume.times = {{0.0, 1.0}, 0.0};
  volume.frames = {vectors([](glm::dvec3) { return glm::dvec3(1.0, 0.0, 0.0); }),
                   vectors([](glm::dvec3) { return glm::dvec3(0.0, 0.0, 2.0); })};
  volume.motions = {
      {"data",
       {MotionMap::of(field(tube_cube(), [](glm::dvec3) { return glm::dvec3(0, 0.004, 0); }))}}};
  return std::make_shared<const MovingVolume>(std::move(volume));
}

TEST(StreamTube, BetweenFramesFollowsWhatAModeReadsThere) {
  const auto volume = stream_that_turns();
  const FramePointer half{0, 0.5};
  const glm::dvec3 seed(0.001, 0.002, 0.003);
  const auto blended = StreamTube::release(volume, true, TubeField::kVectors, half, seed);
  ASSERT_TRUE(blended) << blended.error().message;
  // (1, 0, 0) and (0, 0, 2), half of each.
  const glm::dvec3 along = glm::normalize(glm::dvec3(0.5, 0.0, 1.0));
  for (const glm::dvec3 x : blended->released_m())
    EXPECT_LT(glm::length(glm::cross(x - seed, along)), 1e-6);
  EXPECT_NEAR(blended->lengths()[blended->seed()], std::hypot(0.5, 1.0), 1e-6);
  const auto own = StreamTube::release(volume, false, TubeField::kVectors, half, seed);
  ASSERT_TRUE(own);
  for (const glm::dvec3 x : own->released_m())
    EXPECT_LT(glm::length(glm::cross(x - seed, glm::dvec3(1.0, 0.0, 0.0))), 1e-9);
}

TEST(StreamTube, IsWhereTheHandWasAndGoesWithTheMaterial) {
  const auto volume = stream_that_turns();
  const FramePointer then{0, 0.25};
  const glm::dvec3 seed(0.001, 0.002, 0.003);
  const auto tube = StreamTube::release(volume, true, TubeField::kVectors, then, seed);
  ASSERT_TRUE(tube);
  EXPECT_LT(glm::distance(tube->places(then)[tube->seed()], seed), 1e-9);
  EXPECT_LT(apart_m(tube->places(then), tube->released_m()), 1e-9);
  // 4 mm from frame to frame: on to the second one, and back to the first.
  for (const auto& [at, rise_m] :
       {std::pair(FramePointer{0, 0.0}, -0.001), std::pair(FramePointer{0, 0.75}, 0.002),
        std::pair(FramePointer{1, 0.0}, 0.003)}) {
    std::vector<glm::dvec3> wanted = tube->released_m();
    for (glm::dvec3& x : wanted) x.y += rise_m;
    EXPECT_LT(apart_m(tube->places(at), wanted), 1e-8) << at.frame << " " << at.phase;
  }
}

/// The shell's wall and blood, with its exact motion as fields on a grid of 2 mm.
std::shared_ptr<const MovingVolume> beating_shell() {
  const Grid grid = heart_grid(64);
  const Sequence shell = shell_phantom(grid);
  MovingVolume volume;
  volume.times = {shell.times_s, double(kShellFrames)};
  Motion motion{"data", {}};
  for (int k = 0; k < kShellFrames; ++k) {
    volume.frames.push_back(sampled_scalar(shell.frames[size_t(k)]));
    motion.steps.push_back(MotionMap::of(shell_truth(grid, k, (k + 1) % kShellFrames)));
  }
  volume.motions = {std::move(motion)};
  return std::make_shared<const MovingVolume>(std::move(volume));
}

TEST(StreamTube, OfABeatingShellIsItsVelocityAndBeatsWithIt) {
  const auto volume = beating_shell();
  const FramePointer then{1, 0.5};
  const glm::dvec3 seed(0.018, 0.012, -0.010);
  const auto tube = StreamTube::release(volume, true, TubeField::kVelocity, then, seed);
  ASSERT_TRUE(tube) << tube.error().message;
  ASSERT_GT(tube->released_m().size(), 10U);
  EXPECT_LT(glm::distance(tube->places(then)[tube->seed()], seed), 1e-9);
  // All material moves along the radius. Fields with cells of 2 mm bend its lines only a little.
  double aside_m = 0.0;
  for (const glm::dvec3 x : tube->released_m())
    if (glm::length(x) > 0.006)
      aside_m = std::max(aside_m, glm::length(glm::cross(x, glm::normalize(seed))));
  EXPECT_LT(aside_m, 0.05 * 2e-3);
  RecordProperty("most_aside_cells", std::to_string(aside_m / 2e-3));
  // The formula gives the place of the same material in every frame. The tolerance is the error of
  // trilinear fields: half the cells' curvature, twice, added over the steps in between.
  const std::vector<glm::dvec3> first = tube->places({0, 0.0});
  double off_m = 0.0;
  for (int frame = 0; frame < kShellFrames; ++frame) {
    const std::vector<glm::dvec3> now = tube->places({frame, 0.0});
    for (size_t k = 0; k < now.size(); ++k) {
      const glm::dvec3 wanted = volume_from_lps(shell_point(lps_from_volume(first[k]), 0, frame));
      off_m = std::max(off_m, glm::distance(now[k], wanted));
    }
  }
  EXPECT_LT(off_m, 0.1 * 2e-3);
  RecordProperty("most_off_cells", std::to_string(off_m / 2e-3));
}

TEST(StreamTube, ComesBackAfterEveryBeatAndNeverJumps) {
  const auto volume = beating_shell();
  const auto tube =
      StreamTube::release(volume, true, TubeField::kVelocity, {2, 0.3}, {0.018, 0.012, -0.010});
  ASSERT_TRUE(tube) << tube.error().message;
  for (int frame = 0; frame < kShellFrames; ++frame) {
    const std::vector<glm::dvec3> end = tube->places({frame, 1.0 - 1e-9});
    const std::vector<glm::dvec3> next = tube->places({(frame + 1) % kShellFrames, 0.0});
    // Fields are floats: 10 mm to 1e-9 m. For a tube that was released in the middle of a step, the
    // round trip closes with the error of closing a cycle, a thousandth of a cell.
    EXPECT_LT(apart_m(end, next), 1e-3 * 2e-3) << frame;
  }
}

/// Material that rotates back and forth: u = a sin(2 pi t / T) (-y, x, 0), a cycle of 2 s in 8
/// frames.
std::shared_ptr<const MovingVolume> stirred(double a) {
  const Grid grid = tube_cube();
  SequenceMotion motion;
  for (int k = 0; k < 8; ++k) motion.basis.times_s.push_back(0.25 * k);
  motion.basis.cycle_s = 2.0;
  motion.basis.harmonics = 1;
  motion.terms = {still_field(grid), still_field(grid),
                  field(grid, [&](glm::dvec3 x) { return a * turning(x); })};
  MovingVolume volume;
  volume.times = {motion.basis.times_s, 2.0};
  volume.frames = {sampled_scalar(Volume{grid, std::vector<float>(grid.count(), 1.0F)})};
  volume.whole = SequenceMap::of(motion);
  return std::make_shared<const MovingVolume>(std::move(volume));
}

TEST(StreamTube, OfOneMotionForAllTimesIsTheVelocityAtItsPhase) {
  // With s = a sin(w t) the material is at (I + s J) X, J a quarter turn, so its velocity at y is a
  // w cos(w t) / (1 + s^2) (J y + s y): circles at s = 0, else spirals r = r0 exp(s phi).
  constexpr double kA = 0.4, kW = std::numbers::pi;
  const auto volume = stirred(kA);
  const glm::dvec3 seed(0.010, 0.0, 0.004);
  // Leaves out radii at which one turn has only a few steps, and the border of the samples.
  const auto is_between = [](glm::dvec3 x) {
    const double r = std::hypot(x.x, x.y);
    return r > 0.003 && r < 0.018;
  };
  for (const FramePointer at :
       {FramePointer{0, 0.0}, FramePointer{0, 0.5}, FramePointer{7, 0.25}}) {
    const double t = 0.25 * (at.frame + at.phase), s = kA * std::sin(kW * t);
    const auto tube = StreamTube::release(volume, true, TubeField::kVelocity, at, seed);
    ASSERT_TRUE(tube) << tube.error().message;
    EXPECT_EQ(tube->closed(), s == 0.0);
    EXPECT_LT(glm::distance(tube->places(at)[tube->seed()], seed), 1e-8);
    const double speed =
        kA * kW * std::abs(std::cos(kW * t)) * std::sqrt(1.0 + s * s) * 0.010 / (1.0 + s * s);
    EXPECT_NEAR(tube->lengths()[tube->seed()], speed, 1e-3 * speed);
    double phi = 0.0, angle = 0.0;
    for (size_t k = tube->seed(); k < tube->released_m().size(); ++k) {
      const glm::dvec3 x = tube->released_m()[k];
      if (!is_between(x)) break;
      const double now = std::atan2(x.y, x.x);
      phi += std::remainder(now - angle, 2.0 * std::numbers::pi);
      angle = now;
      EXPECT_NEAR(std::hypot(x.x, x.y), 0.010 * std::exp(s * phi), 0.01 * kCell_m);
      EXPECT_NEAR(x.z, 0.004, 1e-3 * kCell_m);
    }
    EXPECT_GT(std::abs(phi), 1.5);
    // Later: (I + s' J) (I + s J)^-1 of it.
    const double s_later = kA * std::sin(kW * 0.25 * 2.5);
    const std::vector<glm::dvec3> later = tube->places({2, 0.5});
    for (size_t k = 0; k < later.size(); ++k) {
      const glm::dvec3 y = tube->released_m()[k];
      if (!is_between(y)) continue;
      const glm::dvec3 flat(y.x, y.y, 0.0);
      const glm::dvec3 start = (flat - s * turning(flat)) / (1.0 + s * s);
      const glm::dvec3 wanted = start + s_later * turning(start) + glm::dvec3(0.0, 0.0, y.z);
      EXPECT_LT(glm::distance(later[k], wanted), 0.01 * kCell_m);
    }
  }
}

TEST(StreamTube, StaysWithTheMaterialWhenTheMotionBecomesKnown) {
  const auto moving = beating_shell();
  MovingVolume unknown = *moving;
  unknown.motions = {{"data", std::vector<std::shared_ptr<const MotionMap>>(kShellFrames)}};
  const auto standing = std::make_shared<const MovingVolume>(std::move(unknown));
  const auto tube =
      StreamTube::release(standing, true, TubeField::kGradient, {0, 0.0}, {0.014, 0.010, 0.002});
  ASSERT_TRUE(tube) << tube.error().message;
  EXPECT_LT(apart_m(tube->places({2, 0.0}), tube->released_m()), 1e-12) << "no motion is there yet";
  const auto known = tube->moved_to(moving, {0, 0.0});
  ASSERT_TRUE(known);
  EXPECT_LT(apart_m(known->places({0, 0.0}), tube->released_m()), 1e-12);
  EXPECT_EQ(known->released_m(), tube->released_m());
  const std::vector<glm::dvec3> large = known->places({2, 0.0});
  for (size_t k = 0; k < large.size(); ++k) {
    const glm::dvec3 wanted =
        volume_from_lps(shell_point(lps_from_volume(tube->released_m()[k]), 0, 2));
    EXPECT_LT(glm::distance(large[k], wanted), 0.1 * 2e-3);
  }
  // Also at a phase within a step, where the material has to be found by inverting the motion.
  const FramePointer between{1, 0.6};
  const auto again = known->moved_to(beating_shell(), between);
  ASSERT_TRUE(again);
  EXPECT_LT(apart_m(again->places(between), known->places(between)), 1e-6 * 2e-3);
}

TEST(StreamTube, SaysWhyThereIsNone) {
  const auto streams = test::still(vectors([](glm::dvec3) { return glm::dvec3(1.0, 0.0, 0.0); }));
  const auto outside = StreamTube::release(streams, true, TubeField::kVectors, {}, {0.0, 0.2, 0.0});
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().message, "the hand is outside of the data");
  const auto nothing = test::still(vectors([](glm::dvec3) { return glm::dvec3(0.0); }));
  const auto stands = StreamTube::release(nothing, true, TubeField::kVectors, {}, glm::dvec3(0.0));
  ASSERT_FALSE(stands);
  EXPECT_EQ(stands.error().message, "there is no direction to follow there");
  // When the rotation reverses, all material is at rest.
  const auto rests =
      StreamTube::release(stirred(0.4), true, TubeField::kVelocity, {2, 0.0}, {0.01, 0.0, 0.0});
  ASSERT_FALSE(rests);
  EXPECT_EQ(rests.error().message, "the material stands still there at this time");
  const double nan = std::nan("");
  EXPECT_FALSE(StreamTube::release(streams, true, TubeField::kVectors, {}, glm::dvec3(nan)));
}

TEST(StreamTube, IsFiniteWhereverItIsReleased) {
  const auto volume = beating_shell();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.06, 0.06), phase(0.0, 1.0);
  std::uniform_int_distribution<int> frame(0, kShellFrames - 1);
  int released = 0;
  for (int n = 0; n < 60; ++n) {
    const FramePointer then{frame(random), phase(random)};
    const glm::dvec3 seed(place(random), place(random), place(random));
    for (const TubeField kind : {TubeField::kVelocity, TubeField::kGradient}) {
      const auto tube = StreamTube::release(volume, true, kind, then, seed);
      if (!tube) continue;
      ++released;
      ASSERT_EQ(tube->lengths().size(), tube->released_m().size());
      ASSERT_LT(tube->seed(), tube->released_m().size());
      const FramePointer now{frame(random), phase(random)};
      const std::vector<glm::dvec3> places = tube->places(now);
      ASSERT_EQ(places.size(), tube->released_m().size());
      for (const glm::dvec3 x : places) ASSERT_TRUE(std::isfinite(x.x + x.y + x.z)) << "try " << n;
    }
  }
  EXPECT_GT(released, 60);
}

}  // namespace
}  // namespace palpate
