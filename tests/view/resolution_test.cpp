#include "module/view/resolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate::test {
namespace {

constexpr ResolutionOptions kOptions{0.010, 0.4};

TEST(Resolution, NeverSnapsWhateverTheTimesAre) {
  for (uint32_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    Resolution now;
    for (int frame = 0; frame < 400; ++frame) {
      const double before = now.scale;
      now = next_resolution(now, std::pow(10.0, random.draw(-4.0, 0.0)), kOptions);
      ASSERT_GE(now.scale, 0.97 * before - 1e-12) << "seed " << seed << " frame " << frame;
      ASSERT_LE(now.scale, 1.01 * before + 1e-12) << "seed " << seed << " frame " << frame;
      ASSERT_GE(now.scale, kOptions.least * 0.97);
      ASSERT_LE(now.scale, 1.0);
    }
  }
}

TEST(Resolution, SettlesWithinTheBudgetAndThenStandsStillInNoise) {
  for (uint32_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    const double full_s = random.draw(0.004, 0.05);
    Resolution now;
    const auto frame = [&] {
      const double noise = random.draw(0.9, 1.1);
      now = next_resolution(now, full_s * now.scale * now.scale * noise, kOptions);
    };
    for (int k = 0; k < 300; ++k) frame();
    const double settled = now.scale;
    EXPECT_LE(full_s * settled * settled, kOptions.budget_s) << "seed " << seed;
    for (int k = 0; k < 1000; ++k) {
      frame();
      ASSERT_EQ(now.scale, settled) << "seed " << seed << " frame " << k;
    }
  }
}

TEST(Resolution, ComesBackWhenThereIsTimeAgain) {
  Resolution now;
  for (int k = 0; k < 200; ++k) now = next_resolution(now, 0.03 * now.scale * now.scale, kOptions);
  EXPECT_LT(now.scale, 0.6);
  for (int k = 0; k < 300; ++k) now = next_resolution(now, 0.003 * now.scale * now.scale, kOptions);
  EXPECT_EQ(now.scale, 1.0);
}

TEST(Resolution, IgnoresTimesThatAreNone) {
  const Resolution start{0.7, 0.01, false};
  for (const double none : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(next_resolution(start, none, kOptions).scale, 0.7);
}

TEST(Resolution, GivesEvenSizesThatFit) {
  for (const double scale : {0.01, 0.4, 0.777, 1.0}) {
    const PictureSize size = scaled({640, 481}, scale);
    EXPECT_EQ(size.width % 2, 0);
    EXPECT_GE(size.width, 16);
    EXPECT_LE(size.width, 640);
    EXPECT_LE(size.height, 481);
  }
  EXPECT_EQ(scaled({640, 480}, 1.0).width, 640);
}

}  // namespace
}  // namespace palpate::test
