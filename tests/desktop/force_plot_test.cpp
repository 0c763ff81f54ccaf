// Oracle: colours counted in the drawn picture.

#include "integration/desktop/force_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "integration/desktop/help.h"

namespace palpate::desktop {
namespace {

/// The highest row in which a column has the curve's own colour (opaque orange); height if there is
/// none.
int curve_row(const charts::Bitmap& raster, int column) {
  // Below the numbers at the top, which have the same colour.
  for (int row = 30; row < raster.height; ++row) {
    const uint32_t pixel = raster.pixels[size_t(row * raster.width + column)];
    const int r = int(pixel >> 16 & 255), b = int(pixel & 255);
    if (r > 200 && r - b > 100) return row;
  }
  return raster.height;
}

TEST(ForcePlot, DrawsTheNewestAtTheRightAndTheOldestAtTheLeft) {
  ForcePlot plot(6.0);
  for (int k = 0; k <= 600; ++k) plot.add(0.01 * k, k < 300 ? 0.0 : 2.0);
  const charts::Bitmap raster = plot.draw(320, 150, 1.0);
  ASSERT_EQ(raster.width, 320);
  ASSERT_EQ(raster.height, 150);
  // The strip goes from 40 to 306, from row 34 (2 N, the scale's top) to 126 (0 N); the line is 1.8
  // thick.
  EXPECT_NEAR(curve_row(raster, 80), 126, 2);
  EXPECT_NEAR(curve_row(raster, 280), 34, 2);
}

TEST(ForcePlot, LosesNoPeakHoweverShort) {
  ForcePlot plot(6.0);
  for (int k = 0; k <= 6000; ++k) plot.add(1e-3 * k, k == 3000 ? 5.0 : 0.0);
  EXPECT_EQ(plot.peak_n(), 5.0);
  EXPECT_EQ(plot.top_n(), 5.0);
  const charts::Bitmap raster = plot.draw(320, 150, 1.0);
  int highest = raster.height;
  for (int column = 41; column < 305; ++column)
    highest = std::min(highest, curve_row(raster, column));
  EXPECT_NEAR(highest, 34, 3);
}

TEST(ForcePlot, ForgetsWhatIsOlderThanItsSeconds) {
  ForcePlot plot(2.0);
  plot.add(0.0, 9.0);
  for (int k = 1; k <= 300; ++k) plot.add(0.01 * k, 0.5);
  EXPECT_EQ(plot.peak_n(), 0.5);
  EXPECT_EQ(plot.top_n(), 1.0);
}

TEST(ForcePlot, LeavesOutWhatIsNoNumberAndTimesThatDoNotRise) {
  ForcePlot plot;
  plot.add(1.0, 1.0);
  plot.add(std::numeric_limits<double>::quiet_NaN(), 2.0);
  plot.add(2.0, std::numeric_limits<double>::infinity());
  plot.add(0.5, 3.0);
  EXPECT_EQ(plot.newest_n(), 1.0);
  EXPECT_EQ(plot.peak_n(), 1.0);
}

TEST(ForcePlot, ReadsInOnesTwosAndFives) {
  const double pairs[][2] = {{0.0, 1.0}, {1.0, 1.0},  {1.01, 2.0},
                             {2.5, 5.0}, {7.0, 10.0}, {99, 100}};
  for (const auto& [force, top] : pairs) EXPECT_EQ(readable_top(force), top) << force;
}

TEST(ForcePlot, IsDrawnLargerOnADenseDisplay) {
  ForcePlot plot;
  EXPECT_EQ(plot.draw(320, 150, 2.0).width, 640);
  EXPECT_EQ(draw_help(2.0).width, 2 * draw_help(1.0).width);
}

TEST(OverlayCorners, HelpAndPlotNeverCoverEachOther) {
  const glm::ivec2 help(262, 232), plot(330, 160);
  constexpr int kEdge = 14, kTop = 100;
  int beside = 0, above = 0, hidden = 0;
  for (int width = 360; width <= 1200; width += 20)
    for (int height = 200; height <= 900; height += 20) {
      const OverlayCorners at = place_corners({width, height}, help, plot, kTop, kEdge);
      EXPECT_EQ(at.help.x, kEdge);
      EXPECT_LE(at.help.y + help.y + kEdge, height);
      const bool apart = at.help.x + help.x <= at.plot.x || at.help.y + help.y <= at.plot.y;
      EXPECT_TRUE(apart || !at.shows_plot) << width << " x " << height;
      if (!at.shows_plot) {
        ++hidden;
        EXPECT_LT(height, kTop + help.y + plot.y + 2 * kEdge) << "there is room for both";
        continue;
      }
      ++(at.help.x + help.x <= at.plot.x ? beside : above);
      if (at.help.x + help.x > at.plot.x) {
        EXPECT_GE(at.help.y, kTop);
      }
    }
  EXPECT_GT(beside, 0);
  EXPECT_GT(above, 0);
  EXPECT_GT(hidden, 0);
}

TEST(Help, SaysNothingOfAProbeWhereThereIsNone) {
  EXPECT_LT(draw_help(1.0, false).height, draw_help(1.0, true).height);
}

TEST(Overlay, IsSeeThroughOutsideItsPlate) {
  for (const charts::Bitmap& raster :
       {ForcePlot().draw(320, 150, 1.0), draw_help(1.0), draw_note("heart", {"a line"}, 1.0)}) {
    ASSERT_FALSE(raster.pixels.empty());
    EXPECT_EQ(raster.pixels.front(), 0u) << "the plate's corner is round";
    const uint32_t inside = raster.pixels[size_t(raster.width * 3 + raster.width / 2)];
    EXPECT_EQ(inside >> 24, 204u) << "four fifths cover";
  }
}

}  // namespace
}  // namespace palpate::desktop
