#include <algorithm>
#include <cmath>

#include "compute/motion/activity.h"
#include "tests/motion/equation_images.h"
#include "tests/motion/kernel_test.h"

/// The kernels that resample, measure and repair a field, against their oracles.
namespace palpate::test {
namespace {

using oracle::Scalars;
using oracle::Texels;
using oracle::Vectors;

class UpsampleKernel : public KernelTest {};
class ClearKernel : public KernelTest {};
class FoldsKernel : public KernelTest {};
class BlendKernel : public KernelTest {};

TEST_F(UpsampleKernel, ReadsTheCoarseFieldBetweenItsCellsAndHoldsItsBorder) {
  struct Case {
    glm::ivec3 from, to;
    glm::dvec3 scale, offset;
  };
  const std::array<Case, 4> cases = {{
      {{5, 4, 9}, {9, 8, 17}, glm::dvec3(0.5), glm::dvec3(-0.25)},
      {{9, 5, 4}, {9, 9, 3}, {1.0, 0.5, 2.0}, {0.0, -0.25, 0.5}},
      {{1, 7, 1}, {1, 7, 2}, {0.5, 1.0, 0.5}, {-0.25, 0.0, -0.25}},
      {{70, 3, 2}, {140, 3, 3}, {0.5, 1.3, 0.7}, {-0.3, -2.0, 1.1}},
  }};
  for (const Case& c : cases) {
    SCOPED_TRACE(text(c.from) + " to " + text(c.to));
    const Vectors from = stored_vectors(c.from, 601, 5.0);
    const Texels expected = texels_of(oracle::upsample(from, c.to, c.scale, c.offset));
    const DeviceImage image = put(texels_of(from), Format::kRgba32);
    const DeviceImage to = output(c.to, Format::kRgba32);
    const DeviceImage as_well = output(c.to, Format::kRgba32);
    dispatch(kernels()->upsample(), {linear(image), to.image, as_well.image},
             shaders::UpsamplePush{glm::ivec4(c.to, 0), glm::ivec4(c.from, 0),
                                   glm::vec4(c.scale, 0), glm::vec4(c.offset, 0)},
             rows(c.to));
    // The coordinate of up to 70 cells has 6e-6 cells of fp32 rounding.
    expect_all(to, expected, 3, 5.0, 4.0 * sampling_tolerance());
    EXPECT_EQ(get(to).values, get(as_well).values);
  }
}

TEST_F(ClearKernel, LeavesZeroInEveryTexelOfAnyFormat) {
  for (const glm::ivec3 size : {glm::ivec3(1), glm::ivec3(65, 3, 2), glm::ivec3(64, 1, 9)}) {
    for (const Format format : {Format::kRgba16, Format::kRgba32}) {
      const DeviceImage image = output(size, format);
      vulkan::Recorder recorder(context());
      kernels()->record_clear(recorder, image.image);
      recorder.run();
      EXPECT_EQ(get(image).values, Texels(size).values) << text(size);
    }
  }
}

/// The kernel's results for each listed brick: moved, structure, reach.
class MeasureKernel : public KernelTest {
 protected:
  void expect_oracle(glm::ivec3 cells, const BrickList& bricks, uint32_t seed) {
    const double unit_mm = 0.7;
    const Vectors field = stored_vectors(cells, seed, 1.0);
    const Vectors seen =
        vectors_of(as_stored(texels_of(random_vectors(cells, seed + 1, 1.0)), Format::kRgba16));
    EquationImages images = images_of(random_equations(cells, seed + 2));
    for (Texels& image : images) image = as_stored(image, Format::kRgba16);
    const auto expected = oracle::measure(field, seen, equations_of(images), unit_mm);

    const DeviceImage now = put(texels_of(field), Format::kRgba32);
    const DeviceImage before = put(texels_of(seen), Format::kRgba16);
    const DeviceImage equations2 = put(images[2], Format::kRgba16);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    vulkan::Buffer looks(context(), bricks.size() * sizeof(BrickMeasure),
                         vulkan::Buffer::Kind::kHostVisible);
    for (BrickMeasure& look : looks.as<BrickMeasure>()) look = {};
    dispatch(kernels()->measure(),
             {list, nearest(now), nearest(before), before.image, nearest(equations2), looks},
             shaders::MeasurePush{glm::ivec4(cells, 0), glm::vec4(1.0 / unit_mm, 0, 0, 0)},
             brick_groups(bricks));
    for (size_t b = 0; b < bricks.size(); ++b) {
      const glm::ivec3 brick(bricks[b] & 1023U, bricks[b] >> 10 & 1023U, bricks[b] >> 20);
      const BrickMeasure& look = looks.as<BrickMeasure>()[b];
      EXPECT_NEAR(look.moved, expected.at(brick).x, 4.0 * kSingle) << text(brick);
      EXPECT_NEAR(look.structure, expected.at(brick).y, kSingle) << text(brick);
      EXPECT_NEAR(look.reach, expected.at(brick).z, 4.0 * kSingle) << text(brick);
    }
    // `seen` now contains the field in the listed bricks and its old values in the others.
    Vectors remembered = seen;
    oracle::for_each(cells, [&](glm::ivec3 i) {
      if (in_bricks(bricks, i)) remembered.at(i) = field.at(i);
    });
    expect_all(before, texels_of(remembered), 3, 0.0);
  }
};

TEST_F(MeasureKernel, FindsTheLargestMotionAndStructureOfEachBrickAndRemembersTheField) {
  uint32_t seed = 610;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    expect_oracle(cells, all_bricks(cells), seed += 3);
  }
}

TEST_F(MeasureKernel, LooksAtListedBricksOnlyInTheOrderOfTheList) {
  const glm::ivec3 cells(17, 19, 9);
  BrickList bricks = every_second_brick(cells);
  std::reverse(bricks.begin(), bricks.end());
  expect_oracle(cells, bricks, 630);
}

class ConfidenceKernel : public KernelTest {
 protected:
  /// From residuals of zero, where A is certain, to large ones, where the gradients that noise
  /// alone would give cancel all of A.
  static EquationImages stored_equations(glm::ivec3 cells, Format format, uint32_t seed) {
    oracle::Samples<oracle::NormalEquations> equations = random_equations(cells, seed);
    for (size_t i = 0; i < equations.values.size(); ++i) {
      oracle::NormalEquations& e = equations.values[i];
      e.residual *= 0.5 * double(i % 4);
      e.b *= 0.1 * double(i % 3);
    }
    EquationImages images = images_of(equations);
    for (Texels& image : images) image = as_stored(image, format);
    return images;
  }

  void expect_oracle(glm::ivec3 cells, Format format, uint32_t seed) {
    const oracle::Judging with{200.0, 0.7, {0.7, 0.9, 1.6}, {2.8, 3.6, 3.2}};
    const EquationImages images = stored_equations(cells, format, seed);
    const Vectors field = stored_vectors(cells, seed + 2, 1.5);
    // The error of an eigenvalue is a fraction of the trace. The results must be between those for
    // eigenvalues just below and just above.
    EquationImages lower = images, upper = images;
    for (size_t i = 0; i < images[0].values.size(); ++i) {
      const double off =
          kEigenvalue * (images[0].values[i].w + images[1].values[i].z + images[2].values[i].x);
      for (auto [bound, by] : {std::pair(&lower, -off), std::pair(&upper, off)}) {
        (*bound)[0].values[i].w += by;
        (*bound)[1].values[i].z += by;
        (*bound)[2].values[i].x += by;
      }
    }
    const Vectors one = oracle::deviation(equations_of(lower), field, with);
    const Vectors other = oracle::deviation(equations_of(upper), field, with);

    const DeviceImage e[3] = {put(images[0], format), put(images[1], format),
                              put(images[2], format)};
    const DeviceImage u = put(texels_of(field), Format::kRgba32);
    const DeviceImage out = output(cells, Format::kRgba32);
    const DeviceImage deviation = output(cells, Format::kRgba32);
    const BrickList bricks = all_bricks(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const glm::dvec3 noise =
        double(shaders::kNoiseOfGradient) / (with.spacing_mm * with.spacing_mm);
    dispatch(
        kernels()->confidence(),
        {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), nearest(u), out.image, deviation.image},
        shaders::ConfidencePush{glm::ivec4(cells, 0), glm::vec4(with.cell_mm, 1.0 / with.h_mm),
                                glm::vec4(noise, 1.0 / (with.voxels * with.h_mm * with.h_mm))},
        slice_groups(bricks));
    expect_all(out, texels_of(field), 3, 0.0);
    const Texels confidence = get(out), found = get(deviation);
    oracle::for_each(cells, [&](glm::ivec3 i) {
      const glm::dvec3 actual(glm::dvec2(found.at(i)), confidence.at(i).w);
      for (int c = 0; c < 3; ++c) {
        const double a = one.at(i)[c], b = other.at(i)[c];
        EXPECT_GE(actual[c], std::min(a, b) * (1.0 - kStep)) << text(i) << ", " << c;
        EXPECT_LE(actual[c], std::max(a, b) * (1.0 + kStep)) << text(i) << ", " << c;
      }
    });
  }

  // The relative error of the step is up to 2.5e-3: cofactors of these matrices, with conditions of
  // up to 1e4, in single precision. Confidence changes by 1.85 times as much.
  static constexpr double kStep = 5e-3;
};

TEST_F(ConfidenceKernel, FollowsFromWhatIsDeterminedAndWhatIsLeft) {
  uint32_t seed = 640;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    expect_oracle(cells, Format::kRgba32, seed += 3);
  }
}

TEST_F(ConfidenceKernel, TakesEquationsInHalfPrecision) {
  expect_oracle({17, 9, 7}, Format::kRgba16, 660);
}

TEST(DeviationOracle, GrowsWithEachThingThatSpeaksAgainstTheField) {
  const glm::ivec3 cells(3);
  const oracle::Judging with{300.0, 1.0, glm::dvec3(1.0), glm::dvec3(4.0)};
  oracle::Samples<oracle::NormalEquations> good(cells);
  for (auto& e : good.values) {
    e.a = glm::dmat3(0.05);
    e.residual = 0.02;
    e.counted = 1.0;
  }
  Vectors still(cells);
  const auto middle = [&](const auto& equations, const Vectors& field) {
    return oracle::deviation(equations, field, with).at({1, 1, 1});
  };
  const glm::dvec3 best = middle(good, still);
  EXPECT_GT(best.z, 0.95);
  const double certain = (0.02 + 1e-6) / (300.0 * (0.05 - 0.15625 * 0.02)) + 0.01;
  const double unknown = 10.0 + 0.01;
  // The gradients of noise in flat regions, r^2 / 8 per axis whatever the window averages: nothing
  // is known of any direction, so the field is a guess.
  auto flat = good;
  for (auto& e : flat.values) e.a = glm::dmat3(e.residual / 8.0);
  EXPECT_NEAR(middle(flat, still).x, shaders::kGuess, 1e-6);
  EXPECT_NEAR(middle(flat, still).y, shaders::kGuess, 1e-6);
  EXPECT_LT(middle(flat, still).z, 0.5);
  // An edge without a corner determines no motion along itself, but that across itself.
  auto edge = good;
  for (auto& e : edge.values) e.a[2][2] = e.residual / 8.0;
  EXPECT_NEAR(middle(edge, still).x, best.x, 1e-9);
  EXPECT_NEAR(middle(edge, still).y / best.y, std::pow(unknown / certain, 0.25), 1e-6);

  // All other things concern both directions.
  const auto both_grow = [&](const glm::dvec3& actual, double by) {
    EXPECT_NEAR(actual.x / best.x, by, 1e-3 * by);
    EXPECT_NEAR(actual.y / best.y, by, 1e-3 * by);
    EXPECT_LT(actual.z, best.z);
  };
  // The equations of the narrow window still have a step of half a voxel.
  auto asks = good;
  for (auto& e : asks.values) e.b = glm::dvec3(0.5 * (0.05 + 9e-4), 0.0, 0.0);
  both_grow(middle(asks, still), std::pow(0.53 / 0.03, 0.4));
  // The neighbouring cell moves 8 voxels further.
  Vectors jumps = still;
  jumps.at({2, 1, 1}) = {0.0, 8.0, 0.0};
  both_grow(middle(good, jumps), std::pow(2.1 / 0.1, 0.8));
  // Half of the voxels counted.
  auto half = good;
  for (auto& e : half.values) {
    e.a *= 0.5;
    e.residual *= 0.5;
    e.counted = 0.5;
  }
  both_grow(middle(half, still), 2.0);
  // No voxel counted.
  auto nothing = good;
  for (auto& e : nothing.values) e.counted = 0.0;
  EXPECT_EQ(middle(nothing, still).z, 0.0);
  EXPECT_GT(middle(nothing, still).y, 10.0 * best.y);
}

TEST_F(FoldsKernel, FlagsCellsWhoseVoxelsFoldAtAnyCorner) {
  const glm::dvec3 spacing_mm(0.7, 1.1, 2.5);
  const double limit = 0.01;
  const std::array<glm::ivec3, 4> cell_sizes = {glm::ivec3(1), glm::ivec3(2), glm::ivec3(4),
                                                glm::ivec3(4, 2, 1)};
  size_t folded = 0, fine = 0;
  uint32_t seed = 700;
  for (const glm::ivec3 size :
       {glm::ivec3(17, 9, 7), glm::ivec3(9, 7, 18), glm::ivec3(8, 8, 8), glm::ivec3(17, 12, 1)}) {
    for (const glm::ivec3 cell : cell_sizes) {
      // Fields that never fold, fields near the quick bound, and fields that fold everywhere;
      // looked at between the cells' middles, too, or there only.
      for (const auto& [reach, between] : {std::pair(0.05, true),
                                           {0.2, true},
                                           {0.3, true},
                                           {0.6, true},
                                           {0.3, false},
                                           {0.6, false}}) {
        SCOPED_TRACE(text(size) + " in cells of " + text(cell) + ", reach " +
                     std::to_string(reach) + (between ? "" : ", middles only"));
        Vectors field = random_vectors(oracle::cells_of(size, cell), ++seed, reach);
        for (glm::dvec3& u : field.values) u *= spacing_mm * glm::dvec3(cell);
        field = vectors_of(as_stored(texels_of(field), Format::kRgba32));
        const Scalars smallest = oracle::folds(field, cell, size, spacing_mm, between);
        const BrickList bricks = all_bricks(field.size);
        const vulkan::Buffer list = upload_bricks(context(), bricks);
        const DeviceImage u = put(texels_of(field), Format::kRgba32);
        const DeviceImage flags = output(field.size, Format::kRgba16);
        vulkan::Buffer count(context(), bricks.size() * sizeof(uint32_t),
                             vulkan::Buffer::Kind::kHostVisible);
        std::fill(count.as<uint32_t>().begin(), count.as<uint32_t>().end(), 0U);
        dispatch(kernels()->folds(), {list, linear(u), flags.image, count, nearest(u)},
                 shaders::FoldsPush{glm::ivec4(field.size, between ? 1 : 0), glm::ivec4(cell, 0),
                                    glm::ivec4(size, 0), glm::vec4(spacing_mm, limit)},
                 slice_groups(bricks));
        const Texels actual = get(flags);
        std::vector<uint32_t> flagged(bricks.size());
        const double margin = context()->is_cpu() ? kDeterminant : kTextureUnit;
        oracle::for_each(field.size, [&](glm::ivec3 i) {
          for (size_t b = 0; b < bricks.size(); ++b)
            flagged[b] += unpacked(bricks[b]) == i / shaders::kBrick && actual.at(i).x == 1.0;
          const double least = smallest.at(i);
          if (std::abs(least - limit) < margin) return;
          EXPECT_EQ(actual.at(i).x, least < limit ? 1.0 : 0.0)
              << "cell " << text(i) << ", smallest determinant " << least;
          (least < limit ? folded : fine) += 1;
        });
        for (size_t b = 0; b < bricks.size(); ++b)
          EXPECT_EQ(count.as<uint32_t>()[b], flagged[b]) << "brick " << b;
      }
    }
  }
  // Cases on both sides of the limit must have been tested.
  EXPECT_GT(folded, 100U);
  EXPECT_GT(fine, 100U);
}

TEST_F(BlendKernel, SmoothsAroundFlaggedCellsAndKeepsAllOthers) {
  uint32_t seed = 800;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    const Vectors field = stored_vectors(cells, seed += 2, 5.0);
    const Scalars flags = random_mask(cells, seed + 1, 0.02);
    const BrickList bricks = all_bricks(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage f = put(texels_of(flags), Format::kRgba16);
    const DeviceImage u = put(texels_of(field), Format::kRgba32);
    const DeviceImage to = output(cells, Format::kRgba32);
    dispatch(kernels()->blend(), {list, nearest(f), nearest(u), to.image},
             shaders::BlendPush{glm::ivec4(cells, 0)}, slice_groups(bricks));
    expect_all(to, texels_of(oracle::blend(flags, field)), 3, 5.0);
  }
}

TEST_F(BlendKernel, WorksOnListedBricksOnly) {
  const glm::ivec3 cells(17, 19, 9);
  const Vectors field = stored_vectors(cells, 820, 5.0);
  const Scalars flags = random_mask(cells, 821, 0.2);
  const BrickList bricks = every_second_brick(cells);
  const vulkan::Buffer list = upload_bricks(context(), bricks);
  const DeviceImage f = put(texels_of(flags), Format::kRgba16);
  const DeviceImage u = put(texels_of(field), Format::kRgba32);
  const DeviceImage to = output(cells, Format::kRgba32);
  dispatch(kernels()->blend(), {list, nearest(f), nearest(u), to.image},
           shaders::BlendPush{glm::ivec4(cells, 0)}, slice_groups(bricks));
  expect_cells(to, texels_of(oracle::blend(flags, field)), bricks, 3, 5.0, kSingle);
  // Where all their cells are asked for it is as if each touched a fold.
  dispatch(kernels()->blend(), {list, nearest(f), nearest(u), to.image},
           shaders::BlendPush{glm::ivec4(cells, 1)}, slice_groups(bricks));
  expect_cells(to, texels_of(oracle::blend(Scalars(cells, 1.0), field)), bricks, 3, 5.0, kSingle);
}

}  // namespace
}  // namespace palpate::test
