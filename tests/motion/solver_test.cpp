#include "tests/motion/solver_test.h"

#include <numbers>

#include "compute/volume/phantom.h"
#include "tests/support/tolerances.h"

/// Whole estimations of motions that are given by a formula. The truth is exact to float rounding,
/// also the phantom's; the tolerances are for the method's own error (tolerances.h).
namespace palpate::test {
namespace {

class Solver : public SolverTest {
 protected:
  void expect_found(const MadePair& pair, const std::string& preset_name, double mean = kRigidMean,
                    double p95 = kRigidP95) {
    const Spread error =
        error_voxels(pair, motion_of(pair.fixed, pair.moving, preset(preset_name)));
    EXPECT_GT(error.count, pair.truth.grid.count() / 4);
    EXPECT_LT(error.mean, mean) << preset_name;
    EXPECT_LT(error.p95, p95) << preset_name;
    RecordProperty("mean_voxel", std::to_string(error.mean));
    RecordProperty("p95_voxel", std::to_string(error.p95));
  }
};

TEST_F(Solver, FindsATranslationByAFractionOfAVoxelWithEveryPreset) {
  AffineMap map;
  map.shift_mm = {0.6, -0.4, 0.3};
  const MadePair pair = made_pair(plain_grid({48, 44, 40}), map);
  for (const std::string name : {"fast", "balanced", "best"}) expect_found(pair, name);
}

TEST_F(Solver, FindsATranslationByMoreThanTheStructuresAreWide) {
  AffineMap map;
  map.shift_mm = {9.0, -7.0, 5.0};
  expect_found(made_pair(plain_grid({56, 56, 48}), map), "balanced");
}

/// An organ that moves by 34 voxels past still tissue: coarse levels average the two motions, and
/// the discrete start searches where they leave a difference. Where they leave none, the search
/// must not change anything.
TEST_F(Solver, SearchesForMotionThatCoarseLevelsLeaveUnexplained) {
  EstimatorOptions searching = preset("balanced");
  searching.motion.sliding.cell = 0;
  EstimatorOptions not_searching = searching;
  not_searching.motion.search_mm = 0.0;
  const SlidingPhantom slide = sliding_phantom(96, 34.0);
  const auto error = [&](const EstimatorOptions& options) {
    const PairMotion motion = motion_of(slide.fixed, slide.moving, options);
    const Result<Distances> distances = endpoint_error(motion.field, slide.truth, &slide.organ);
    EXPECT_TRUE(distances);
    return distances ? distances->voxels.mean : 1e30;
  };
  const double with = error(searching), without = error(not_searching);
  EXPECT_LT(with, 0.9 * without);
  RecordProperty("mean_voxel", std::to_string(with));
  RecordProperty("without", std::to_string(without));

  AffineMap map;
  map.shift_mm = {0.6, -0.4, 0.3};
  const MadePair plain = made_pair(plain_grid({56, 48, 64}), map);
  EXPECT_LT(error_voxels(plain, motion_of(plain.fixed, plain.moving, searching)).mean,
            1.02 * error_voxels(plain, motion_of(plain.fixed, plain.moving, not_searching)).mean);
}

/// Waves shorter than the window, which averages them away unless it yields where the level above
/// left a difference. Where none is left, this must not change anything.
TEST_F(Solver, YieldsToWavesThatAreShorterThanItsWindow) {
  EstimatorOptions yielding = preset("balanced"), stiff = yielding;
  yielding.motion.yield.window = 2.5;
  stiff.motion.yield.window = 0.0;
  const MadePair waves = wave_pair(plain_grid({56, 48, 64}), 0.8, 18.0);
  const Spread with = error_voxels(waves, motion_of(waves.fixed, waves.moving, yielding));
  const Spread without = error_voxels(waves, motion_of(waves.fixed, waves.moving, stiff));
  EXPECT_LT(with.mean, 0.6 * without.mean);
  RecordProperty("mean_voxel", std::to_string(with.mean));
  RecordProperty("without", std::to_string(without.mean));

  AffineMap map;
  map.shift_mm = {0.6, -0.4, 0.3};
  const MadePair plain = made_pair(plain_grid({56, 48, 64}), map);
  EXPECT_LT(error_voxels(plain, motion_of(plain.fixed, plain.moving, yielding)).mean,
            1.1 * error_voxels(plain, motion_of(plain.fixed, plain.moving, stiff)).mean);
}

/// Waves that leave no large difference, so that the windows are told apart only by what each
/// predicts of cells that it did not see. Where both predict the same, nothing may get worse.
TEST_F(Solver, ChoosesTheWindowThatPredictsWhatIsLeftOut) {
  const EstimatorOptions choosing = preset("best");
  ASSERT_GT(choosing.motion.yield.choose_after, 0);
  EstimatorOptions not_choosing = choosing;
  not_choosing.motion.yield.choose_after = 0;
  const MadePair waves = wave_pair(plain_grid({56, 48, 64}), 0.6, 30.0);
  const double with = error_voxels(waves, motion_of(waves.fixed, waves.moving, choosing)).mean;
  const double without =
      error_voxels(waves, motion_of(waves.fixed, waves.moving, not_choosing)).mean;
  EXPECT_LT(with, 0.8 * without);
  RecordProperty("mean_voxel", std::to_string(with));
  RecordProperty("without", std::to_string(without));

  AffineMap map;
  map.shift_mm = {0.6, -0.4, 0.3};
  const MadePair plain = made_pair(plain_grid({56, 48, 64}), map);
  EXPECT_LT(error_voxels(plain, motion_of(plain.fixed, plain.moving, choosing)).mean,
            1.1 * error_voxels(plain, motion_of(plain.fixed, plain.moving, not_choosing)).mean);
}

/// The iteration that chooses is one like the others: it must not lose the momentum of those before
/// it. Here it never takes the narrow window.
TEST_F(Solver, GoesOnWithItsMomentumAfterTheChoice) {
  EstimatorOptions choosing = preset("balanced"), not_choosing = choosing;
  choosing.motion.yield.gain_low = 1e3;
  choosing.motion.yield.gain_high = 2e3;
  not_choosing.motion.yield.choose_after = 0;
  const MadePair waves = wave_pair(plain_grid({56, 48, 64}), 0.6, 30.0);
  const double with = error_voxels(waves, motion_of(waves.fixed, waves.moving, choosing)).mean;
  const double without =
      error_voxels(waves, motion_of(waves.fixed, waves.moving, not_choosing)).mean;
  EXPECT_LT(with, 1.01 * without);
  RecordProperty("mean_voxel", std::to_string(with));
  RecordProperty("without", std::to_string(without));
}

/// Noise with structures of several voxels, as in images that were enlarged: neighbouring cells
/// share it, so each predicts that of the other. The narrow window must not be chosen for that.
TEST_F(Solver, DoesNotFollowNoiseThatCellsShare) {
  AffineMap map;
  map.shift_mm = {1.6, -2.4, 1.3};
  MadePair pair = made_pair(plain_grid({64, 60, 56}), map, 3, 2.0);
  const auto add_noise = [](Volume& volume, uint32_t seed) {
    constexpr double kStructure = 6.0, kAmplitude = 20.0;
    for (int k = 0; k < volume.grid.size.z; ++k)
      for (int j = 0; j < volume.grid.size.y; ++j)
        for (int i = 0; i < volume.grid.size.x; ++i)
          volume.values[volume.grid.offset(i, j, k)] +=
              float(kAmplitude * texture::smooth_noise(seed, glm::dvec3(i, j, k) / kStructure));
  };
  add_noise(pair.fixed, 11);
  add_noise(pair.moving, 12);
  for (const char* name : {"balanced", "best"}) {
    const EstimatorOptions choosing = preset(name);
    EstimatorOptions not_choosing = choosing;
    not_choosing.motion.yield.choose_after = 0;
    const double with = error_voxels(pair, motion_of(pair.fixed, pair.moving, choosing)).mean;
    const double without =
        error_voxels(pair, motion_of(pair.fixed, pair.moving, not_choosing)).mean;
    EXPECT_LT(with, 1.05 * without) << name;
    RecordProperty(std::string(name) + "_mean_voxel", std::to_string(with));
    RecordProperty(std::string(name) + "_without", std::to_string(without));
  }
}

/// An organ that slides past a still wall: the step that compares intensities puts the border in
/// its place, on both sides, with any gain between the frames, and no cell folds.
TEST_F(Solver, PutsTheBorderOfASlidingOrganInItsPlace) {
  SlidingPhantom slide = sliding_phantom();
  const EstimatorOptions with = preset("balanced");
  EstimatorOptions without = with;
  without.motion.sliding.cell = 0;
  const auto errors = [&](const EstimatorOptions& options) {
    const PairMotion motion = motion_of(slide.fixed, slide.moving, options);
    EXPECT_EQ(folds(resampled(motion.field, slide.fixed.grid)).folded, 0U);
    EXPECT_EQ(folds(motion.field).folded, 0U);
    const auto in = [&](const Mask& mask) {
      const Result<Distances> distances = endpoint_error(motion.field, slide.truth, &mask);
      EXPECT_TRUE(distances);
      return distances ? distances->voxels.mean : 1e30;
    };
    return std::pair(in(slide.organ), in(slide.wall));
  };
  const auto before = errors(without), after = errors(with);
  EXPECT_LT(after.first, kSlidingOrganMean);
  EXPECT_LT(after.second, kSlidingWallMean);
  EXPECT_LT(after.second, 0.6 * before.second);
  RecordProperty("organ_voxel", std::to_string(after.first));
  RecordProperty("wall_voxel", std::to_string(after.second));

  // On the solved cells, as `fast` has it, and sequences.
  EstimatorOptions coarse = preset("fast");
  EXPECT_EQ(plan_motion(slide.fixed.grid, coarse.motion).field.size,
            plan_motion(slide.fixed.grid, without_sliding_step(coarse.motion)).field.size);
  const auto fast_after = errors(coarse);
  coarse.motion = without_sliding_step(coarse.motion);
  const auto fast_before = errors(coarse);
  EXPECT_LT(fast_after.first, 0.75 * fast_before.first);
  EXPECT_LT(fast_after.second, 0.7 * fast_before.second);
  RecordProperty("fast_organ_voxel", std::to_string(fast_after.first));
  RecordProperty("fast_wall_voxel", std::to_string(fast_after.second));

  for (float& value : slide.fixed.values) value = 1.25F * value + 40.0F;
  const auto brighter = errors(with);
  EXPECT_LT(brighter.first, 1.1 * kSlidingOrganMean);
  EXPECT_LT(brighter.second, 1.1 * kSlidingWallMean);
}

/// Where nothing slides the step takes no candidate; it only resamples the field on finer cells.
TEST_F(Solver, TakesNothingOverWhereTheMotionIsSmooth) {
  const Grid grid = plain_grid({64, 60, 56});
  AffineMap map;
  map.linear = glm::dmat3(1.04, 0.02, 0.0, -0.02, 0.97, 0.03, 0.0, -0.03, 1.02);
  map.shift_mm = {2.0, -3.0, 1.0};
  map.centre_mm = middle_of(grid);
  const MadePair pair = made_pair(grid, map);
  EstimatorOptions options = preset("balanced");
  options.motion.sliding.apart = 1e6;
  const PairMotion never = motion_of(pair.fixed, pair.moving, options);
  const PairMotion usual = motion_of(pair.fixed, pair.moving, preset("balanced"));
  EXPECT_EQ(usual.report.sliding_bricks, 0.0);
  EXPECT_EQ(usual.field.u_mm, never.field.u_mm);
  EXPECT_EQ(usual.field.grid.size, (grid.size + 1) / 2);
  // On the solved cells it changes nothing at all.
  options.motion = without_sliding_step(*motion_preset("fast"));
  EXPECT_EQ(motion_of(pair.fixed, pair.moving, preset("fast")).field.u_mm,
            motion_of(pair.fixed, pair.moving, options).field.u_mm);
}

TEST_F(Solver, FindsARotation) {
  AffineMap map;
  const double angle = 6.0 * std::numbers::pi / 180.0;
  map.linear = glm::dmat3(std::cos(angle), std::sin(angle), 0.0, -std::sin(angle), std::cos(angle),
                          0.0, 0.0, 0.0, 1.0);
  const Grid grid = plain_grid({48, 48, 48});
  map.centre_mm = middle_of(grid);
  expect_found(made_pair(grid, map), "balanced");
}

TEST_F(Solver, FindsAScaling) {
  AffineMap map;
  map.linear = glm::dmat3(0.93);
  const Grid grid = plain_grid({48, 48, 48});
  map.centre_mm = middle_of(grid);
  expect_found(made_pair(grid, map), "balanced", kScalingMean, kScalingP95);
}

TEST_F(Solver, GivesMillimetresAlongLpsOnAnObliqueAnisotropicGrid) {
  Grid grid = plain_grid({56, 48, 24}, {0.8, 0.9, 2.0});
  grid.origin_mm = {-40.0, 25.0, 110.0};
  grid.direction = some_rotation(3);
  AffineMap map;
  map.linear = glm::dmat3(1.03, 0.02, 0.0, -0.02, 0.97, 0.01, 0.0, -0.01, 1.0);
  map.shift_mm = {1.6, -1.1, 2.3};
  map.centre_mm = middle_of(grid);
  const MadePair pair = made_pair(grid, map);
  expect_found(pair, "balanced");

  // The same without the project's own measures: u in the middle is the shift.
  const PairMotion motion = motion_of(pair.fixed, pair.moving, preset("balanced"));
  const glm::dvec3 u = sample_at_lps(motion.field, middle_of(grid));
  EXPECT_LT(glm::distance(u, map.shift_mm), kRigidP95 * grid.finest_mm());
}

/// A slice in any orientation, thinner or thicker than its pixels are wide, with noise as from a
/// scanner: the in-plane motion is found, and no motion across the plane.
TEST_F(Solver, FindsTheMotionInASingleSliceOfAnyOrientation) {
  for (int across = 0; across < 3; ++across) {
    for (const double thick_mm : {0.3, 1.0, 8.0}) {
      SCOPED_TRACE(::testing::Message() << "axis " << across << ", " << thick_mm << " mm thick");
      Grid grid = plain_grid(glm::ivec3(64));
      grid.size[across] = 1;
      grid.spacing_mm[across] = thick_mm;
      grid.direction = some_rotation(3);
      const glm::dvec3 a = grid.direction[(across + 1) % 3], b = grid.direction[(across + 2) % 3];
      AffineMap map;
      map.linear =
          glm::dmat3(1.0) + 0.04 * glm::outerProduct(a, b) - 0.03 * glm::outerProduct(b, a);
      map.shift_mm = 2.6 * a - 3.3 * b;
      map.centre_mm = middle_of(grid);
      MadePair pair = made_pair(grid, map, 1, 1.0);
      for (size_t n = 0; n < pair.fixed.values.size(); ++n) {
        pair.fixed.values[n] += float(6.0 * texture::gaussian_like(1, n));
        pair.moving.values[n] += float(6.0 * texture::gaussian_like(2, n));
      }
      for (const std::string name : {"fast", "balanced", "best"}) {
        const PairMotion motion = motion_of(pair.fixed, pair.moving, preset(name));
        const Mask seen = seen_in_plane(pair.truth, across, 3.0);
        const Result<Distances> error = endpoint_error(motion.field, pair.truth, &seen);
        ASSERT_TRUE(error);
        EXPECT_LT(error->mm.mean, kSliceMean) << name;
        const auto doubted = low_confidence_share(motion.confidence);
        ASSERT_TRUE(doubted);
        EXPECT_LT(*doubted, 0.2) << name;
        for (const glm::vec3 u : motion.field.u_mm)
          ASSERT_LT(std::abs(glm::dot(glm::dvec3(u), grid.direction[across])), kNoMotion) << name;
      }
    }
  }
}

TEST_F(Solver, FindsTheBeatOfTheHeartPhantom) {
  const Sequence heart = shell_phantom(64);
  for (int k = 0; k < 2; ++k) {
    SCOPED_TRACE(k);
    const PairMotion motion =
        motion_of(heart.frames[size_t(k)], heart.frames[size_t(k) + 1], preset("balanced"));
    const Grid& grid = heart.frames[0].grid;
    const Mask shell = shell_mask(grid, k);
    const Result<Distances> error =
        endpoint_error(motion.field, shell_truth(grid, k, k + 1), &shell);
    ASSERT_TRUE(error);
    EXPECT_LT(error->voxels.mean, kCoarseHeartMean);
    RecordProperty("mean_voxel", std::to_string(error->voxels.mean));
  }
}

TEST_F(Solver, FindsNothingBetweenAFrameAndItself) {
  const MadePair pair = made_pair(plain_grid({33, 40, 29}), {});
  for (const std::string name : {"fast", "balanced", "best", "classic"}) {
    const PairMotion motion = motion_of(pair.fixed, pair.fixed, preset(name));
    double largest = 0.0;
    for (const glm::vec3 u : motion.field.u_mm) largest = std::max(largest, double(glm::length(u)));
    EXPECT_LT(largest, kNoMotion) << name;
  }
}

TEST_F(Solver, FindsNothingInFlatFrames) {
  const Grid grid = plain_grid({20, 24, 28});
  const Volume flat{grid, std::vector<float>(grid.count(), 37.0F)};
  for (const std::string name : {"fast", "classic"}) {
    const PairMotion motion = motion_of(flat, flat, preset(name));
    for (const glm::vec3 u : motion.field.u_mm) ASSERT_LT(glm::length(u), kNoMotion) << name;
  }
}

TEST_F(Solver, IsNotMisledByWhatLiesOutsideTheMask) {
  AffineMap map;
  map.shift_mm = {1.2, -0.8, 0.5};
  MadePair pair = made_pair(plain_grid({48, 48, 48}), map);
  // In the upper half of x the frames are unrelated.
  const Volume other = noise_volume(pair.fixed.grid, 9);
  EstimatorOptions options = preset("balanced");
  options.mask = Mask{pair.fixed.grid, std::vector<uint8_t>(pair.fixed.grid.count())};
  Mask scored = seen_in_both(pair.truth, 3.0);
  for (size_t at = 0; at < pair.fixed.values.size(); ++at) {
    const int i = int(at % 48);
    options.mask->values[at] = i < 30;
    if (i >= 34) pair.fixed.values[at] = other.values[at];
    if (i >= 28) scored.values[at] = 0;
  }
  const PairMotion motion = motion_of(pair.fixed, pair.moving, options);
  const Result<Distances> error = endpoint_error(motion.field, pair.truth, &scored);
  ASSERT_TRUE(error);
  EXPECT_LT(error->voxels.mean, kRigidMean);
  EXPECT_LT(error->voxels.p95, kRigidP95);
}

/// Half of the material inside the fixed frame's mask moves out of it. Measured: mean 0.03; 0.37 if
/// partners outside the mask are left out too.
TEST_F(Solver, FollowsWhatMovesOutOfTheMask) {
  AffineMap map;
  map.shift_mm = {6.0, 0.0, 0.0};
  const MadePair pair = made_pair(plain_grid({48, 44, 40}), map);
  EstimatorOptions options = preset("balanced");
  options.mask = Mask{pair.fixed.grid, std::vector<uint8_t>(pair.fixed.grid.count())};
  Mask scored = seen_in_both(pair.truth, 3.0);
  for (size_t at = 0; at < pair.fixed.values.size(); ++at) {
    const int i = int(at % 48);
    options.mask->values[at] = i >= 14 && i < 26;
    scored.values[at] = scored.values[at] && options.mask->values[at];
  }
  const PairMotion motion = motion_of(pair.fixed, pair.moving, options);
  const Result<Distances> error = endpoint_error(motion.field, pair.truth, &scored);
  ASSERT_TRUE(error);
  EXPECT_LT(error->voxels.mean, kRigidMean);
  EXPECT_LT(error->voxels.p95, kRigidP95);
}

TEST_F(Solver, StopsWhenAskedTo) {
  const MadePair pair = made_pair(plain_grid({32, 32, 32}), {});
  std::stop_source stop;
  stop.request_stop();
  const Result<PairMotion> motion =
      estimate_motion(context(), pair.fixed, pair.moving, preset("fast"), stop.get_token());
  ASSERT_FALSE(motion);
  EXPECT_EQ(motion.error().kind, ErrorKind::kCancelled);
}

}  // namespace
}  // namespace palpate::test
