#include "compute/motion/gauss.h"
#include "tests/motion/kernel_test.h"

/// The kernels that build the pyramid, against their oracles.
namespace palpate::test {
namespace {

using oracle::Scalars;
using oracle::Texels;

class DownsampleKernel : public KernelTest {};
class MomentsKernel : public KernelTest {};
class GaussKernel : public KernelTest {};
class NormaliseKernel : public KernelTest {};
class PackKernel : public KernelTest {};

/// Ratio 2 for each axis with enough samples, and 1 for one axis that is kept.
glm::ivec3 ratio_of(glm::ivec3 size, int kept) {
  glm::ivec3 ratio = glm::min(size, glm::ivec3(2));
  ratio[kept] = 1;
  return ratio;
}

TEST_F(DownsampleKernel, IsTheSumOverFourTapsPerAxisAtOddSizesAndBorders) {
  for (const glm::ivec3 size : kSizes) {
    for (int kept = 0; kept < 3; ++kept) {
      const glm::ivec3 ratio = ratio_of(size, kept);
      SCOPED_TRACE(text(size) + " by " + text(ratio));
      const Texels fine = random_texels(size, 11);
      const Texels fine_stored = as_stored(fine, Format::kR32);
      const Texels expected = texels_of(oracle::downsample(scalars_of(fine_stored), ratio));
      const DeviceImage from = put(fine, Format::kR32);
      const DeviceImage to = output(expected.size, Format::kR32);
      dispatch(kernels()->downsample(), {linear(from), to.image},
               shaders::DownsamplePush{glm::ivec4(size, 0), glm::ivec4(expected.size, 0),
                                       glm::ivec4(ratio, 0)},
               rows(expected.size));
      expect_all(to, expected, 1, 1.0, sampling_tolerance());
    }
  }
}

TEST_F(DownsampleKernel, HalvesAllAxesOfAnImageInHalfPrecision) {
  const glm::ivec3 size(17, 9, 15);
  const Texels fine = random_texels(size, 12);
  const Scalars stored = scalars_of(as_stored(fine, Format::kR16));
  const Texels expected = texels_of(oracle::downsample(stored, glm::ivec3(2)));
  const DeviceImage from = put(fine, Format::kR16);
  const DeviceImage to = output(expected.size, Format::kR16);
  dispatch(kernels()->downsample(), {linear(from), to.image},
           shaders::DownsamplePush{glm::ivec4(size, 0), glm::ivec4(expected.size, 0),
                                   glm::ivec4(2, 2, 2, 0)},
           rows(expected.size));
  expect_all(to, expected, 1, 1.0, sampling_tolerance());
}

TEST_F(MomentsKernel, AveragesWhatOfACellLiesInsideTheImage) {
  for (const glm::ivec3 size : kSizes) {
    for (const glm::ivec3 cell : {glm::ivec3(1), glm::ivec3(2), glm::ivec3(1, 2, 4)}) {
      SCOPED_TRACE(text(size) + " in cells of " + text(cell));
      const Texels image = random_texels(size, 21);
      const Texels expected = oracle::moments(scalars_of(as_stored(image, Format::kR32)), cell);
      const DeviceImage from = put(image, Format::kR32);
      const DeviceImage to = output(expected.size, Format::kRgba32);
      dispatch(kernels()->moments(), {nearest(from), to.image},
               shaders::MomentsPush{glm::ivec4(size, 0), glm::ivec4(expected.size, 0),
                                    glm::ivec4(cell, 0)},
               rows(expected.size));
      expect_all(to, expected, 4, 1.0);
    }
  }
}

TEST_F(GaussKernel, SmoothsAlongEveryAxisWithItsOwnSigma) {
  // From no filter (below 0.3) over radii larger than a brick to the largest radius.
  const std::array<glm::dvec3, 4> sigmas = {glm::dvec3(0.2, 1.0, 3.0), glm::dvec3(3.5, 0.5, 0.1),
                                            glm::dvec3(1.5), glm::dvec3(0.0, 5.0, 0.31)};
  for (const glm::ivec3 size : kSizes) {
    for (const glm::dvec3 sigma : sigmas) {
      SCOPED_TRACE(text(size) + " by " + text(sigma));
      const Texels image = random_texels(size, 31);
      const Texels expected = oracle::gauss(as_stored(image, Format::kRgba32), sigma);
      const DeviceImage a = put(image, Format::kRgba32);
      const DeviceImage b = output(size, Format::kRgba32);
      const BrickList bricks = all_bricks(size);
      const vulkan::Buffer list = upload_bricks(context(), bricks);
      vulkan::Recorder recorder(context());
      const bool in_b = record_gauss(recorder, *kernels(), list, brick_groups(bricks), sigma,
                                     {&a.image}, {&b.image});
      recorder.run();
      expect_all(in_b ? b : a, expected, 4, 1.0);
    }
  }
}

TEST_F(GaussKernel, SmoothsHalfPrecisionImagesTogetherAndLeavesUnlistedBricksAlone) {
  const glm::ivec3 size(17, 19, 9);
  const BrickList bricks = every_second_brick(size);
  const vulkan::Buffer list = upload_bricks(context(), bricks);
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE(axis);
    glm::dvec3 sigma(0.0);
    sigma[axis] = 1.5;
    const Texels first = random_texels(size, 32);
    const Texels second = random_texels(size, 33, 100.0);
    const DeviceImage from[2] = {put(first, Format::kRgba16), put(second, Format::kRgba16)};
    const DeviceImage to[2] = {output(size, Format::kRgba16), output(size, Format::kRgba16)};
    vulkan::Recorder recorder(context());
    ASSERT_TRUE(record_gauss(recorder, *kernels(), list, brick_groups(bricks), sigma,
                             {&from[0].image, &from[1].image}, {&to[0].image, &to[1].image}));
    recorder.run();
    expect_cells(to[0], oracle::gauss(as_stored(first, Format::kRgba16), sigma), bricks, 4, 1.0,
                 kSingle);
    expect_cells(to[1], oracle::gauss(as_stored(second, Format::kRgba16), sigma), bricks, 4, 100.0,
                 kSingle);
  }
}

TEST(GaussPush, HasWeightsThatSumToOne) {
  for (const double sigma : {0.1, 0.3, 1.0, 2.7, 3.6, 9.0}) {
    const shaders::GaussPush push = gauss_push(glm::ivec3(20), 1, sigma);
    double sum = push.weights[0][0];
    for (int k = 1; k <= push.radius.x; ++k) sum += 2.0 * double(push.weights[k / 4][k % 4]);
    EXPECT_NEAR(sum, 1.0, kSingle) << "sigma " << sigma;
    EXPECT_LE(push.radius.x, shaders::kMaxRadius);
  }
}

/// The input of normalise: an image, and moments as the engine computes them.
struct NormaliseCase {
  Texels image;
  Texels moments;
};

NormaliseCase normalise_case(glm::ivec3 size, glm::ivec3 cell, Format format) {
  NormaliseCase made;
  made.image = as_stored(random_texels(size, 41), format);
  made.moments =
      as_stored(oracle::gauss(oracle::moments(scalars_of(made.image), cell), glm::dvec3(1.0)),
                Format::kRgba32);
  return made;
}

TEST_F(NormaliseKernel, TakesOutLocalMeanAndVarianceReadBetweenCells) {
  const double noise = 0.02;
  for (const glm::ivec3 size : kSizes) {
    for (const glm::ivec3 cell : {glm::ivec3(1), glm::ivec3(2), glm::ivec3(2, 1, 4)}) {
      SCOPED_TRACE(text(size) + " in cells of " + text(cell));
      const NormaliseCase made = normalise_case(size, cell, Format::kR32);
      const Texels expected =
          texels_of(oracle::normalise(scalars_of(made.image), made.moments, cell, noise));
      const DeviceImage image = put(made.image, Format::kR32);
      const DeviceImage moments = put(made.moments, Format::kRgba32);
      const DeviceImage to = output(size, Format::kR32);
      dispatch(kernels()->normalise(), {nearest(image), linear(moments), to.image},
               shaders::NormalisePush{glm::ivec4(size, 0), glm::ivec4(made.moments.size, 0),
                                      glm::ivec4(cell, 0), glm::vec4(noise * noise, 1, 0, 0)},
               rows(size));
      // A cell of one voxel has only the noise's variance, so its result is large.
      double scale = 1.0;
      for (const glm::dvec4& value : expected.values) scale = std::max(scale, std::abs(value.x));
      expect_all(to, expected, 1, scale, std::max(kNormalised, sampling_tolerance()));
    }
  }
}

TEST_F(NormaliseKernel, KeepsItsPrecisionInHalfPrecision) {
  const glm::ivec3 size(17, 7, 9), cell(2);
  const double noise = 0.02;
  const NormaliseCase made = normalise_case(size, cell, Format::kR16);
  const Texels expected =
      texels_of(oracle::normalise(scalars_of(made.image), made.moments, cell, noise));
  const DeviceImage image = put(made.image, Format::kR16);
  const DeviceImage moments = put(made.moments, Format::kRgba32);
  const DeviceImage to = output(size, Format::kR16);
  dispatch(kernels()->normalise(), {nearest(image), linear(moments), to.image},
           shaders::NormalisePush{glm::ivec4(size, 0), glm::ivec4(made.moments.size, 0),
                                  glm::ivec4(cell, 0), glm::vec4(noise * noise, 1, 0, 0)},
           rows(size));
  expect_all(to, expected, 1, 4.0, std::max(kNormalised, sampling_tolerance()));
}

TEST_F(NormaliseKernel, KeepsIntensitiesWhenAskedTo) {
  const glm::ivec3 size(9, 7, 5), cell(2);
  const NormaliseCase made = normalise_case(size, cell, Format::kR16);
  const DeviceImage image = put(made.image, Format::kR16);
  const DeviceImage moments = put(made.moments, Format::kRgba32);
  const DeviceImage to = output(size, Format::kR16);
  dispatch(kernels()->normalise(), {nearest(image), linear(moments), to.image},
           shaders::NormalisePush{glm::ivec4(size, 0), glm::ivec4(made.moments.size, 0),
                                  glm::ivec4(cell, 0), glm::vec4(0.0F)},
           rows(size));
  EXPECT_EQ(get(to).values, made.image.values);
}

TEST_F(PackKernel, TakesCentralDifferencesInMillimetres) {
  const glm::dvec3 spacing_mm(0.7, 1.1, 2.5);
  for (const glm::ivec3 size : kSizes) {
    SCOPED_TRACE(text(size));
    const Scalars image = scalars_of(as_stored(random_texels(size, 51), Format::kR32));
    const DeviceImage from = put(texels_of(image), Format::kR32);
    const DeviceImage to = output(size, Format::kRgba32);
    dispatch(kernels()->pack(false), {nearest(from), nearest(from), to.image},
             shaders::PackPush{glm::ivec4(size, 0), glm::vec4(spacing_mm, 0)}, rows(size));
    expect_all(to, oracle::pack(image, spacing_mm, nullptr), 4, 2.0);
  }
}

TEST_F(PackKernel, MarksTheGradientOutsideTheMaskAndKeepsTheIntensity) {
  const glm::ivec3 size(17, 7, 9);
  const glm::dvec3 spacing_mm(1.0, 2.0, 0.5);
  const Scalars image = scalars_of(as_stored(random_texels(size, 52), Format::kR16));
  const Scalars inside = random_mask(size, 53, 0.8);
  const DeviceImage from = put(texels_of(image), Format::kR16);
  const DeviceImage mask = put(texels_of(inside), Format::kR8);
  const DeviceImage to = output(size, Format::kRgba16);
  dispatch(kernels()->pack(true), {nearest(from), nearest(mask), to.image},
           shaders::PackPush{glm::ivec4(size, 0), glm::vec4(spacing_mm, 0)}, rows(size));
  expect_all(to, oracle::pack(image, spacing_mm, &inside), 4, 2.0);
  const Texels actual = get(to);
  for (size_t i = 0; i < actual.values.size(); ++i) {
    EXPECT_EQ(oracle::inside_mask(actual.values[i]), inside.values[i] != 0.0);
    EXPECT_EQ(actual.values[i].w, image.values[i]);
  }
}

TEST_F(PackKernel, MarksTheOutermostVoxelsOfTheWholeImageAlsoInItsSlabs) {
  // The axis of 7 voxels keeps its outermost voxels.
  const glm::ivec3 size(17, 7, 20);
  const glm::dvec3 spacing_mm(1.0, 2.0, 0.5);
  const Scalars image = scalars_of(as_stored(random_texels(size, 55), Format::kR16));
  const Scalars inside = random_mask(size, 56, 0.8);
  const auto pack = [&](const Scalars& part, const Scalars& mask, bool masked, int first,
                        const DeviceImage& to) {
    const DeviceImage from = put(texels_of(part), Format::kR16);
    const DeviceImage mask_image = put(texels_of(mask), Format::kR8);
    dispatch(kernels()->pack(masked), {nearest(from), nearest(mask_image), to.image},
             shaders::PackPush{glm::ivec4(part.size, size.z), glm::vec4(spacing_mm, 0),
                               glm::ivec4(0, 0, 0, first)},
             rows(part.size));
  };
  for (const bool masked : {false, true}) {
    SCOPED_TRACE(masked ? "masked" : "not masked");
    const Texels expected = oracle::pack(image, spacing_mm, masked ? &inside : nullptr, false);
    const DeviceImage whole = output(size, Format::kRgba32);
    pack(image, inside, masked, 0, whole);
    expect_all(whole, expected, 4, 2.0);

    // Slices 5 to 15: their cuts are no border of the image.
    const int first = 5;
    Scalars part(glm::ivec3(17, 7, 11)), part_inside(part.size);
    const size_t offset = size_t(first * size.x * size.y);
    for (size_t n = 0; n < part.values.size(); ++n) {
      part.values[n] = image.values[offset + n];
      part_inside.values[n] = inside.values[offset + n];
    }
    const DeviceImage cut = output(part.size, Format::kRgba32);
    pack(part, part_inside, masked, first, cut);
    const Texels actual = get(cut);
    for (size_t n = 0; n < actual.values.size(); ++n) {
      EXPECT_EQ(oracle::inside_mask(actual.values[n]),
                oracle::inside_mask(expected.values[offset + n]));
    }
  }
}

TEST_F(PackKernel, HoldsAGradientThatHalfPrecisionCanNot) {
  const glm::ivec3 size(9, 3, 2);
  const glm::dvec3 spacing_mm(1e-6);  // a nanometre
  const Scalars image = scalars_of(as_stored(random_texels(size, 54), Format::kR16));
  const DeviceImage from = put(texels_of(image), Format::kR16);
  const DeviceImage to = output(size, Format::kRgba16);
  dispatch(kernels()->pack(false), {nearest(from), nearest(from), to.image},
           shaders::PackPush{glm::ivec4(size, 0), glm::vec4(spacing_mm, 0)}, rows(size));
  expect_all(to, oracle::pack(image, spacing_mm, nullptr), 4, shaders::kLargestGradient);
  for (const glm::dvec4& texel : get(to).values) EXPECT_TRUE(oracle::inside_mask(texel));
}

}  // namespace
}  // namespace palpate::test
