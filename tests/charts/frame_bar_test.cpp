// The bar of frames and the segments' sizes: what is where, read from their pixels.
#include "integration/charts/frame_bar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace palpate::charts {
namespace {

constexpr int kWidth = 600;
const FrameTimes kTimes{{0.0, 0.2, 0.5}, 0.8, false};

/// The middle of what has such a colour, px; not a number where nothing has.
glm::dvec2 middle_of(const Bitmap& raster, const std::function<bool(glm::ivec3)>& is_it) {
  glm::dvec2 sum(0.0);
  int count = 0;
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x) {
      const uint32_t c = raster.pixels[size_t(y) * size_t(raster.width) + size_t(x)];
      if (is_it({c >> 16 & 0xffU, c >> 8 & 0xffU, c & 0xffU})) sum += glm::dvec2(x, y), ++count;
    }
  return (sum + 0.5 * count) / double(count);
}

TEST(FrameBarTest, HasItsKnobWhereAClickLeadsToTheSameTime) {
  const auto white = [](glm::ivec3 c) { return c.r > 225; };
  for (const double scale : {1.0, 2.0})
    for (const double time_s : {0.04, 0.35, 0.77, 0.8 + 0.35}) {
      const Bitmap raster = draw_frame_bar({kTimes, time_s, ""}, kWidth, scale);
      const double x = middle_of(raster, white).x;
      EXPECT_NEAR(frame_bar_share(x, kWidth, scale), std::fmod(time_s, 0.8) / 0.8, 0.004) << time_s;
    }
  EXPECT_EQ(frame_bar_share(0.0, kWidth, 1.0), 0.0);
  EXPECT_EQ(frame_bar_share(kWidth, kWidth, 1.0), 1.0);
}

TEST(FrameBarTest, MarksEachFrameUnlessThereAreTooMany) {
  // Above the track only marks are bright, while the knob is at the left end.
  const auto marks = [](const FrameTimes& times) {
    const Bitmap raster = draw_frame_bar({times, 0.0, ""}, kWidth, 1.0);
    int count = 0, y = raster.height / 2 - 4;
    for (int x = 60; x < raster.width; ++x)
      count += (raster.pixels[size_t(y * raster.width + x)] >> 16 & 0xffU) > 120 &&
               (raster.pixels[size_t(y * raster.width + x - 1)] >> 16 & 0xffU) <= 120;
    return count;
  };
  EXPECT_EQ(marks({{0.0, 0.21, 0.51}, 0.8, false}), 2);  // the first one is below the knob
  FrameTimes many{{}, 0.0, false};
  for (int k = 0; k < 500; ++k) many.times_s.push_back(k);
  EXPECT_EQ(marks(many), 0);
}

TEST(SizesTest, ShowTheCavityAndTheWallAlongTheBarsAxis) {
  SegmentSizes sizes;
  sizes.volumes_ml = {{"cavity", {1.0F, 0.0F, 0.0F}, {100.0, 50.0, 60.0}},
                      {"wall", {0.0F, 1.0F, 0.0F}, {80.0, 80.0, 80.0}}};
  EXPECT_TRUE(has_sizes(sizes));
  const auto red = [](glm::ivec3 c) { return c.r > 180 && c.g < 60 && c.b < 60; };
  const auto green = [](glm::ivec3 c) { return c.g > 180 && c.r < 60 && c.b < 60; };
  const auto drawn = [&] { return draw_sizes(sizes, kTimes, 0.2, {kWidth, 200}, 1.0); };
  EXPECT_FALSE(std::isnan(middle_of(drawn(), green).x)) << "without a cavity all volumes";
  sizes.cavity = 0;
  EXPECT_TRUE(std::isnan(middle_of(drawn(), green).x)) << "the wall's volume says nothing";
  sizes.wall_mm = {"wall", {0.0F, 1.0F, 0.0F}, {8.0, 12.0, 11.0}};
  EXPECT_FALSE(std::isnan(middle_of(drawn(), green).x));
  EXPECT_FALSE(std::isnan(middle_of(drawn(), red).x));
  // The mark is where the bar's knob is.
  const auto white = [](glm::ivec3 c) { return c.r > 200 && c.g > 200 && c.b > 200; };
  Bitmap raster = drawn();
  raster.pixels.resize(size_t(raster.width) * 170);
  raster.height = 170;  // without the words below
  EXPECT_NEAR(frame_bar_share(middle_of(raster, white).x, kWidth, 1.0), 0.25, 0.02);
  // One known frame is no curve.
  sizes.volumes_ml[0].values = {100.0, std::nan(""), std::nan("")};
  sizes.wall_mm.values = {};
  EXPECT_FALSE(has_sizes(sizes));
}

}  // namespace
}  // namespace palpate::charts
