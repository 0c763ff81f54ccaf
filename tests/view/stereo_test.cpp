// How the pictures of two eyes become one, and the tables between light and colours.
#include "module/view/stereo.h"

#include <gtest/gtest.h>

#include <cmath>

#include "module/scene/look.h"

namespace palpate {
namespace {

Picture filled(int width, uint32_t colour) {
  return {width, 2, std::vector<uint32_t>(size_t(2 * width), colour),
          std::vector<float>(size_t(2 * width), float(colour & 255U))};
}

TEST(PictureColours, AreLightAndComeBack) {
  for (uint32_t v = 0; v < 256; ++v) {
    const uint32_t colour = 0xff000000U | v | (255 - v) << 8 | (v / 2) << 16;
    EXPECT_NEAR(light_of(colour).r, linear_from_srgb(v / 255.0), 1e-6);
    EXPECT_NEAR(light_of(colour).g, linear_from_srgb((255 - v) / 255.0), 1e-6);
    EXPECT_EQ(colour_of(light_of(colour)), colour);
  }
  EXPECT_EQ(colour_of({-1.0F, 2.0F, 0.0F}, 7), 0x0700ff00U);
}

TEST(JoinedEyes, StandSideBySideInTheOrderThatIsAsked) {
  const std::array<Picture, 2> eyes{filled(3, 0xff000011U), filled(3, 0xff000022U)};
  const Picture parallel = joined(eyes, Stereo::kParallel),
                crossed = joined(eyes, Stereo::kCrossed);
  ASSERT_EQ(parallel.width, 6);
  ASSERT_EQ(parallel.height, 2);
  ASSERT_EQ(parallel.colours.size(), 12u);
  ASSERT_EQ(parallel.depths.size(), 12u);
  for (int row = 0; row < 2; ++row)
    for (int x = 0; x < 6; ++x) {
      const size_t at = size_t(6 * row + x);
      EXPECT_EQ(parallel.colours[at], x < 3 ? 0xff000011U : 0xff000022U);
      EXPECT_EQ(crossed.colours[at], x < 3 ? 0xff000022U : 0xff000011U);
      EXPECT_EQ(parallel.depths[at], x < 3 ? 17.0F : 34.0F);
    }
  EXPECT_EQ(joined(eyes, Stereo::kMono).colours, eyes[0].colours);
}

TEST(JoinedEyes, ThroughGlassesEachSeesItsOwn) {
  const uint32_t white = 0xffffffffU, black = 0xff000000U;
  const uint32_t left = joined({filled(1, white), filled(1, black)}, Stereo::kAnaglyph).colours[0];
  const uint32_t right = joined({filled(1, black), filled(1, white)}, Stereo::kAnaglyph).colours[0];
  // The left eye looks through red, the right one through cyan.
  EXPECT_GT(left & 255U, 240u);
  EXPECT_EQ(left >> 8 & 255U, 0u);
  EXPECT_EQ(left >> 16 & 255U, 0u);
  EXPECT_EQ(right & 255U, 0u);
  EXPECT_GT(right >> 8 & 255U, 240u);
  EXPECT_GT(right >> 16 & 255U, 240u);
  EXPECT_EQ(joined({filled(1, white), filled(1, white)}, Stereo::kAnaglyph).colours[0], white);
}

}  // namespace
}  // namespace palpate
