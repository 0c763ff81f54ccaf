// Oracle: the definition, evaluated pair by pair in long double.
#include "module/scene/transfer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TransferFunction linear(std::vector<double> in, std::vector<double> out) {
  auto f = TransferFunction::linear(std::move(in), std::move(out));
  EXPECT_TRUE(f);
  return *f;
}

TransferFunction stepped(std::vector<double> in, std::vector<double> out) {
  auto f = TransferFunction::stepped(std::move(in), std::move(out));
  EXPECT_TRUE(f);
  return *f;
}

TEST(TransferFunction, IsZeroEverywhereByDefault) {
  const TransferFunction f;
  EXPECT_EQ(f(-1e300), 0.0);
  EXPECT_EQ(f(7.0), 0.0);
  EXPECT_EQ(f.highest(), 0.0);
  EXPECT_GT(f.support().first, f.support().second);
}

TEST(TransferFunction, ConstantIsTheSameForEveryValue) {
  const auto f = TransferFunction::constant(1.5);
  for (const double x : {-kInfinity, -3.0, 0.0, 1e300, kInfinity}) EXPECT_EQ(f(x), 1.5) << x;
  EXPECT_EQ(f.highest(), 1.5);
  EXPECT_EQ(f.support(), std::pair(-kInfinity, kInfinity));
}

TEST(TransferFunction, LinearHitsItsPairsAndIsHeldOutside) {
  const auto f = linear({0, 10, 20}, {1, 3, -1});
  EXPECT_EQ(f(0), 1.0);
  EXPECT_EQ(f(10), 3.0);
  EXPECT_EQ(f(20), -1.0);
  EXPECT_EQ(f(5), 2.0);
  EXPECT_EQ(f(15), 1.0);
  EXPECT_EQ(f(-kInfinity), 1.0);
  EXPECT_EQ(f(1e9), -1.0);
}

TEST(TransferFunction, EqualNeighboursMakeAStepWhoseUpperSideCounts) {
  const auto f = linear({0, 1, 1, 2}, {0, 0, 4, 4});
  EXPECT_EQ(f(std::nextafter(1.0, 0.0)), 0.0);
  EXPECT_EQ(f(1.0), 4.0);
  const auto ends = linear({1, 1}, {2, 5});
  EXPECT_EQ(ends(0.999), 2.0);
  EXPECT_EQ(ends(1.0), 5.0);
}

TEST(TransferFunction, SteppedHoldsEachValueUpToTheNextPair) {
  const auto f = stepped({0, 10, 20}, {1, 3, 2});
  EXPECT_EQ(f(-5), 1.0);
  EXPECT_EQ(f(9.999), 1.0);
  EXPECT_EQ(f(10), 3.0);
  EXPECT_EQ(f(19.999), 3.0);
  EXPECT_EQ(f(20), 2.0);
  EXPECT_EQ(f(kInfinity), 2.0);
}

TEST(TransferFunction, WindowRisesAroundItsLevel) {
  const auto f = *TransferFunction::window(500, 100, 2.0);
  EXPECT_EQ(f(449), 0.0);
  EXPECT_EQ(f(450), 0.0);
  EXPECT_EQ(f(500), 1.0);
  EXPECT_EQ(f(550), 2.0);
  EXPECT_EQ(f(1e6), 2.0);
  const auto step = *TransferFunction::window(500, 0, 2.0);
  EXPECT_EQ(step(std::nextafter(500.0, 0.0)), 0.0);
  EXPECT_EQ(step(500), 2.0);
}

TEST(TransferFunction, GivesNothingForWhatIsNotANumber) {
  EXPECT_EQ(TransferFunction::constant(2.0)(kNan), 0.0);
  EXPECT_EQ(linear({0, 1}, {1, 2})(kNan), 0.0);
}

TEST(TransferFunction, AgreesWithItsDefinitionAndItsPromises) {
  for (uint32_t seed = 0; seed < 500; ++seed) {
    test::Random random(seed);
    const size_t n = size_t(random.draw(1, 12));
    std::vector<double> in(n), out(n);
    for (size_t k = 0; k < n; ++k) {
      // So that some are equal.
      in[k] = std::round(random.draw(-6, 6));
      out[k] = std::round(random.draw(-2, 3));
    }
    std::sort(in.begin(), in.end());
    const bool is_stepped = seed % 2 == 0;
    const auto f = is_stepped ? stepped(in, out) : linear(in, out);
    const auto [low, high] = f.support();
    for (int i = 0; i < 200; ++i) {
      const double x = i < 20 ? -10.0 + i : random.draw(-8, 8);
      long double want = out.front();
      for (size_t k = 0; k < n; ++k)
        if (in[k] <= x) {
          want = out[k];
          if (!is_stepped && k + 1 < n && in[k + 1] > x)
            want += (static_cast<long double>(out[k + 1]) - out[k]) *
                    (static_cast<long double>(x) - in[k]) / (in[k + 1] - in[k]);
        }
      // One division, one product and one sum of numbers below 10.
      ASSERT_NEAR(f(x), double(want), 1e-14) << "seed " << seed << " at " << x;
      ASSERT_LE(f(x), f.highest()) << "seed " << seed << " at " << x;
      ASSERT_TRUE(f(x) <= 0.0 || (x >= low && x <= high)) << "seed " << seed << " at " << x;
    }
  }
}

TEST(TransferFunction, SupportIsAsTightAsItsPairs) {
  EXPECT_EQ(linear({0, 1, 2, 3, 4}, {0, 0, 5, 0, 0}).support(), std::pair(1.0, 3.0));
  EXPECT_EQ(stepped({0, 1, 2, 3, 4}, {0, 0, 5, 0, 0}).support(), std::pair(2.0, 3.0));
  EXPECT_EQ(TransferFunction::window(10, 4, 1)->support(), std::pair(8.0, kInfinity));
  EXPECT_EQ(linear({0, 1}, {2, 0}).support(), std::pair(-kInfinity, 1.0));
}

TEST(TransferFunction, RefusesWhatIsNoFunction) {
  const auto message = [](const Result<TransferFunction>& f) { return f ? "" : f.error().message; };
  EXPECT_THAT(message(TransferFunction::linear({}, {})), HasSubstr("no pairs"));
  EXPECT_THAT(message(TransferFunction::linear({1}, {1, 2})), HasSubstr("as many outputs"));
  EXPECT_THAT(message(TransferFunction::linear({0, kNan}, {1, 2})), HasSubstr("pair 1"));
  EXPECT_THAT(message(TransferFunction::stepped({0, 1}, {1, kInfinity})), HasSubstr("pair 1"));
  EXPECT_THAT(message(TransferFunction::stepped({0, 2, 1}, {1, 2, 3})), HasSubstr("sort"));
  EXPECT_THAT(message(TransferFunction::linear({-1e308, 1e308}, {0, 1})), HasSubstr("too large"));
  EXPECT_THAT(message(TransferFunction::window(0, -1, 1)), HasSubstr("negative"));
  EXPECT_THAT(message(TransferFunction::window(kNan, 1, 1)), HasSubstr("not finite"));
}

}  // namespace
}  // namespace palpate
