#include "module/haptics/proxy/delay_lead.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace palpate {
namespace {

constexpr double kT = 1e-3;
constexpr int64_t kMs = 1'000'000;

TEST(StableStiffness, IsTheDampingOverWhatIsLate) {
  // b = 1 N s/m at 1 kHz: a simulation gave 2,065 and 665 N/m, the formula gives 2,000 and 667.
  EXPECT_NEAR(stable_stiffness(1.0, kT, 0.0), 2000.0, 1e-9);
  EXPECT_NEAR(stable_stiffness(1.0, kT, 1e-3), 666.667, 1e-3);
  EXPECT_EQ(stable_stiffness(1.0, 0.0, 0.0), std::numeric_limits<double>::infinity());
}

TEST(DelayLead, IsWhereAnEvenMotionWillBe) {
  DelayLead lead(kT, 2e-3, 1.0);
  EXPECT_NEAR(lead.lead_s(), 2.5e-3, 1e-15);
  const glm::dvec3 v(0.1, -0.2, 0.05);
  for (int n = 0; n < 20; ++n) {
    const glm::dvec3 led = lead.add(n * kMs, v * (n * kT));
    if (n == 0) continue;  // one position has no velocity
    EXPECT_NEAR(glm::distance(led, v * (n * kT + 2.5e-3)), 0.0, 1e-15);
  }
}

TEST(DelayLead, KnowsTheTimeBetweenUnevenSamples) {
  DelayLead lead(kT, 1e-3);
  const int64_t times_us[] = {0, 1000, 1700, 3100, 3900, 6500};
  for (const int64_t t : times_us) {
    const glm::dvec3 led = lead.add(t * 1000, {0.3e-6 * double(t), 0.0, 0.0});
    if (t > 0) {
      EXPECT_NEAR(led.x, 0.3 * (double(t) * 1e-6 + 0.9e-3), 1e-15);
    }
  }
}

TEST(DelayLead, IsTheNewestPositionAtRestToTheBit) {
  DelayLead lead(kT, 3e-3);
  const glm::dvec3 p(0.012345, -0.1, 1.0 / 3.0);
  for (int n = 0; n < 5; ++n) EXPECT_EQ(lead.add(n * kMs, p), p);
}

TEST(DelayLead, IsAheadOfAFiveHertzMotionByItsShareOfTheDelay) {
  // The phase of the output relative to the motion, by correlation over a whole number of periods.
  // A difference over two samples is itself one sample late: lead L gives atan(L w cos(wT)..) ~ L
  // w.
  const double omega = 2.0 * std::numbers::pi * 5.0;
  DelayLead lead(kT, 3e-3);
  std::complex<double> sum = 0.0, own = 0.0;
  for (int n = 0; n < 2200; ++n) {
    const double x = std::cos(omega * n * kT);
    const double led = lead.add(n * kMs, {x, 0.0, 0.0}).x;
    if (n < 200) continue;
    const auto turn = std::polar(1.0, -omega * n * kT);
    sum += led * turn;
    own += x * turn;
  }
  const double ahead_s = std::arg(sum / own) / omega;
  const std::complex<double> difference = 1.0 - std::polar(1.0, -2.0 * omega * kT);
  const auto expected = 1.0 + lead.lead_s() / (2.0 * kT) * difference;
  EXPECT_NEAR(ahead_s, std::arg(expected) / omega, 1e-9);
  EXPECT_NEAR(ahead_s, lead.lead_s(), 0.05 * lead.lead_s());  // second order in w T: below 5 %
  EXPECT_NEAR(std::abs(sum / own), 1.0, 0.01);                // and 1 % in size
}

TEST(DelayLead, GivesTheLastAnswerAgainWhenNothingCame) {
  DelayLead lead(kT, 2e-3);
  lead.add(0, {0, 0, 0});
  const glm::dvec3 led = lead.add(kMs, {1e-3, 0, 0});
  EXPECT_GT(led.x, 1e-3);
  EXPECT_EQ(lead.add(kMs, {1e-3, 0, 0}), led);
  EXPECT_EQ(lead.add(kMs / 2, {5e-3, 0, 0}), led);
}

TEST(DelayLead, StartsAnewAfterAGapABackwardClockAndWhatIsNoNumber) {
  DelayLead lead(kT, 2e-3);
  lead.add(0, {0, 0, 0});
  lead.add(kMs, {1e-3, 0, 0});
  EXPECT_EQ(lead.add(100 * kMs, {0.05, 0, 0}).x, 0.05);
  lead.add(101 * kMs, {0.051, 0, 0});
  EXPECT_EQ(lead.add(-500 * kMs, {0.02, 0, 0}).x, 0.02);
  EXPECT_TRUE(std::isnan(lead.add(-499 * kMs, {std::nan(""), 0, 0}).x));
  EXPECT_EQ(lead.add(-498 * kMs, {0.03, 0, 0}).x, 0.03);
  EXPECT_EQ(lead.add(std::numeric_limits<int64_t>::max(), {0.04, 0, 0}).x, 0.04);
  EXPECT_EQ(lead.add(std::numeric_limits<int64_t>::min(), {0.05, 0, 0}).x, 0.05);
}

TEST(DelayLead, LeadsNothingWithoutSensibleTimes) {
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    DelayLead lead(bad, 1e-3);
    lead.add(0, {0, 0, 0});
    EXPECT_EQ(lead.add(kMs, {1e-3, 0, 0}).x, 1e-3) << bad;
  }
}

}  // namespace
}  // namespace palpate
