// Calibration in a simulated room: known places, noise of 1 mm, a fifth of the samples wrong.

#include "module/calibrate/calibrate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "module/calibrate/least_squares.h"
#include "module/calibrate/principal_axes.h"
#include "tests/support/random.h"

namespace palpate::test {
namespace {

/// The workspace for which the error is guaranteed, m, about the device's origin.
constexpr glm::dvec3 kWorkspace(0.160, 0.120, 0.070);

/// RMS error over a grid of places in the workspace.
double error_over_workspace(const Pose& found, const Pose& truth, double* worst = nullptr) {
  double sum = 0.0, largest = 0.0;
  int count = 0;
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j)
      for (int k = -2; k <= 2; ++k, ++count) {
        const glm::dvec3 x = 0.25 * glm::dvec3(i, j, k) * kWorkspace;
        const double off = glm::distance(found(x), truth(x));
        sum += off * off;
        largest = std::max(largest, off);
      }
  if (worst) *worst = largest;
  return std::sqrt(sum / count);
}

double angle_between(const glm::dquat& a, const glm::dquat& b) {
  return 2.0 * std::acos(std::min(1.0, std::abs(glm::dot(a, b))));
}

Pose a_place(Random& random) {
  return {random.vector(1.0) + glm::dvec3(0.0, 0.9, -0.5), random.turn()};
}

/// Touched places spread over the workspace. noise_m: RMS in three dimensions.
std::vector<TouchedPoint> touched(Random& random, const Pose& truth, int count, double noise_m,
                                  double share_wrong) {
  std::vector<TouchedPoint> points;
  for (int i = 0; i < count; ++i) {
    TouchedPoint point;
    point.device_m = 0.5 * kWorkspace * random.vector(1.0);
    point.stage_m = truth(point.device_m) + random.normal_vector(noise_m / std::sqrt(3.0));
    points.push_back(point);
  }
  const int wrong = int(std::lround(share_wrong * count));
  for (int i = 0; i < wrong; ++i)
    points[size_t(i * count / wrong)].stage_m += 0.08 * glm::normalize(random.normal_vector(1.0));
  return points;
}

TEST(LeastSquaresFit, FindsWhatWasPutInAndRefusesWhatIsNotTold) {
  Random random(1);
  LeastSquares fit(10);
  std::array<double, 10> truth;
  for (double& x : truth) x = random.draw(-1, 1);
  for (int i = 0; i < 30; ++i) {
    std::array<double, 10> row;
    for (double& x : row) x = random.draw(-1, 1);
    fit.add(row, std::inner_product(row.begin(), row.end(), truth.begin(), 0.0),
            random.draw(0.5, 2.0));
  }
  const auto found = fit.solve();
  ASSERT_TRUE(found);
  for (size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR((*found)[i], truth[i], 1e-12);
  LeastSquares same(2);
  for (int i = 0; i < 5; ++i) same.add(std::array{1.0, 2.0}, 3.0);
  EXPECT_FALSE(same.solve()) << "only the sum is determined";
  LeastSquares almost(2);
  for (int i = 0; i < 5; ++i) almost.add(std::array{1.0, 1.0 + 1e-7 * i}, 3.0);
  EXPECT_FALSE(almost.solve()) << "the difference is determined to rounding only";
}

TEST(ThePrincipalAxes, OfATurnedBoxAreItsEdges) {
  const glm::dquat turn = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, -2.0, 0.5)));
  const glm::dvec3 centre(0.1, -0.2, 0.3), half(3.0, 1.0, 2.0);
  std::vector<glm::dvec3> corners;
  for (int c = 0; c < 8; ++c)
    corners.push_back(centre +
                      turn * (half * glm::dvec3(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1)));
  const PrincipalAxes found = principal_axes(corners);
  EXPECT_LT(glm::distance(found.centre, centre), 1e-12);
  EXPECT_LT(glm::distance(found.variance, glm::dvec3(1.0, 4.0, 9.0)), 1e-12);
  const glm::dvec3 edges[3] = {turn * glm::dvec3(0, 1, 0), turn * glm::dvec3(0, 0, 1),
                               turn * glm::dvec3(1, 0, 0)};
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(glm::dot(found.axes[k], edges[k])), 1.0, 1e-12);
}

TEST(FitRigid, IsExactForExactPoints) {
  for (uint32_t seed = 1; seed <= 500; ++seed) {
    Random random(seed);
    const Pose truth = a_place(random);
    const auto points = touched(random, truth, 3 + int(seed % 10), 0.0, 0.0);
    // Including half turns, at which formulas with Euler angles fail.
    EXPECT_LT(error_over_workspace(fit_rigid(points), truth), 1e-12) << "seed " << seed;
  }
}

TEST(CalibrateByPoints, ReachesAThirdOfAMillimetreThroughNoiseAndSlips) {
  double worst = 0.0, sum = 0.0;
  constexpr uint32_t kSeeds = 200;
  for (uint32_t seed = 1; seed <= kSeeds; ++seed) {
    Random random(seed);
    const Pose truth = a_place(random);
    const auto points = touched(random, truth, 60, 1e-3, 0.2);
    const auto found = calibrate_by_points(points);
    ASSERT_TRUE(found) << found.error().message << ", seed " << seed;
    const double off = error_over_workspace(found->stage_from_device, truth);
    worst = std::max(worst, off);
    sum += off;
    // No slip was used, and hardly any good point was lost.
    EXPECT_LE(found->used, 48 + 0) << "seed " << seed;
    EXPECT_GE(found->used, 44) << "seed " << seed;
    EXPECT_NEAR(found->rms_m, 1e-3, 0.3e-3) << "seed " << seed;
  }
  RecordProperty("mean_um", int(1e6 * sum / kSeeds));
  RecordProperty("worst_um", int(1e6 * worst));
  std::printf("60 touches: mean of 200 rooms %.3f mm, worst %.3f mm, RMS over the workspace\n",
              1e3 * sum / kSeeds, 1e3 * worst);
  // Fitzpatrick's formula for 48 good points with the spread of the requested places: 1 mm /
  // sqrt(48) x sqrt(1 + 1) = 0.204 mm; a robust fit may be a tenth worse.
  EXPECT_LT(sum / kSeeds, 1.1 * 0.204e-3);
}

TEST(CalibrateByPoints, SaysWhatErrorIsToBeExpected) {
  // The formula is for the mean of squares: over many rooms it must hold within the sampling error.
  const glm::dvec3 corner = 0.5 * kWorkspace;
  double real = 0.0, expected = 0.0;
  constexpr int kRooms = 400;
  for (uint32_t seed = 1; seed <= kRooms; ++seed) {
    Random random(seed);
    const Pose truth = a_place(random);
    const auto points = touched(random, truth, 30, 1e-3, 0.0);
    const auto found = calibrate_by_points(points);
    ASSERT_TRUE(found);
    const double off = glm::distance(found->stage_from_device(corner), truth(corner));
    const double said = expected_error_m(points, *found, corner);
    real += off * off;
    expected += said * said;
  }
  EXPECT_NEAR(std::sqrt(expected / real), 1.0, 0.15);
}

TEST(CalibrateByPoints, IsVerifiedByATouchOfAnotherPoint) {
  Random random(1);
  const Pose truth = a_place(random);
  const auto found = calibrate_by_points(touched(random, truth, 60, 1e-3, 0.2));
  ASSERT_TRUE(found);
  const glm::dvec3 place(0.03, -0.02, 0.01);
  EXPECT_LT(off_m(*found, {place, truth(place)}), 0.5e-3);
  EXPECT_GT(off_m(*found, {place, truth(place) + glm::dvec3(0.005, 0, 0)}), 4.5e-3);
}

TEST(CalibrateByPoints, SaysWhatIsWrongWithTheTouchedPoints) {
  Random random(1);
  const Pose truth = a_place(random);
  auto points = touched(random, truth, 4, 1e-3, 0.0);
  EXPECT_EQ(calibrate_by_points(points).error().message,
            "A calibration needs at least 5 touched points: touch more.");
  points = touched(random, truth, 20, 1e-3, 0.0);
  for (TouchedPoint& point : points) {
    point.device_m = glm::dvec3(point.device_m.x, 0.0, 0.0);
    point.stage_m = truth(point.device_m);
  }
  EXPECT_NE(calibrate_by_points(points).error().message.find("on a line"), std::string::npos);
  points = touched(random, truth, 20, 1e-3, 0.0);
  for (TouchedPoint& point : points) point.stage_m = random.vector(1.0);
  EXPECT_NE(calibrate_by_points(points).error().message.find("do not agree"), std::string::npos);
  points = touched(random, truth, 20, 1e-3, 0.0);
  points[3].stage_m.x = std::nan("");
  EXPECT_NE(calibrate_by_points(points).error().message.find("not finite"), std::string::npos);
}

/// Half a minute of a hand that moves and rotates a stylus through the workspace.
struct Movement {
  std::vector<TipSample> tip;
  std::vector<ControllerSample> controller;
  Pose truth;
  glm::dvec3 tip_in_controller;
};

struct MovementOptions {
  double noise_m = 1e-3;                        ///< RMS in three dimensions
  double noise_rad = 0.3 * 3.14159265 / 180.0;  ///< RMS
  double share_wrong = 0.2;
  double delay_s = 0.03;
  /// How far the stylus is rotated to either side.
  double turn_rad = 0.6;
  double seconds = 30.0;
};

Movement move(Random& random, const MovementOptions& options) {
  Movement made;
  made.truth = a_place(random);
  made.tip_in_controller = random.vector(0.12);
  const glm::dquat held = random.turn();
  double f[12], phase[12];
  for (int i = 0; i < 12; ++i) {
    f[i] = random.draw(0.2, 0.7);
    phase[i] = random.draw(0.0, 6.28);
  }
  // Two waves per axis, so that no two axes have the same motion.
  const auto wave = [&](int i, double t) {
    return 0.5 * std::sin(6.283185307 * f[i] * t + phase[i]) +
           0.5 * std::sin(6.283185307 * f[i + 6] * t + phase[i + 6]);
  };
  const auto tip = [&](double t) {
    return 0.45 * kWorkspace * glm::dvec3(wave(0, t), wave(1, t), wave(2, t));
  };
  const auto turn = [&](double t) {
    const glm::dvec3 w = 0.5 * options.turn_rad * glm::dvec3(wave(3, t), wave(4, t), wave(5, t));
    return glm::normalize(glm::dquat(1.0, w.x, w.y, w.z));
  };
  for (double t = -0.2; t < options.seconds + 0.2; t += 1e-3)
    made.tip.push_back({t, tip(t) + random.normal_vector(2e-5)});
  // A tracker that loses tracking does so for a while.
  int wrong_for = 0;
  glm::dvec3 jump(0.0);
  for (double t = 0.0; t < options.seconds; t += 1.0 / 90.0) {
    const double real = t - options.delay_s;
    const glm::dquat orientation = made.truth.rotation * turn(real) * held;
    ControllerSample sample;
    sample.time_s = t;
    sample.stage_from_controller = {
        made.truth(tip(real)) - orientation * made.tip_in_controller +
            random.normal_vector(options.noise_m / std::sqrt(3.0)),
        glm::normalize(random.small_normal_turn(options.noise_rad / std::sqrt(3.0)) * orientation)};
    // Wrong intervals have 10 samples, so their beginnings are that much rarer.
    if (wrong_for == 0 && random.chance(options.share_wrong / (1.0 - options.share_wrong) / 10.0)) {
      wrong_for = 10;
      jump = random.draw(0.01, 0.1) * glm::normalize(random.normal_vector(1.0));
    }
    if (wrong_for > 0) {
      --wrong_for;
      sample.stage_from_controller.position_m += jump;
    }
    made.controller.push_back(sample);
  }
  return made;
}

TEST(CalibrateByMovement, IsExactForExactData) {
  for (const double delay : {0.0, 0.017, 0.06}) {
    Random random(3);
    MovementOptions options;
    options.noise_m = options.noise_rad = options.share_wrong = 0.0;
    options.delay_s = delay;
    options.seconds = 5.0;
    const Movement made = move(random, options);
    const auto found = calibrate_by_movement(made.tip, made.controller);
    ASSERT_TRUE(found) << found.error().message;
    // The tip's own noise is 0.02 mm per axis, at a thousand samples per second.
    EXPECT_LT(error_over_workspace(found->stage_from_device, made.truth), 0.02e-3);
    EXPECT_NEAR(found->delay_s, delay, 0.1e-3);
    EXPECT_LT(glm::distance(found->controller_from_tip_m, made.tip_in_controller), 0.02e-3);
  }
}

TEST(CalibrateByMovement, ReachesAThirdOfAMillimetreWithUnknownDelayNoiseAndWrongSamples) {
  double worst = 0.0, worst_place = 0.0, worst_angle = 0.0, worst_delay = 0.0;
  for (uint32_t seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    MovementOptions options;
    options.delay_s = 0.06 * double(seed % 7) / 6.0;
    const Movement made = move(random, options);
    const auto found = calibrate_by_movement(made.tip, made.controller);
    ASSERT_TRUE(found) << found.error().message << ", seed " << seed;
    double place = 0.0;
    const double off = error_over_workspace(found->stage_from_device, made.truth, &place);
    const double angle = angle_between(found->stage_from_device.rotation, made.truth.rotation);
    const double late = std::abs(found->delay_s - options.delay_s);
    EXPECT_LT(off, 0.3e-3) << "seed " << seed;
    EXPECT_LT(angle, 0.15 * 3.14159265 / 180.0) << "seed " << seed;
    EXPECT_LT(late, 1e-3) << "seed " << seed;
    worst = std::max(worst, off);
    worst_place = std::max(worst_place, place);
    worst_angle = std::max(worst_angle, angle);
    worst_delay = std::max(worst_delay, late);
  }
  std::printf(
      "worst of 24: %.3f mm RMS over the workspace, %.3f mm anywhere, %.4f degrees, "
      "%.3f ms\n",
      1e3 * worst, 1e3 * worst_place, worst_angle * 180.0 / 3.14159265, 1e3 * worst_delay);
}

TEST(CalibrateByMovement, SaysWhatIsWrongWithTheMovement) {
  const auto message = [](const Movement& made) {
    const auto found = calibrate_by_movement(made.tip, made.controller);
    return found ? std::string("found") : found.error().message;
  };
  Random random(1);
  MovementOptions options;
  options.seconds = 0.5;
  EXPECT_NE(message(move(random, options)).find("too short"), std::string::npos);
  options.seconds = 10.0;
  options.turn_rad = 0.01;
  EXPECT_NE(message(move(random, options)).find("hardly turned"), std::string::npos);
  options.turn_rad = 0.6;
  Movement flat = move(random, options);
  for (TipSample& sample : flat.tip) sample.device_m.z = 0.0;
  EXPECT_NE(message(flat).find("hardly moved"), std::string::npos);
  Movement loose = move(random, options);
  for (ControllerSample& sample : loose.controller)
    sample.stage_from_controller.position_m = random.vector(1.0);
  EXPECT_NE(message(loose).find("clipped tightly"), std::string::npos);
  Movement back = move(random, options);
  std::swap(back.tip[10], back.tip[20]);
  EXPECT_NE(message(back).find("do not rise"), std::string::npos);
}

/// A controller that is rotated about its tip: tilted to all sides and rolled, as by a wrist.
std::vector<ControllerSample> turned(Random& random, glm::dvec3 tip_m, glm::dvec3 place_m,
                                     int count, double tilt_rad, double noise_m, double noise_rad,
                                     double share_wrong) {
  std::vector<ControllerSample> samples;
  const glm::dquat middle = random.turn();
  for (int i = 0; i < count; ++i) {
    const double t = double(i) / count;
    const glm::dquat turn =
        glm::angleAxis(tilt_rad * std::sin(19.0 * t), glm::dvec3(1, 0, 0)) *
        glm::angleAxis(tilt_rad * std::sin(31.0 * t + 1.0), glm::dvec3(0, 1, 0)) *
        glm::angleAxis(0.5 * tilt_rad * std::sin(13.0 * t + 2.0), glm::dvec3(0, 0, 1));
    Pose pose{{},
              glm::normalize(random.small_normal_turn(noise_rad / std::sqrt(3.0)) * middle * turn)};
    pose.position_m = place_m - (middle * turn) * tip_m;
    pose.position_m += random.normal_vector(noise_m / std::sqrt(3.0));
    if (random.chance(share_wrong))
      pose.position_m += 0.08 * glm::normalize(random.normal_vector(1.0));
    samples.push_back({t, pose});
  }
  return samples;
}

TEST(FindPivot, IsExactForExactPoses) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const glm::dvec3 tip = random.vector(0.1), place = random.vector(1.0);
    const auto found = find_pivot(turned(random, tip, place, 120, 0.6, 0.0, 0.0, 0.0));
    ASSERT_TRUE(found) << found.error().message << ", seed " << seed;
    EXPECT_LT(glm::distance(found->controller_from_tip_m, tip), 1e-9) << "seed " << seed;
    EXPECT_LT(glm::distance(found->stage_m, place), 1e-9) << "seed " << seed;
    EXPECT_EQ(found->used, 120);
  }
}

TEST(FindPivot, FindsTheTipThroughNoiseAndAFifthOfWildPoses) {
  double worst = 0.0, sum = 0.0;
  constexpr uint32_t kSeeds = 100;
  for (uint32_t seed = 1; seed <= kSeeds; ++seed) {
    Random random(seed);
    const glm::dvec3 tip = random.vector(0.1), place = random.vector(1.0);
    const auto samples = turned(random, tip, place, 450, 0.6, 1e-3, 0.0052, 0.2);
    const auto found = find_pivot(samples);
    ASSERT_TRUE(found) << found.error().message << ", seed " << seed;
    const double off = glm::distance(found->controller_from_tip_m, tip);
    worst = std::max(worst, off);
    sum += off;
    // Of 360 good poses on average, with a spread of 8.5.
    EXPECT_GT(found->used, 320) << "seed " << seed;
    EXPECT_LT(found->used, 400) << "seed " << seed;
  }
  std::printf("pivot: mean of 100 tips %.3f mm, worst %.3f mm\n", 1e3 * sum / kSeeds, 1e3 * worst);
  // A dozen touches with 1 mm of noise have an error of 0.3 mm: the tip's error must not be larger.
  EXPECT_LT(worst, 0.3e-3);
}

TEST(FindPivot, RefusesWhatDoesNotTellTheTip) {
  Random random(3);
  const glm::dvec3 tip(0.01, -0.02, -0.06), place(0.1, 0.8, -0.4);
  const auto few = find_pivot(turned(random, tip, place, 50, 0.6, 1e-3, 0.0, 0.0));
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message.find("too seldom"), std::string::npos);
  const auto still = find_pivot(turned(random, tip, place, 300, 0.05, 1e-3, 0.0, 0.0));
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().message.find("hardly turned"), std::string::npos);
  auto walking = turned(random, tip, place, 300, 0.6, 1e-3, 0.0, 0.0);
  for (ControllerSample& sample : walking)
    sample.stage_from_controller.position_m += random.vector(0.1);
  const auto moved = find_pivot(walking);
  ASSERT_FALSE(moved);
  EXPECT_NE(moved.error().message.find("did not rest"), std::string::npos);
}

}  // namespace
}  // namespace palpate::test
