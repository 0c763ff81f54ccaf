#include "compute/volume/portable.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

/// How many units in the last place a value is from the true one, which has more digits.
double units_off(double value, long double truth) {
  const double near = double(truth);
  const double unit =
      std::nextafter(std::abs(near), std::numeric_limits<double>::infinity()) - std::abs(near);
  return double(std::abs((static_cast<long double>(value) - truth) / unit));
}

/// The largest of many numbers between two.
template <class Function, class Truth>
double worst_units(const Function& f, const Truth& truth, double low, double high) {
  test::Random random(7);
  double worst = 0.0;
  for (int n = 0; n < 200'000; ++n) {
    const double x = random.draw(low, high);
    worst = std::max(worst, units_off(f(x), truth(static_cast<long double>(x))));
  }
  return worst;
}

TEST(PortableFunctions, AreWithinFourUnitsInTheLastPlace) {
  const auto cube_root = [](long double x) { return std::cbrt(x); };
  const auto exp = [](long double x) { return std::exp(x); };
  const auto log = [](long double x) { return std::log(x); };
  const auto sin = [](long double x) { return std::sin(x); };
  const auto cos = [](long double x) { return std::cos(x); };
  EXPECT_LT(worst_units(portable::cube_root, cube_root, 1e-9, 100.0), 1.0);
  EXPECT_LT(worst_units(portable::cube_root, cube_root, 1e20, 1e21), 1.0);
  EXPECT_LT(worst_units(portable::exp, exp, -700.0, 700.0), 2.0);
  EXPECT_LT(worst_units(portable::exp, exp, -1.0, 1.0), 2.0);
  EXPECT_LT(worst_units(portable::log, log, 1e-6, 20.0), 2.0);
  EXPECT_LT(worst_units(portable::log, log, 0.7, 1.5), 2.0);
  EXPECT_LT(worst_units(portable::sin, sin, -1000.0, 1000.0), 3.0);
  EXPECT_LT(worst_units(portable::cos, cos, -1000.0, 1000.0), 3.0);
  for (const double other : {-0.7, 0.5})
    EXPECT_LT(
        worst_units([=](double y) { return portable::atan2(y, other); },
                    [=](long double y) { return std::atan2(y, (long double)other); }, -3.0, 3.0),
        4.0);
}

/// The same bits with every compiler and on every processor: a change of one of them changes the
/// forces of recordings.
TEST(PortableFunctions, HaveTheseBits) {
  uint64_t bits = 14695981039346656037u;
  const auto add = [&](double value) {
    uint64_t word = 0;
    std::memcpy(&word, &value, sizeof word);
    bits = (bits ^ word) * 1099511628211u;
  };
  test::Random random(11);
  for (int n = 0; n < 10'000; ++n) {
    const double x = random.draw(0.0, 1.0), y = random.draw(-1.0, 1.0);
    add(portable::cube_root(100.0 * x));
    add(portable::exp(20.0 * y));
    add(portable::log(10.0 * x + 1e-9));
    add(portable::sin(50.0 * y));
    add(portable::cos(50.0 * y));
    add(portable::atan2(y, x - 0.5));
  }
  EXPECT_EQ(bits, 12813174723979336452u);
}

TEST(PortableFunctions, KnowTheEndsOfTheirRanges) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(portable::cube_root(0.0), 0.0);
  EXPECT_EQ(portable::cube_root(1.0), 1.0);
  EXPECT_EQ(portable::cube_root(8.0), 2.0);
  EXPECT_EQ(portable::exp(0.0), 1.0);
  EXPECT_EQ(portable::exp(-kInfinity), 0.0);
  EXPECT_EQ(portable::exp(kInfinity), kInfinity);
  EXPECT_EQ(portable::exp(1e300), kInfinity);
  EXPECT_EQ(portable::log(1.0), 0.0);
  EXPECT_EQ(portable::log(0.0), -kInfinity);
  EXPECT_EQ(portable::log(kInfinity), kInfinity);
  EXPECT_EQ(portable::sin(0.0), 0.0);
  EXPECT_EQ(portable::cos(0.0), 1.0);
  EXPECT_EQ(portable::atan2(0.0, 0.0), 0.0);
  EXPECT_NEAR(portable::atan2(0.0, -1.0), 3.14159265358979312, 1e-15);
  for (const double none : {kInfinity, -kInfinity, std::nan("")}) {
    EXPECT_TRUE(std::isnan(portable::sin(none)));
    EXPECT_TRUE(std::isnan(portable::cos(none)));
    EXPECT_TRUE(std::isnan(portable::atan2(none, 1.0)));
    EXPECT_TRUE(std::isnan(portable::atan2(1.0, none)));
  }
  for (const double none : {-1.0, -kInfinity, std::nan("")}) {
    EXPECT_TRUE(std::isnan(portable::log(none)));
    EXPECT_TRUE(std::isnan(portable::cube_root(none)));
  }
  EXPECT_TRUE(std::isnan(portable::exp(std::nan(""))));
  // Far away an angle has few digits left, but its sine is one.
  for (const double far : {1e7, 1e12, 1e300, -1e300}) {
    EXPECT_LE(std::abs(portable::sin(far)), 1.0);
    EXPECT_LE(std::abs(portable::cos(far)), 1.0);
  }
}

}  // namespace
}  // namespace palpate
