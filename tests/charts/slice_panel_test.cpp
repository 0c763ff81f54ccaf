// The panel of slices: what is where in it, read from its pixels.
#include "integration/charts/slice_panel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate::charts {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr int kHeight = 768;

glm::ivec3 rgb(const Bitmap& raster, glm::ivec2 at) {
  const uint32_t c = raster.pixels[size_t(at.y) * size_t(raster.width) + size_t(at.x)];
  return {c >> 16 & 0xffU, c >> 8 & 0xffU, c & 0xffU};
}

/// Three slices of one size: dark at the left, bright at the right, a green wall down the middle.
SlicePanel panel_of(glm::ivec2 size) {
  SlicePanel panel;
  panel.slices.px_mm = 0.5;
  panel.slices.white = 100.0;
  panel.slices.walls = {{"wall", glm::vec3(0.0F, 1.0F, 0.0F), 0.0, 0}};
  for (Slice& slice : panel.slices.planes) {
    slice.width = size.x;
    slice.height = size.y;
    for (int k = 0; k < size.x * size.y; ++k)
      slice.values.push_back(k % size.x < size.x / 2 ? -50.0F : 150.0F);
    slice.place_px = {0.25 * size.x, 0.25 * size.y};
    slice.sides = {"R", "L", "A", "P"};
    slice.contours_px = {{{0.5 * size.x, 0.0}, {0.5 * size.x, double(size.y)}}};
  }
  return panel;
}

TEST(SlicePanel, HasSlicesWithWallsAndACrosshair) {
  const int edge = slice_edge_px(kHeight);
  const Bitmap raster = draw_slices(panel_of({edge, edge}), kHeight);
  ASSERT_EQ(raster.width, edge);
  ASSERT_EQ(raster.height, kHeight);
  const int x = edge / 4, y = edge / 3;
  EXPECT_EQ(rgb(raster, {x / 2, y}), glm::ivec3(0));    // values below black
  EXPECT_EQ(rgb(raster, {3 * x, y}), glm::ivec3(255));  // above white
  const glm::ivec3 wall = rgb(raster, {edge / 2, y});
  EXPECT_GT(wall.g, 150);
  EXPECT_LT(wall.r, 120);
  const glm::ivec3 cross = rgb(raster, {x, 2 * y});  // the vertical line
  EXPECT_GT(cross.b, cross.r + 60);
  EXPECT_EQ(rgb(raster, {x, edge / 4}), glm::ivec3(0)) << "the place itself is hidden";
}

TEST(SlicePanel, EnlargesWhatHasFewerPixels) {
  const int edge = slice_edge_px(kHeight);
  const Bitmap raster = draw_slices(panel_of({20, 10}), kHeight);
  EXPECT_EQ(rgb(raster, {edge - 5, edge / 2 + edge / 8}), glm::ivec3(255));
  // It lies in the middle of its tile, on the panel's ground.
  EXPECT_NE(rgb(raster, {edge - 5, edge / 8}), glm::ivec3(255));
}

TEST(SlicePanel, HasABarOfTheTubesColoursWithItsEnds) {
  SlicePanel panel = panel_of({200, 200});
  const TubeColours speed{"speed", "mm/s", 3.0, 120.0, {{1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}};
  const Bitmap without = draw_slices(panel, kHeight);
  panel.colours = {speed};
  const Bitmap with = draw_slices(panel, kHeight);
  // The bar is a row in which red gives way to blue, with ink of numbers at both sides.
  const auto bar_of = [](const Bitmap& raster) {
    for (int y = 0; y < raster.height; ++y) {
      std::vector<int> red, blue;
      for (int x = 0; x < raster.width; ++x) {
        const glm::ivec3 c = rgb(raster, {x, y});
        if (c.r > 200 && c.g < 10 && c.b < 60) red.push_back(x);
        if (c.b > 200 && c.g < 10 && c.r < 60) blue.push_back(x);
      }
      if (red.size() > 10 && blue.size() > 10 && red.back() < blue.front())
        return glm::ivec3(red.front(), blue.back(), y);
    }
    return glm::ivec3(0);
  };
  EXPECT_EQ(bar_of(without), glm::ivec3(0));
  const glm::ivec3 bar = bar_of(with);
  ASSERT_GT(bar.y, bar.x);
  const auto bright = [&](int from, int to, int top) {
    int count = 0;
    for (int y = top; y < top + 12; ++y)
      for (int x = from; x < to; ++x) count += rgb(with, {x, y}).g > 150;
    return count;
  };
  EXPECT_GT(bright(0, bar.x, bar.z - 2), 5) << "the least speed";
  EXPECT_GT(bright(bar.y + 1, with.width, bar.z - 2), 10) << "the greatest speed";
  EXPECT_GT(bright(0, with.width, bar.z - 16), 60) << "name and unit";
  // A panel that has no room for the text makes its slices smaller.
  const int edge = slice_edge_px(kHeight);
  panel = panel_of({edge, edge});
  panel.lines = {"1", "2", "3"};
  panel.slices.walls.resize(4, panel.slices.walls.front());
  for (Slice& slice : panel.slices.planes) slice.contours_px.resize(4);
  panel.colours = {speed};
  EXPECT_GT(bar_of(draw_slices(panel, kHeight)).y, 0);
  EXPECT_NE(rgb(draw_slices(panel, kHeight), {edge - 2, edge / 2}), glm::ivec3(255));
  // Alone, where slices are not wanted.
  EXPECT_GT(bar_of(draw_tube_colours({speed}, kHeight)).y, 0);
  EXPECT_EQ(draw_tube_colours({}, kHeight).width, 0);
}

TEST(SlicePanel, ReadsTimesInWordsThatFitWhatIsKnown) {
  FrameTimes times{{0.0, 0.2, 0.5}, 0.8, false};
  EXPECT_THAT(time_lines(times, 0.35),
              ElementsAre("frame 1.5 of 3", "350 of 800 ms, 44 %", "75 cycles a minute"));
  EXPECT_THAT(time_lines(times, 1.15),
              ElementsAre("frame 1.5 of 3", "350 of 800 ms, 44 %", "75 cycles a minute"));
  times.assumed = true;
  EXPECT_THAT(time_lines(times, 0.2), ElementsAre("frame 1.0 of 3", "25 % of the cycle"));
  times.cycle_s = 0.0;
  EXPECT_THAT(time_lines(times, 0.5), ElementsAre("frame 2.0 of 3", "100 % of the sequence"));
  EXPECT_THAT(time_lines({{0.0}, 0.0, false}, 0.0), IsEmpty());
}

}  // namespace
}  // namespace palpate::charts
