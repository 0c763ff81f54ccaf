#include "tests/motion/equation_images.h"
#include "tests/motion/kernel_test.h"

/// The step from the normal equations and the total variation filter, against their oracles.
namespace palpate::test {
namespace {

using oracle::Dual;
using oracle::Texels;
using oracle::Vectors;

class UpdateKernel : public KernelTest {
 protected:
  void make(glm::ivec3 cells, Format format, uint32_t seed) {
    images = images_of(random_equations(cells, seed));
    for (Texels& image : images) image = as_stored(image, format);
    field = vectors_of(as_stored(texels_of(random_vectors(cells, seed + 1, 5.0)), Format::kRgba32));
  }

  void expect_oracle(Format format, const BrickList& bricks) {
    const glm::dvec3 cell_mm(1.4, 2.2, 2.5);
    const double damping = 0.04, largest_mm = 1.0;
    const Vectors expected =
        oracle::update(equations_of(images), field, cell_mm, damping, largest_mm);
    const DeviceImage e[3] = {put(images[0], format), put(images[1], format),
                              put(images[2], format)};
    const DeviceImage v = put(texels_of(field), Format::kRgba32);
    const DeviceImage w = output(field.size, Format::kRgba32);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->update(),
             {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), linear(v), w.image},
             shaders::UpdatePush{glm::ivec4(field.size, 0), glm::vec4(cell_mm, 0),
                                 glm::vec4(damping, largest_mm, 0, 0)},
             slice_groups(bricks));
    expect_cells(w, texels_of(expected), bricks, 3, 6.0, kUpdate + sampling_tolerance());
  }

  EquationImages images;
  Vectors field;
};

TEST_F(UpdateKernel, SolvesForTheStepAndComposesItWithTheField) {
  uint32_t seed = 300;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make(cells, Format::kRgba32, seed += 2);
    expect_oracle(Format::kRgba32, all_bricks(cells));
  }
}

TEST_F(UpdateKernel, TakesEquationsInHalfPrecisionAndOnlyListedBricks) {
  make({17, 19, 9}, Format::kRgba16, 320);
  expect_oracle(Format::kRgba16, every_second_brick(field.size));
}

TEST_F(UpdateKernel, KeepsTheFieldWhereTheImagesSayNothing) {
  make({9, 7, 8}, Format::kRgba16, 330);
  for (Texels& image : images) image = Texels(field.size);
  expect_oracle(Format::kRgba16, all_bricks(field.size));
}

class UpdateTwoKernel : public KernelTest {
 protected:
  /// The part of r^2 that b explains is removed from the narrow window's equations, as in real
  /// data. What the coarser level left ranges from zero to more than `high`.
  void expect_oracle(glm::ivec3 cells, Format format, const BrickList& bricks, uint32_t seed,
                     bool is_chosen = false) {
    const auto stored = [&](const oracle::Samples<oracle::NormalEquations>& equations) {
      EquationImages images = images_of(equations);
      for (Texels& image : images) image = as_stored(image, format);
      return images;
    };
    oracle::Samples<oracle::NormalEquations> left = random_equations(cells, seed + 2);
    for (size_t i = 0; i < left.values.size(); ++i)
      left.values[i].residual = left.values[i].structure * 0.03 * double(i % 5);
    const EquationImages wide_images = stored(random_equations(cells, seed));
    const EquationImages narrow_images = stored(random_equations(cells, seed + 1));
    EquationImages coarser = stored(left);
    // Shares from 0 to 1; not read where none was chosen.
    oracle::Scalars chosen(cells);
    for (size_t i = 0; i < chosen.values.size(); ++i)
      coarser[2].values[i].x = chosen.values[i] = 0.25 * double(i % 7 % 5);
    // Determinants from below 0 to above 1.
    const Vectors field =
        vectors_of(as_stored(texels_of(random_vectors(cells, seed + 3, 0.4)), Format::kRgba32));
    const glm::dvec3 cell_mm(1.4, 2.2, 2.5);
    const oracle::TwoWindows with{{0.04, 0.09}, 1.0, 0.02, 0.06, 0.01, 0.1, 2.5, 30.0, 8.0};
    const oracle::TwoWindowsStep step = oracle::update_two(
        equations_of(wide_images), equations_of(narrow_images), equations_of(coarser), field,
        cell_mm, with, is_chosen ? &chosen : nullptr);
    std::vector<DeviceImage> in;
    for (const EquationImages* images : {&wide_images, &narrow_images})
      for (const Texels& image : *images) in.push_back(put(image, format));
    const DeviceImage v = put(texels_of(field), Format::kRgba32);
    const DeviceImage c = put(coarser[2], format);
    const DeviceImage w = output(cells, Format::kRgba32);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->update_two(),
             {list, nearest(in[0]), nearest(in[1]), nearest(in[2]), nearest(in[3]), nearest(in[4]),
              nearest(in[5]), linear(v), nearest(c), w.image, nearest(v)},
             shaders::UpdateTwoPush{
                 glm::ivec4(cells, 0),
                 glm::vec4(cell_mm, 0),
                 {with.damping_per_mm2[0], with.damping_per_mm2[1], with.largest_mm, 0},
                 {with.low, with.high, with.noise, with.flat},
                 {with.weight, with.evidence, with.voxels, is_chosen ? 1.0 : 0.0}},
             slice_groups(bricks));
    Texels expected = texels_of(step.w);
    for (size_t i = 0; i < expected.values.size(); ++i) expected.values[i].w = step.more.values[i];
    expect_cells(w, expected, bricks, 4, 6.0, 2.0 * kUpdate + sampling_tolerance());
  }
};

TEST_F(UpdateTwoKernel, AddsTheNarrowWindowsStepWhereTheCoarserLevelLeftSomething) {
  uint32_t seed = 340;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    expect_oracle(cells, Format::kRgba32, all_bricks(cells), seed += 4);
  }
}

TEST_F(UpdateTwoKernel, AddsItAlsoByTheShareThatWasChosen) {
  uint32_t seed = 360;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    expect_oracle(cells, Format::kRgba32, all_bricks(cells), seed += 4, true);
  }
}

TEST_F(UpdateTwoKernel, TakesEquationsInHalfPrecisionAndOnlyListedBricks) {
  expect_oracle({17, 19, 9}, Format::kRgba16, every_second_brick({17, 19, 9}), 380);
}

/// Fits without a part of the cells, and what they predict of it.
class LeftOutKernels : public KernelTest {
 protected:
  void make(glm::ivec3 cells, uint32_t seed) {
    images = images_of(random_equations(cells, seed));
    for (Texels& image : images) image = as_stored(image, Format::kRgba16);
    u = stored_vectors(cells, seed + 1, 1.0);
    start = stored_vectors(cells, seed + 2, 1.0);
  }
  std::vector<DeviceImage> put_equations() {
    std::vector<DeviceImage> e;
    for (const Texels& image : images) e.push_back(put(image, Format::kRgba16));
    return e;
  }

  EquationImages images;
  Vectors u, start;
};

TEST_F(LeftOutKernels, LeaveBlocksOutInTurns) {
  uint32_t seed = 420;
  for (const glm::ivec3 cells : kSizes)
    for (const int part : {-1, 0, 1}) {
      SCOPED_TRACE(text(cells) + " without part " + std::to_string(part));
      make(cells, seed += 3);
      const EquationImages expected = images_of(oracle::leave_out(equations_of(images), part));
      const std::vector<DeviceImage> e = put_equations();
      std::vector<DeviceImage> left;
      for (int k = 0; k < 3; ++k) left.push_back(output(cells, Format::kRgba16));
      const BrickList bricks = all_bricks(cells);
      const vulkan::Buffer list = upload_bricks(context(), bricks);
      dispatch(kernels()->leave_out(),
               {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), left[0].image, left[1].image,
                left[2].image},
               shaders::LeaveOutPush{glm::ivec4(cells, part)}, slice_groups(bricks));
      for (size_t k = 0; k < 3; ++k) expect_all(left[k], expected[k], 4, 1.0);
    }
}

TEST_F(LeftOutKernels, SayHowManyVoxelsShareTheirNoise) {
  uint32_t seed = 440;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make(cells, seed += 3);
    constexpr double kVoxels = 64.0;
    const auto equations = equations_of(images);
    Texels expected(cells);
    for (size_t i = 0; i < expected.values.size(); ++i)
      expected.values[i] = oracle::shared_noise(equations.values[i], kVoxels);
    const std::vector<DeviceImage> e = put_equations();
    const DeviceImage noise = output(cells, Format::kRgba32);
    const BrickList bricks = every_second_brick(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->shared_noise(),
             {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), noise.image},
             shaders::SharedNoisePush{glm::ivec4(cells, 0), glm::vec4(kVoxels, 0, 0, 0)},
             slice_groups(bricks));
    expect_cells(noise, expected, bricks, 4, 100.0, kUpdate);
  }
}

TEST_F(LeftOutKernels, FitOnFromTheEquationsOfOneField) {
  uint32_t seed = 460;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make(cells, seed += 3);
    const double damping = 0.04, largest_mm = 1.0;
    const Vectors expected = oracle::refit(equations_of(images), u, start, damping, largest_mm);
    const std::vector<DeviceImage> e = put_equations();
    const DeviceImage v = put(texels_of(u), Format::kRgba32);
    const DeviceImage u0 = put(texels_of(start), Format::kRgba32);
    const DeviceImage w = output(cells, Format::kRgba32);
    const BrickList bricks = every_second_brick(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->refit(),
             {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), nearest(v), nearest(u0), w.image},
             shaders::UpdatePush{glm::ivec4(cells, 0), glm::vec4(0),
                                 glm::vec4(damping, largest_mm, 0, 0)},
             slice_groups(bricks));
    expect_cells(w, texels_of(expected), bricks, 4, 6.0, kUpdate);
  }
}

TEST_F(LeftOutKernels, AddUpTheErrorOfThePartAndChooseByIt) {
  uint32_t seed = 480;
  for (const glm::ivec3 cells : kSizes)
    for (const int part : {0, 1}) {
      SCOPED_TRACE(text(cells) + " part " + std::to_string(part));
      make(cells, seed += 3);
      const double factor = part == 0 ? 1.0 : -1.0;
      const auto equations = equations_of(images);
      const oracle::Scalars error = oracle::left_out_error(equations, u, start, part);
      Texels before(cells), expected(cells);
      for (size_t i = 0; i < error.values.size(); ++i) {
        before.values[i].x = 0.5 * double(i % 3);
        expected.values[i].x = before.values[i].x + factor * error.values[i];
        expected.values[i].y = equations.values[i].structure;
      }
      const std::vector<DeviceImage> e = put_equations();
      const DeviceImage field = put(texels_of(u), Format::kRgba32);
      const DeviceImage u0 = put(texels_of(start), Format::kRgba32);
      const DeviceImage sum = put(before, Format::kRgba32);
      const DeviceImage after = output(cells, Format::kRgba32);
      const BrickList bricks = all_bricks(cells);
      const vulkan::Buffer list = upload_bricks(context(), bricks);
      dispatch(kernels()->left_out_error(),
               {list, nearest(e[0]), nearest(e[1]), nearest(e[2]), nearest(field), nearest(u0),
                nearest(sum), after.image},
               shaders::LeftOutErrorPush{glm::ivec4(cells, part), glm::vec4(factor, 0, 0, 0)},
               slice_groups(bricks));
      expect_all(after, expected, 4, 10.0, kUpdate);

      // Gains of both signs, about the limits.
      const double low = 0.5, high = 3.0;
      Texels shares = get(after), coarser = images[2];
      const DeviceImage left = put(coarser, Format::kRgba16);
      const DeviceImage with_share = output(cells, Format::kRgba16);
      dispatch(kernels()->window_share(), {list, nearest(after), nearest(left), with_share.image},
               shaders::WindowSharePush{glm::ivec4(cells, 0), glm::vec4(low, high, 0, 0)},
               slice_groups(bricks));
      for (size_t i = 0; i < shares.values.size(); ++i)
        coarser.values[i].x =
            oracle::window_share(shares.values[i].x, shares.values[i].y, low, high);
      expect_all(with_share, coarser, 4, 1.0, kUpdate);
    }
}

class TotalVariationKernel : public KernelTest {
 protected:
  /// A field with differences around the Huber threshold, and a dual of which some cells are on the
  /// ball; zero on the last cells, as after the dual step.
  void make(glm::ivec3 cells, Format format, uint32_t seed) {
    u = vectors_of(as_stored(texels_of(random_vectors(cells, seed, 1.0)), Format::kRgba32));
    before =
        vectors_of(as_stored(texels_of(random_vectors(cells, seed + 1, 1.0)), Format::kRgba32));
    for (int axis = 0; axis < 3; ++axis) {
      Vectors p = random_vectors(cells, seed + 2 + uint32_t(axis), 0.2);
      oracle::for_each(cells, [&](glm::ivec3 i) {
        if (i[axis] + 1 == cells[axis]) p.at(i) = glm::dvec3(0.0);
      });
      dual[size_t(axis)] = vectors_of(as_stored(texels_of(p), format));
    }
    // Weights from zero to two and a half.
    more = oracle::Scalars(cells);
    for (size_t i = 0; i < more.values.size(); ++i) more.values[i] = 0.25 * double(i % 11) - 1.0;
  }

  shaders::TotalVariationPush push() const {
    return {glm::ivec4(u.size, 0), glm::vec4(slope, 0), glm::vec4(c_mm, step, huber_mm, momentum)};
  }

  void expect_primal(Format format, const BrickList& bricks, bool last) {
    const Vectors expected = oracle::tv_primal(u, dual, slope);
    Texels weighted = texels_of(u);
    for (size_t i = 0; i < weighted.values.size(); ++i) weighted.values[i].w = more.values[i];
    const DeviceImage w = put(weighted, Format::kRgba32);
    const DeviceImage p[3] = {put(texels_of(dual[0]), format), put(texels_of(dual[1]), format),
                              put(texels_of(dual[2]), format)};
    const DeviceImage old = put(texels_of(before), Format::kRgba32);
    const DeviceImage now = output(u.size, Format::kRgba32);
    const DeviceImage then = output(u.size, Format::kRgba32);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->tv_primal(last),
             {list, nearest(w), nearest(p[0]), nearest(p[1]), nearest(p[2]), nearest(old),
              now.image, then.image},
             push(), slice_groups(bricks));
    // The weight is passed to the dual step; the last iteration writes no weight.
    Texels with_weight = texels_of(expected);
    for (size_t i = 0; i < with_weight.values.size(); ++i)
      with_weight.values[i].w = last ? 0.0 : more.values[i];
    expect_cells(now, with_weight, bricks, 4, 2.0, kSingle);
    const Vectors momentum_ahead = oracle::ahead(expected, before, momentum);
    expect_cells(then, texels_of(momentum_ahead), last ? bricks : BrickList{}, 3, 3.0, kSingle);
  }

  void expect_dual(Format format, const BrickList& bricks) {
    const Dual expected = oracle::tv_dual(u, dual, slope, c_mm, step, huber_mm, &more);
    Texels weighted = texels_of(u);
    for (size_t i = 0; i < weighted.values.size(); ++i) weighted.values[i].w = more.values[i];
    const DeviceImage field = put(weighted, Format::kRgba32);
    const DeviceImage p[3] = {put(texels_of(dual[0]), format), put(texels_of(dual[1]), format),
                              put(texels_of(dual[2]), format)};
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage q[3] = {output(u.size, format), output(u.size, format),
                              output(u.size, format)};
    dispatch(kernels()->tv_dual(),
             {list, nearest(field), nearest(p[0]), nearest(p[1]), nearest(p[2]), q[0].image,
              q[1].image, q[2].image},
             push(), slice_groups(bricks));
    for (size_t a = 0; a < 3; ++a)
      expect_cells(q[a], texels_of(expected[a]), bricks, 3, 1.0, kSingle);
  }

  const glm::dvec3 slope{1.0, 0.8, 0.5};
  const double c_mm = 0.3, step = 0.13, huber_mm = 0.05, momentum = 0.5;
  Vectors u, before;
  Dual dual;
  oracle::Scalars more;
};

TEST_F(TotalVariationKernel, PrimalStepAddsTheDivergenceOfTheDual) {
  uint32_t seed = 400;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make(cells, Format::kRgba32, seed += 5);
    expect_primal(Format::kRgba32, all_bricks(cells), false);
  }
}

TEST_F(TotalVariationKernel, LastPrimalStepGivesTheMomentumAheadToo) {
  make({17, 9, 7}, Format::kRgba16, 430);
  expect_primal(Format::kRgba16, all_bricks(u.size), true);
  make({17, 19, 9}, Format::kRgba16, 440);
  expect_primal(Format::kRgba16, every_second_brick(u.size), true);
}

TEST_F(TotalVariationKernel, LastPrimalStepMayWriteTheFieldThatItReads) {
  make({17, 9, 7}, Format::kRgba16, 450);
  const Vectors expected = oracle::tv_primal(u, dual, slope);
  const DeviceImage w = put(texels_of(u), Format::kRgba32);
  const DeviceImage p[3] = {put(texels_of(dual[0]), Format::kRgba16),
                            put(texels_of(dual[1]), Format::kRgba16),
                            put(texels_of(dual[2]), Format::kRgba16)};
  const DeviceImage field = put(texels_of(before), Format::kRgba32);
  const DeviceImage then = output(u.size, Format::kRgba32);
  const BrickList bricks = all_bricks(u.size);
  const vulkan::Buffer list = upload_bricks(context(), bricks);
  dispatch(kernels()->tv_primal(true),
           {list, nearest(w), nearest(p[0]), nearest(p[1]), nearest(p[2]), nearest(field),
            field.image, then.image},
           push(), slice_groups(bricks));
  expect_all(field, texels_of(expected), 3, 2.0);
  expect_all(then, texels_of(oracle::ahead(expected, before, momentum)), 3, 3.0);
}

TEST_F(TotalVariationKernel, DualStepClimbsAndIsProjectedOntoTheBall) {
  uint32_t seed = 500;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make(cells, Format::kRgba32, seed += 5);
    expect_dual(Format::kRgba32, all_bricks(cells));
  }
}

TEST_F(TotalVariationKernel, DualStepInHalfPrecisionLeavesUnlistedBricksAlone) {
  make({17, 19, 9}, Format::kRgba16, 540);
  expect_dual(Format::kRgba16, every_second_brick(u.size));
}

TEST_F(TotalVariationKernel, DualStepMayWriteTheDualThatItReads) {
  make({9, 17, 7}, Format::kRgba16, 550);
  const Dual expected = oracle::tv_dual(u, dual, slope, c_mm, step, huber_mm);
  const DeviceImage field = put(texels_of(u), Format::kRgba32);
  const DeviceImage p[3] = {put(texels_of(dual[0]), Format::kRgba16),
                            put(texels_of(dual[1]), Format::kRgba16),
                            put(texels_of(dual[2]), Format::kRgba16)};
  const BrickList bricks = all_bricks(u.size);
  const vulkan::Buffer list = upload_bricks(context(), bricks);
  dispatch(kernels()->tv_dual(),
           {list, nearest(field), nearest(p[0]), nearest(p[1]), nearest(p[2]), p[0].image,
            p[1].image, p[2].image},
           push(), slice_groups(bricks));
  for (size_t a = 0; a < 3; ++a) expect_all(p[a], texels_of(expected[a]), 3, 1.0);
}

class SecondTotalVariationKernel : public TotalVariationKernel {
 protected:
  /// As make(), with a dual of second differences; zero where there is no difference.
  void make_second(glm::ivec3 cells, Format format, uint32_t seed) {
    make(cells, format, seed);
    oracle::SecondDual none;
    for (Vectors& one : none) one = Vectors(cells);
    // A step from zero leaves zero where there is no difference; elsewhere a random dual follows.
    const oracle::SecondDual there =
        oracle::tv_second_dual(random_vectors(cells, seed + 11, 1.0), none, slope, 1.0, 1.0, 0.0);
    for (size_t d = 0; d < second.size(); ++d) {
      Vectors q = random_vectors(cells, seed + 12 + uint32_t(d), 0.2);
      oracle::for_each(cells, [&](glm::ivec3 i) {
        if (there[d].at(i) == glm::dvec3(0.0)) q.at(i) = glm::dvec3(0.0);
      });
      second[d] = vectors_of(as_stored(texels_of(q), format));
    }
  }
  DeviceImage put_weighted() {
    Texels weighted = texels_of(u);
    for (size_t i = 0; i < weighted.values.size(); ++i) weighted.values[i].w = more.values[i];
    return put(weighted, Format::kRgba32);
  }
  std::vector<DeviceImage> put_second(Format format) {
    std::vector<DeviceImage> images;
    for (const Vectors& q : second) images.push_back(put(texels_of(q), format));
    return images;
  }
  /// The dual step reads `from` and writes `to`.
  void step_dual(const DeviceImage& field, const std::vector<DeviceImage>& from,
                 const std::vector<DeviceImage>& to, const BrickList& bricks) {
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->tv_second_dual(),
             {list, nearest(field), nearest(from[0]), nearest(from[1]), nearest(from[2]),
              nearest(from[3]), nearest(from[4]), nearest(from[5]), to[0].image, to[1].image,
              to[2].image, to[3].image, to[4].image, to[5].image},
             push(), slice_groups(bricks));
  }
  void expect_dual_step(Format format, const BrickList& bricks) {
    const oracle::SecondDual expected =
        oracle::tv_second_dual(u, second, slope, c_mm, step, huber_mm, &more);
    std::vector<DeviceImage> to;
    for (size_t d = 0; d < second.size(); ++d) to.push_back(output(u.size, format));
    step_dual(put_weighted(), put_second(format), to, bricks);
    for (size_t d = 0; d < second.size(); ++d)
      expect_cells(to[d], texels_of(expected[d]), bricks, 3, 2.0, kSingle);
  }
  /// The primal step may write what it reads.
  void expect_primal_step(Format format, const BrickList& bricks, bool in_place) {
    Texels expected = texels_of(oracle::tv_second_primal(u, second, slope));
    for (size_t i = 0; i < expected.values.size(); ++i) expected.values[i].w = more.values[i];
    const DeviceImage w = put_weighted();
    const DeviceImage other = output(u.size, Format::kRgba32);
    const DeviceImage& to = in_place ? w : other;
    const std::vector<DeviceImage> q = put_second(format);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(kernels()->tv_second_primal(),
             {list, nearest(w), nearest(q[0]), nearest(q[1]), nearest(q[2]), nearest(q[3]),
              nearest(q[4]), nearest(q[5]), to.image},
             push(), slice_groups(bricks));
    expect_cells(to, expected, bricks, 4, 4.0, kSingle);
  }

  oracle::SecondDual second;
};

TEST_F(SecondTotalVariationKernel, PrimalStepTakesThePartOfTheDualOut) {
  uint32_t seed = 600;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make_second(cells, Format::kRgba32, seed += 20);
    expect_primal_step(Format::kRgba32, all_bricks(cells), false);
    expect_primal_step(Format::kRgba32, all_bricks(cells), true);
  }
  make_second({17, 19, 9}, Format::kRgba16, 780);
  expect_primal_step(Format::kRgba16, every_second_brick(u.size), false);
}

TEST_F(SecondTotalVariationKernel, DualStepClimbsAndIsProjectedOntoTheBall) {
  uint32_t seed = 800;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    make_second(cells, Format::kRgba32, seed += 20);
    expect_dual_step(Format::kRgba32, all_bricks(cells));
  }
  make_second({17, 19, 9}, Format::kRgba16, 980);
  expect_dual_step(Format::kRgba16, every_second_brick(u.size));
}

TEST_F(SecondTotalVariationKernel, DualStepMayWriteTheDualThatItReads) {
  make_second({9, 17, 7}, Format::kRgba16, 1000);
  const oracle::SecondDual expected =
      oracle::tv_second_dual(u, second, slope, c_mm, step, huber_mm, &more);
  const std::vector<DeviceImage> q = put_second(Format::kRgba16);
  step_dual(put_weighted(), q, q, all_bricks(u.size));
  for (size_t d = 0; d < second.size(); ++d) expect_all(q[d], texels_of(expected[d]), 3, 2.0);
}

// A linear field has no second differences: the dual stays zero, however small the ball is.
TEST_F(SecondTotalVariationKernel, LeavesALinearFieldAlone) {
  make_second({17, 9, 10}, Format::kRgba32, 1020);
  oracle::for_each(u.size, [&](glm::ivec3 i) {
    u.at(i) = glm::dvec3(i) * 0.25 + glm::dvec3(i.y, i.z, i.x) * 0.5 - 1.0;
  });
  std::vector<DeviceImage> q;
  for (size_t d = 0; d < second.size(); ++d) q.push_back(put(Texels(u.size), Format::kRgba32));
  step_dual(put_weighted(), q, q, all_bricks(u.size));
  for (const DeviceImage& one : q) expect_all(one, Texels(u.size), 3, 1.0);
}

// The steps of both duals are bounded by the largest eigenvalue of D D^T (solver.cpp): found here
// by the power method on cells of different edges.
TEST(SecondTotalVariation, LargestEigenvalueIsThatOfTheDualStep) {
  const glm::dvec3 slope(1.0, 0.7, 0.4);
  const double bound = 16.0 * std::pow(glm::dot(slope, slope), 2);
  Vectors u = random_vectors({24, 24, 24}, 1100, 1.0);
  double eigenvalue = 0.0;
  for (int k = 0; k < 60; ++k) {
    oracle::SecondDual none;
    for (Vectors& one : none) one = Vectors(u.size);
    // D2 u, without ball and threshold, and D2^T of it.
    const oracle::SecondDual d = oracle::tv_second_dual(u, none, slope, 1e300, 1.0, 0.0);
    const Vectors back = oracle::tv_second_primal(Vectors(u.size), d, slope);
    double squares = 0.0, product = 0.0, length = 0.0;
    for (size_t i = 0; i < u.values.size(); ++i) {
      squares += glm::dot(u.values[i], u.values[i]);
      product -= glm::dot(u.values[i], back.values[i]);
      length += glm::dot(back.values[i], back.values[i]);
    }
    eigenvalue = product / squares;
    for (size_t i = 0; i < u.values.size(); ++i) u.values[i] = -back.values[i] / std::sqrt(length);
  }
  EXPECT_LE(eigenvalue, bound);
  EXPECT_GT(eigenvalue, 0.85 * bound);
}

}  // namespace
}  // namespace palpate::test
