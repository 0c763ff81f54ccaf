#include "integration/charts/timeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "tests/charts/picture_file.h"

namespace palpate::charts {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Color kRed{0.9, 0.1, 0.1};

Timeline flat(size_t samples) {
  Timeline timeline;
  timeline.title = "A title";
  timeline.width_px = 1000;
  timeline.height_px = 400;
  Strip strip;
  strip.title = "force, N";
  strip.low = 0.0;
  strip.high = 10.0;
  strip.curves = {{"", std::vector<double>(samples, 1.0), kRed, 2.0}};
  for (size_t k = 0; k < samples; ++k) timeline.x.push_back(double(k) * 1e-3);
  timeline.strips = {strip};
  return timeline;
}

/// Rows in which the picture is strongly coloured somewhere: {first, last}.
glm::ivec2 colored_rows(const ReadPicture& picture) {
  glm::ivec2 rows(picture.height, -1);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (picture.colored(x, y)) rows = {std::min(rows.x, y), y};
  return rows;
}

TEST(Timeline, PutsTicksAtRoundNumbers) {
  const double close = 1e-12;
  EXPECT_THAT(axis_ticks(0.0, 1.0, 5),
              ElementsAre(DoubleNear(0.0, close), DoubleNear(0.2, close), DoubleNear(0.4, close),
                          DoubleNear(0.6, close), DoubleNear(0.8, close), DoubleNear(1.0, close)));
  EXPECT_THAT(axis_ticks(-3.0, 4.0, 3),
              ElementsAre(DoubleNear(-2.0, close), DoubleNear(0.0, close), DoubleNear(2.0, close),
                          DoubleNear(4.0, close)));
  EXPECT_TRUE(axis_ticks(1.0, 1.0, 5).empty());
}

TEST(Timeline, KeepsAPeakOfOneSampleAmongAHundredThousand) {
  const ScratchFile file("peak.png");
  Timeline timeline = flat(100'000);
  ASSERT_TRUE(write_timeline(file.path(), timeline));
  const glm::ivec2 without = colored_rows(read_png(file.path()));
  // In the middle of the about one hundred samples of a pixel, neither the first nor the last one.
  timeline.strips[0].curves[0].values[54'380] = 9.0;
  ASSERT_TRUE(write_timeline(file.path(), timeline));
  const glm::ivec2 with = colored_rows(read_png(file.path()));
  // The strip is about 200 px high and shows 10 N: 8 N more must be far higher.
  EXPECT_LT(with.x, without.x - 100);
  EXPECT_EQ(with.y, without.y);
}

TEST(Timeline, LeavesAGapWhereAValueIsNoNumber) {
  const ScratchFile file("gap.png");
  Timeline timeline = flat(1000);
  ASSERT_TRUE(write_timeline(file.path(), timeline));
  const ReadPicture whole = read_png(file.path());
  for (size_t k = 400; k < 600; ++k)
    timeline.strips[0].curves[0].values[k] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(write_timeline(file.path(), timeline));
  const ReadPicture with_gap = read_png(file.path());
  const int row = colored_rows(whole).y;
  int lost = 0;
  for (int x = 0; x < whole.width; ++x)
    lost += whole.colored(x, row) && !with_gap.colored(x, row) ? 1 : 0;
  // A fifth of the axis, which has most of the page's 1000 px.
  EXPECT_GT(lost, 120);
  EXPECT_LT(lost, 220);
}

TEST(Timeline, RefusesCurvesThatDoNotFitAndPagesWithNothing) {
  const ScratchFile file("bad.png");
  Timeline timeline = flat(10);
  timeline.strips[0].curves[0].values.pop_back();
  timeline.strips[0].curves[0].name = "force";
  const Status written = write_timeline(file.path(), timeline);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("'force'"));
  EXPECT_FALSE(write_timeline(file.path(), Timeline{}));
  EXPECT_FALSE(std::filesystem::exists(file.path()));
}

}  // namespace
}  // namespace palpate::charts
