#include "compute/motion/quality_match.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate {
namespace {

using test::field_of;
using test::grid_at_origin;
using test::tissue_at;
using test::volume_of;

Volume with_noise(Volume volume, double sd, uint32_t seed) {
  for (size_t n = 0; n < volume.values.size(); ++n) {
    volume.values[n] += float(sd * texture::gaussian_like(seed, n));
  }
  return volume;
}

TEST(NoiseSd, OfPureNoiseIsItsSd) {
  const Volume flat = volume_of(grid_at_origin(40), [](glm::dvec3) { return 100.0; });
  // 54,872 correlated draws: the MAD is right to about 1 %. Sums of four draws are not quite
  // Gaussian: another 2 %.
  EXPECT_NEAR(noise_sd(with_noise(flat, 7.0, 3)), 7.0, 0.35);
}

TEST(NoiseSd, SeesThroughSmoothStructure) {
  const Volume frame = shell_phantom(64, 1, 4, 0.02).frames[0];
  EXPECT_NEAR(noise_sd(frame), 18.0, 1.8);
}

TEST(NoiseSd, OfAConstantOrPaddedVolumeIgnoresThePadding) {
  Volume flat = volume_of(grid_at_origin(20), [](glm::dvec3) { return -1024.0; });
  EXPECT_EQ(noise_sd(flat), 0.0);
  const Volume noisy = with_noise(flat, 10.0, 5);
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 20; ++i) {
        flat.values[flat.grid.offset(i, j, k)] = noisy.at(i, j, k);
      }
  // 2,400 samples, and those at the edge of the padding.
  EXPECT_NEAR(noise_sd(flat), 10.0, 1.5);
}

TEST(NoiseSd, WorksOnASingleSlice) {
  Grid slice = grid_at_origin(100);
  slice.size.z = 1;
  const Volume flat = volume_of(slice, [](glm::dvec3) { return 0.0; });
  EXPECT_NEAR(noise_sd(with_noise(flat, 3.0, 6)), 3.0, 0.2);
}

TEST(Warped, ByAShiftOfWholeVoxelsPicksTheNeighbour) {
  const Volume moving = volume_of(grid_at_origin(12), [](glm::dvec3 p) { return tissue_at(1, p); });
  const Field u =
      field_of(grid_at_origin(3, 4.0), [](glm::dvec3) { return glm::dvec3(0.0, 2.0, -1.0); });
  const Volume found = warped(moving, u, moving.grid);
  EXPECT_FLOAT_EQ(found.at(4, 5, 6), moving.at(4, 7, 5));
}

/// A textured pair in which all material moves by 4 mm.
struct Pair {
  Grid grid = grid_at_origin(56);
  glm::dvec3 shift{0.0, 0.0, 4.0};
  Volume fixed = with_noise(volume_of(grid, [](glm::dvec3 p) { return tissue_at(1, p); }), 8.0, 11);
  Volume moving = with_noise(
      volume_of(grid, [this](glm::dvec3 p) { return tissue_at(1, p - shift); }), 8.0, 12);
  Field truth = field_of(grid, [this](glm::dvec3) { return shift; });
};

TEST(Match, OfTheTrueFieldIsHighAndOfNoneIsLow) {
  const Pair pair;
  const auto found = match(pair.fixed, pair.moving, pair.truth);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->blocks, 512u);
  EXPECT_GT(found->textured_share(), 0.9);
  EXPECT_GT(found->correlation_after, 0.9);
  EXPECT_LT(found->correlation_before, 0.5);
  EXPECT_GT(found->correlation_before, -0.5);
  EXPECT_LT(found->mismatched, 0.01);
  // The last of eight layers of blocks loses 4 of its 7 voxels, so it is not compared.
  EXPECT_EQ(found->compared, found->textured - 64u);
  EXPECT_NEAR(found->leaving, 4.0 / 56.0, 0.01);
  // The remaining difference is the noise of both frames: 8 sqrt(2).
  EXPECT_NEAR(found->difference_sd_after, 8.0 * std::sqrt(2.0), 0.4);
  EXPECT_GT(found->difference_sd_before, 50.0);
}

TEST(Match, DoesNotFallWithGainOrBias) {
  const Pair pair;
  Volume changed = pair.moving;
  for (int k = 0; k < 56; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i) {
        const size_t n = changed.grid.offset(i, j, k);
        changed.values[n] = (0.7F + 0.01F * float(i)) * changed.values[n] + 200.0F;
      }
  const auto plain = match(pair.fixed, pair.moving, pair.truth);
  const auto gained = match(pair.fixed, changed, pair.truth);
  // A gain that changes by 1 % per voxel tilts a block of 7 by a few per cent of the mean; the
  // texture has 20 %.
  EXPECT_NEAR(gained->correlation_after, plain->correlation_after, 0.05);
  EXPECT_GT(gained->difference_sd_after, 5.0 * plain->difference_sd_after);
}

TEST(Match, OfAnotherBodyIsNearZero) {
  const Pair pair;
  const Volume other = volume_of(pair.grid, [](glm::dvec3 p) { return tissue_at(77, p); });
  const auto found = match(pair.fixed, other, still_field(pair.grid));
  EXPECT_NEAR(found->correlation_after, 0.0, 0.1);
  EXPECT_GT(found->mismatched, 0.8);
}

TEST(Match, OfAnEmptyOrNoiseFrameFindsNoStructure) {
  const Pair pair;
  const Volume empty = volume_of(pair.grid, [](glm::dvec3) { return 0.0; });
  const Volume noise = with_noise(empty, 50.0, 4);
  EXPECT_EQ(match(pair.fixed, empty, still_field(pair.grid))->textured_moving, 0u);
  EXPECT_EQ(match(pair.fixed, empty, still_field(pair.grid))->correlation_after, 0.0);
  EXPECT_EQ(match(pair.fixed, noise, still_field(pair.grid))->textured_moving, 0u);
  EXPECT_EQ(match(empty, pair.moving, still_field(pair.grid))->textured, 0u);
}

/// Noise that a scanner has blurred looks like texture to the measure: noise_sd() measures white
/// noise only.
TEST(Match, IsNotLoweredByBlurredNoiseAroundTheBody) {
  const Grid grid = grid_at_origin(56);
  const auto body = [](glm::dvec3 p) { return p.x < 20.0 ? tissue_at(1, p) : 500.0; };
  const auto frame = [&](uint32_t seed) {
    Volume volume = volume_of(grid, body);
    for (int k = 0; k < 56; ++k)
      for (int j = 0; j < 56; ++j)
        for (int i = 0; i < 56; ++i)
          volume.values[grid.offset(i, j, k)] +=
              float(40.0 * texture::smooth_noise(seed, glm::dvec3(i, j, k) / 3.0));
    return with_noise(volume, 0.5, seed);
  };
  const Volume fixed = frame(21), moving = frame(22);
  const auto found = match(fixed, moving, still_field(grid));
  ASSERT_TRUE(found);
  EXPECT_GT(found->textured_share(), 0.95);
  EXPECT_LT(found->clear_share(), 0.5);
  EXPECT_GT(found->correlation_after, 0.9);
  EXPECT_LT(found->mismatched, 0.02);
}

TEST(Match, SeesTheMotionThatIsLeftInVoxelsOfEachAxis) {
  for (const double thick_mm : {1.0, 3.0}) {
    Grid grid = grid_at_origin(56);
    grid.spacing_mm.z = thick_mm;
    const auto tissue = [&](glm::dvec3 p) { return tissue_at(1, {p.x, p.y, p.z / thick_mm}); };
    const Volume fixed = with_noise(volume_of(grid, tissue), 8.0, 11);
    const Volume moving = with_noise(
        volume_of(grid, [&](glm::dvec3 p) { return tissue(p - glm::dvec3(0, 0, 4 * thick_mm)); }),
        8.0, 12);
    for (const double missed : {0.0, 0.5, 1.0}) {
      SCOPED_TRACE(missed);
      const Field u =
          field_of(grid, [&](glm::dvec3) { return glm::dvec3(missed, 0.0, 4.0 * thick_mm); });
      const auto found = match(fixed, moving, u);
      ASSERT_TRUE(found);
      // The error of one Gauss-Newton step, on structures of 5 voxels.
      EXPECT_NEAR(found->motion_left_voxels, missed, 0.05 + 0.15 * missed);
    }
  }
}

/// Waves of 12 voxels cancel in the mean over blocks of 21, along whichever axis they run.
TEST(Match, SeesShortWavesThatItsMeanMissesAndNoNoise) {
  const Grid grid = grid_at_origin(56);
  const auto tissue = [](glm::dvec3 p) { return tissue_at(1, p); };
  const Volume moving = with_noise(volume_of(grid, tissue), 8.0, 11);
  const auto share = [&](const Volume& fixed) {
    const auto found = match(fixed, moving, still_field(grid));
    EXPECT_TRUE(found);
    EXPECT_LT(found->motion_left_voxels, 0.3);
    return found->moving_share;
  };
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE(axis);
    const auto waves = [&](double most) {
      return with_noise(volume_of(grid,
                                  [&](glm::dvec3 p) {
                                    glm::dvec3 u(0.0);
                                    u[axis] =
                                        most * std::sin(2.0 * std::numbers::pi * p[axis] / 12.0);
                                    return tissue(p + u);
                                  }),
                        8.0, 12);
    };
    EXPECT_GT(share(waves(1.4)), 0.3);
    EXPECT_LT(share(waves(0.3)), 0.02);
  }
  // The motion that noise alone would give a plane is subtracted: else a fifth of the blocks would
  // count as moved.
  Volume blurred = with_noise(volume_of(grid, tissue), 8.0, 13);
  for (int k = 0; k < 56; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i)
        blurred.values[grid.offset(i, j, k)] +=
            float(80.0 * texture::smooth_noise(14, glm::dvec3(i, j, k) / 2.0));
  EXPECT_LT(share(blurred), 0.05);
}

TEST(Match, MarksTheVoxelsWithStructure) {
  const Grid grid = grid_at_origin(42);
  const Volume body =
      volume_of(grid, [](glm::dvec3 p) { return p.x < 21.0 ? tissue_at(3, p) : 0.0; });
  const Volume fixed = with_noise(body, 8.0, 9), moving = with_noise(body, 8.0, 10);
  Mask mask = test::whole(grid, 3), structure;
  const auto found = match(fixed, moving, still_field(grid), &mask, &structure);
  ASSERT_TRUE(found);
  ASSERT_TRUE(same_geometry(structure.grid, grid));
  size_t left = 0, wrong = 0;
  for (size_t n = 0; n < structure.values.size(); ++n) {
    left += structure.values[n] != 0;
    wrong += structure.values[n] && (!mask.values[n] || n % 42 >= 21);
  }
  EXPECT_GT(left, size_t(0.8 * 18 * 36 * 36));
  EXPECT_EQ(wrong, 0u);
}

TEST(Match, CountsWhatLeavesAsLost) {
  const Pair pair;
  const Field away = field_of(pair.grid, [](glm::dvec3) { return glm::dvec3(200.0, 0.0, 0.0); });
  const auto found = match(pair.fixed, pair.moving, away);
  EXPECT_DOUBLE_EQ(found->leaving, 1.0);
  EXPECT_DOUBLE_EQ(found->correlation_after, 0.0);
  EXPECT_DOUBLE_EQ(found->mismatched, 1.0);
}

TEST(Match, HonoursPhysicalSpaceOfTwoDifferentGrids) {
  const Pair pair;
  Grid oblique = grid_at_origin(70, 1.2);
  oblique.direction = test::some_rotation(2);
  oblique.origin_mm = glm::dvec3(28.0) - oblique.direction * glm::dvec3(0.5 * 69 * 1.2);
  const Volume moving =
      volume_of(oblique, [&](glm::dvec3 p) { return tissue_at(1, p - pair.shift); });
  EXPECT_GT(match(pair.fixed, moving, pair.truth)->correlation_after, 0.9);
}

TEST(Match, RefusesAMaskThatIsEmptyOrElsewhere) {
  const Pair pair;
  const Mask empty{pair.grid, std::vector<uint8_t>(pair.grid.count())};
  const Mask other = test::whole(grid_at_origin(10));
  EXPECT_FALSE(match(pair.fixed, pair.moving, pair.truth, &empty));
  EXPECT_FALSE(match(pair.fixed, pair.moving, pair.truth, &other));
}

}  // namespace
}  // namespace palpate
