#include "integration/charts/color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "integration/charts/range.h"

namespace palpate::charts {
namespace {

// CIE lightness of an sRGB colour: the inverse of the formula in the code.
double lightness(Color color) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  const double y = 0.2126 * linear(color.r) + 0.7152 * linear(color.g) + 0.0722 * linear(color.b);
  return y > 216.0 / 24389.0 ? 116.0 * std::cbrt(y) - 16.0 : y * 24389.0 / 27.0;
}

class StraightMap : public testing::TestWithParam<ColorMap> {};

TEST_P(StraightMap, IsALineInLightness) {
  const double first = lightness(color_at(GetParam(), 0.0));
  const double last = lightness(color_at(GetParam(), 1.0));
  for (double t = 0.0; t <= 1.0; t += 1.0 / 64.0) {
    // 2 of 100: the rounding of the screen's matrix and its edge; a difference of about 2.3 is just
    // visible.
    EXPECT_NEAR(lightness(color_at(GetParam(), t)), first + t * (last - first), 2.0) << t;
  }
  EXPECT_GT(std::abs(last - first), 45.0);
}

INSTANTIATE_TEST_SUITE_P(Maps, StraightMap,
                         testing::Values(ColorMap::kMotion, ColorMap::kError,
                                         ColorMap::kConfidence));

TEST(DifferenceMap, IsLightestInTheMiddleAndEquallyDarkAtBothEnds) {
  const double middle = lightness(color_at(ColorMap::kDifference, 0.5));
  const double low = lightness(color_at(ColorMap::kDifference, 0.0));
  const double high = lightness(color_at(ColorMap::kDifference, 1.0));
  EXPECT_GT(middle, 95.0);
  EXPECT_NEAR(low, high, 1.5);  // a screen step
  EXPECT_LT(low, 45.0);
  EXPECT_GT(color_at(ColorMap::kDifference, 0.0).b, color_at(ColorMap::kDifference, 0.0).r);
  EXPECT_GT(color_at(ColorMap::kDifference, 1.0).r, color_at(ColorMap::kDifference, 1.0).b);
}

TEST(ColorAt, HoldsTheEndsAndTakesNanForTheLowOne) {
  for (const ColorMap map : {ColorMap::kGray, ColorMap::kMotion, ColorMap::kDifference}) {
    EXPECT_EQ(color_at(map, -7.0).g, color_at(map, 0.0).g);
    EXPECT_EQ(color_at(map, 7.0).g, color_at(map, 1.0).g);
    EXPECT_EQ(color_at(map, std::numeric_limits<double>::quiet_NaN()).g, color_at(map, 0.0).g);
  }
}

TEST(Window, LeavesOutAFewHotVoxels) {
  Volume volume;
  volume.grid.size = {10, 10, 10};
  for (int n = 0; n < 1000; ++n) volume.values.push_back(float(n % 100));
  volume.values[17] = 1e6f;
  const Range window = window_of(volume);
  EXPECT_LE(window.high, 99.0);
  EXPECT_GE(window.high, 97.0);
  EXPECT_GE(window.low, 0.0);
}

TEST(Window, IsNeverEmpty) {
  Volume volume;
  volume.grid.size = {4, 4, 4};
  for (const float value : {0.0f, -1024.0f, 3e8f}) {
    volume.values.assign(64, value);
    const Range window = window_of(volume);
    EXPECT_LT(window.low, value);
    EXPECT_GT(window.high, value);
  }
}

TEST(Window, ShowsTheOneVoxelThatDiffers) {
  Volume volume;
  volume.grid.size = {10, 10, 10};
  volume.values.assign(1000, 0.0f);
  volume.values[500] = 1.0f;
  EXPECT_EQ(window_of(volume).low, 0.0);
  EXPECT_EQ(window_of(volume).high, 1.0);
}

TEST(Range, EndsAtARoundNumberThatHoldsTheValues) {
  EXPECT_DOUBLE_EQ(round_range({15.5}).high, 16.0);
  EXPECT_DOUBLE_EQ(round_range({0.031}).high, 0.04);
  EXPECT_DOUBLE_EQ(round_range({99.0}).high, 100.0);
  EXPECT_DOUBLE_EQ(round_range({0.0, 0.0}).high, 1.0);
  EXPECT_DOUBLE_EQ(round_range({}).high, 1.0);
}

TEST(Number, IsShortAndHasARealMinus) {
  EXPECT_EQ(number(0.5341), "0.534");
  EXPECT_EQ(number(1434.5), "1434");
  EXPECT_EQ(number(-2.0), "\u22122");
  EXPECT_EQ(number(0.0), "0");
}

}  // namespace
}  // namespace palpate::charts
