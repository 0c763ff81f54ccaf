// Oracle: closed forms of the least-squares slope of n samples one step apart.
#include "module/haptics/proxy/velocity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

using test::Random;
constexpr int64_t kMs = 1'000'000;
// After a day of uptime: the leading digits must not matter.
constexpr int64_t kStart = 123'456'789'012'345;
constexpr glm::dvec3 kVelocity(0.3, -0.2, 0.1);
constexpr double kRounding = 1e-12;

TEST(VelocityEstimate, IsZeroUntilThereAreTwoSamples) {
  VelocityEstimate estimate;
  EXPECT_EQ(estimate.velocity_m_per_s(), glm::dvec3(0.0));
  EXPECT_EQ(estimate.add(kStart, {1, 2, 3}), glm::dvec3(0.0));
  EXPECT_NEAR(estimate.add(kStart + kMs, {1.001, 2, 3}).x, 1.0, kRounding * 1e3);
}

TEST(VelocityEstimate, IsExactForASteadyHandWhateverTheTimes) {
  for (uint32_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    VelocityEstimate estimate;
    int64_t t = 0;
    for (int i = 0; i < 300; ++i) {
      t += 1 + int64_t(random.draw(0.0, 3e6));
      const glm::dvec3 v = estimate.add(kStart + t, kVelocity * (1e-9 * double(t)));
      if (i > 2) {
        // Positions near 1 m are rounded at 1e-16; over a window of at least 1e-5 s: 1e-10 m/s.
        ASSERT_NEAR(glm::length(v - kVelocity), 0.0, 1e-10) << "seed " << seed << " sample " << i;
      }
    }
  }
}

TEST(VelocityEstimate, LagsHalfItsWindowBehindAnAcceleratingHand) {
  VelocityEstimate estimate(0.015);
  glm::dvec3 v;
  for (int i = 0; i <= 100; ++i) {
    const double t = 1e-3 * i;
    v = estimate.add(kStart + i * kMs, {0.5 * 3.0 * t * t, 0, 0});
  }
  // The slope of a parabola is that at its middle.
  EXPECT_NEAR(v.x, 3.0 * (0.1 - 0.0075), 1e-10);
}

TEST(VelocityEstimate, FollowsAJumpAsTheClosedFormSays) {
  // n = 16 samples 1 ms apart, the newest j of them higher by d: slope = 6 d j (n - j) / (n (n^2 -
  // 1) T).
  VelocityEstimate estimate(0.015);
  for (int i = 0; i < 40; ++i) estimate.add(kStart + i * kMs, glm::dvec3(0.0));
  double most = 0.0;
  for (int j = 1; j <= 16; ++j) {
    const double v = estimate.add(kStart + (39 + j) * kMs, {1e-3, 0, 0}).x;
    const double n = 16.0;
    EXPECT_NEAR(v, 6.0 * 1e-3 * j * (n - j) / (n * (n * n - 1.0) * 1e-3), kRounding) << j;
    most = std::max(most, v);
  }
  EXPECT_LE(most, 1.5 * 1e-3 / 0.015);
}

TEST(VelocityEstimate, KeepsTheEncodersStepsSmall) {
  // Of a Falcon's encoder.
  constexpr double kCount = 38e-6;
  VelocityEstimate estimate;
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double x = 0.0371 * 1e-3 * i;
    const double v = estimate.add(kStart + i * kMs, {std::round(x / kCount) * kCount, 0, 0}).x;
    if (i > 20) worst = std::max(worst, std::abs(v - 0.0371));
  }
  // Rounding errors of at most half a count: sum |t| / sum t^2 of the window times half a count.
  EXPECT_LE(worst, 1.5 * kCount / 0.015);
  EXPECT_GT(worst, 0.0);
}

TEST(VelocityEstimate, IgnoresTimesThatDoNotRise) {
  VelocityEstimate estimate;
  for (int i = 0; i < 20; ++i) {
    const int64_t t = kStart + i * kMs;
    estimate.add(t, kVelocity * (1e-3 * i));
    estimate.add(t, glm::dvec3(7.0));
    estimate.add(t - 3 * kMs, glm::dvec3(-7.0));
  }
  EXPECT_NEAR(glm::length(estimate.velocity_m_per_s() - kVelocity), 0.0, 1e-10);
}

TEST(VelocityEstimate, StartsAnewWhenTheClockIsSetBack) {
  VelocityEstimate estimate;
  for (int i = 0; i < 20; ++i) estimate.add(kStart + i * kMs, kVelocity * (1e-3 * i));
  EXPECT_EQ(estimate.add(5, glm::dvec3(0.0)), glm::dvec3(0.0));
  EXPECT_NEAR(estimate.add(5 + kMs, {2e-3, 0, 0}).x, 2.0, 1e-10);
  // From one end of the clock's range to the other.
  estimate.add(std::numeric_limits<int64_t>::max(), {1.0, 0, 0});
  EXPECT_TRUE(std::isfinite(estimate.velocity_m_per_s().x));
  estimate.add(std::numeric_limits<int64_t>::min(), {1.0, 0, 0});
  EXPECT_EQ(estimate.velocity_m_per_s(), glm::dvec3(0.0));
  EXPECT_TRUE(std::isfinite(estimate.add(std::numeric_limits<int64_t>::max(), {2.0, 0, 0}).x));
}

TEST(VelocityEstimate, IgnoresPositionsThatAreNotFinite) {
  VelocityEstimate estimate;
  for (int i = 0; i < 20; ++i) {
    estimate.add(kStart + i * kMs, kVelocity * (1e-3 * i));
    estimate.add(kStart + i * kMs + kMs / 2, {std::numeric_limits<double>::quiet_NaN(), 0,
                                              std::numeric_limits<double>::infinity()});
  }
  EXPECT_NEAR(glm::length(estimate.velocity_m_per_s() - kVelocity), 0.0, 1e-10);
}

TEST(VelocityEstimate, BridgesAGapLongerThanItsWindow) {
  VelocityEstimate estimate;
  for (int i = 0; i < 20; ++i) estimate.add(kStart + i * kMs, glm::dvec3(0.0));
  EXPECT_NEAR(estimate.add(kStart + 119 * kMs, {0.01, 0, 0}).x, 0.1, kRounding);
}

TEST(VelocityEstimate, KeepsItsWindowAtAnyRate) {
  // At 100 kHz the ring stores fewer samples than it gets: the lag behind an accelerating hand is
  // still half a window.
  for (double rate_hz : {500.0, 1e3, 4e3, 1e4, 1e5}) {
    VelocityEstimate estimate(0.015);
    const int64_t step = int64_t(1e9 / rate_hz);
    glm::dvec3 v;
    int64_t t = 0;
    for (; t < 100 * kMs; t += step)
      v = estimate.add(kStart + t, {0.5 * 3.0 * 1e-18 * double(t) * double(t), 0, 0});
    const double now = 1e-9 * double(t - step);
    // The window has a whole number of samples, so it is shorter by up to one or two steps of the
    // ring, and the lag by half of that.
    EXPECT_NEAR(v.x, 3.0 * (now - 0.0075), 3.0 * 1e-3) << rate_hz;
  }
}

TEST(VelocityEstimate, ForgetsOnReset) {
  VelocityEstimate estimate;
  for (int i = 0; i < 20; ++i) estimate.add(kStart + i * kMs, kVelocity * (1e-3 * i));
  estimate.reset();
  EXPECT_EQ(estimate.velocity_m_per_s(), glm::dvec3(0.0));
  EXPECT_EQ(estimate.add(kStart, {5, 5, 5}), glm::dvec3(0.0));
}

}  // namespace
}  // namespace palpate
