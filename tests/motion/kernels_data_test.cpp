#include "tests/motion/equation_images.h"
#include "tests/motion/kernel_test.h"

/// The data term (normal_equations.comp) against its oracle, whole and in slabs.
namespace palpate::test {
namespace {

using oracle::NormalEquations;
using oracle::Samples;
using oracle::Texels;
using oracle::Vectors;

constexpr int kFar = 1 << 20;
const glm::dvec3 kSpacingMm(0.7, 1.1, 2.5);

/// Slices [begin, end) of an image.
Texels slices(const Texels& whole, int begin, int end) {
  Texels part(glm::ivec3(whole.size.x, whole.size.y, end - begin));
  oracle::for_each(part.size,
                   [&](glm::ivec3 i) { part.at(i) = whole.at(i + glm::ivec3(0, 0, begin)); });
  return part;
}

/// Marks a tenth of the voxels as outside the mask, but none at the border. A place outside the
/// image is clamped to the border sample, and whether a device then also touches its neighbour with
/// weight 0 depends on the device.
void punch_holes(Texels& image, uint32_t seed) {
  const oracle::Scalars mask = random_mask(image.size, seed, 0.9);
  oracle::for_each(image.size - 4, [&](glm::ivec3 inner) {
    const glm::ivec3 i = inner + 2;
    if (mask.at(i) == 0.0) image.at(i) = glm::dvec4(glm::dvec3(oracle::kOutside), image.at(i).w);
  });
}

class NormalEquationsKernel : public KernelTest {
 protected:
  /// A pair of packed images and a field that moves voxels by up to 3 voxels, some of them out of
  /// the moving image.
  void make(glm::ivec3 image_size, glm::ivec3 voxels_per_cell, Format format, uint32_t seed) {
    size = image_size;
    cell = voxels_per_cell;
    fixed = as_stored(random_texels(size, seed), format);
    moving = as_stored(random_texels(size, seed + 1), format);
    Vectors u = random_vectors(oracle::cells_of(size, cell), seed + 2, 3.0);
    for (glm::dvec3& vector : u.values) vector *= kSpacingMm;
    field = vectors_of(as_stored(texels_of(u), Format::kRgba32));
  }

  shaders::NormalEquationsPush whole() const {
    return {glm::ivec4(field.size, -1),
            glm::ivec4(size, 0),
            glm::ivec4(size, 0),
            glm::ivec4(size.z, -kFar, kFar, 0),
            glm::ivec4(size.z, 0, size.z, 0),
            glm::vec4(kSpacingMm, 0)};
  }

  void open_outputs(Format format) {
    for (DeviceImage& out : equations) out = output(field.size, format);
  }

  void run(const Texels& fixed_part, const Texels& moving_part, Format format,
           const shaders::NormalEquationsPush& push, const BrickList& bricks) {
    const DeviceImage f = put(fixed_part, format);
    const DeviceImage m = put(moving_part, format);
    const DeviceImage u = put(texels_of(field), Format::kRgba32);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    dispatch(
        kernels()->normal_equations(cell),
        {list, nearest(f), linear(m), nearest(u), equations[0].image, equations[1].image,
         equations[2].image, nearest(equations[0]), nearest(equations[1]), nearest(equations[2])},
        push, slice_groups(bricks));
  }

  void expect_oracle(const BrickList& bricks, int colour = -1) {
    const EquationImages expected =
        images_of(oracle::normal_equations(fixed, moving, field, cell, kSpacingMm, colour));
    // Products of two numbers; the larger one, r, is at most 2.
    for (size_t k = 0; k < 3; ++k)
      expect_cells(equations[k], expected[k], bricks, 4, 4.0, 2.0 * sampling_tolerance());
  }

  glm::ivec3 size{1}, cell{1};
  Texels fixed, moving;
  Vectors field;
  std::array<DeviceImage, 3> equations;
};

TEST_F(NormalEquationsKernel, AreTheMeansOverACellsVoxelsAtAnySizeAndCell) {
  const std::array<glm::ivec3, 6> cells = {glm::ivec3(1),       glm::ivec3(2),
                                           glm::ivec3(4),       glm::ivec3(4, 2, 1),
                                           glm::ivec3(1, 4, 2), glm::ivec3(2, 1, 4)};
  uint32_t seed = 100;
  for (const glm::ivec3 image_size : kSizes) {
    for (const glm::ivec3 voxels_per_cell : cells) {
      SCOPED_TRACE(text(image_size) + " in cells of " + text(voxels_per_cell));
      make(image_size, voxels_per_cell, Format::kRgba32, seed += 3);
      open_outputs(Format::kRgba32);
      const BrickList bricks = all_bricks(field.size);
      run(fixed, moving, Format::kRgba32, whole(), bricks);
      expect_oracle(bricks);
    }
  }
}

TEST_F(NormalEquationsKernel, ReadOneColourOfTheCheckerboardForTwiceTheWeight) {
  for (const glm::ivec3 voxels_per_cell : {glm::ivec3(4), glm::ivec3(2), glm::ivec3(1, 4, 2)}) {
    for (const int colour : {0, 1}) {
      SCOPED_TRACE(text(voxels_per_cell) + " colour " + std::to_string(colour));
      make({17, 9, 7}, voxels_per_cell, Format::kRgba32, 150);
      open_outputs(Format::kRgba32);
      const BrickList bricks = all_bricks(field.size);
      shaders::NormalEquationsPush push = whole();
      push.cells.w = colour;
      run(fixed, moving, Format::kRgba32, push, bricks);
      expect_oracle(bricks, colour);
    }
  }
}

TEST_F(NormalEquationsKernel, InHalfPrecisionLeaveUnlistedBricksAlone) {
  make({35, 33, 9}, {2, 2, 1}, Format::kRgba16, 200);
  open_outputs(Format::kRgba16);
  const BrickList bricks = every_second_brick(field.size);
  run(fixed, moving, Format::kRgba16, whole(), bricks);
  expect_oracle(bricks);
}

TEST_F(NormalEquationsKernel, CountVoxelsInTheMaskWhereverTheirPartnersLie) {
  // The second shift gives the next voxel a weight of a 64th, four steps of a texture unit, and the
  // voxel across the corner a 262,144th. Both are enough for the mark outside the mask.
  for (const glm::dvec3 shift : {glm::dvec3(1.25, -0.375, 0.5), glm::dvec3(1.0 / 64.0)}) {
    for (const glm::ivec3 voxels_per_cell : {glm::ivec3(1), glm::ivec3(2), glm::ivec3(4, 2, 1)}) {
      SCOPED_TRACE(text(voxels_per_cell) + " shifted by " + text(shift));
      make({17, 9, 7}, voxels_per_cell, Format::kRgba16, 210);
      punch_holes(fixed, 213);
      punch_holes(moving, 214);
      for (glm::dvec3& u : field.values) u = kSpacingMm * shift;
      field = vectors_of(as_stored(texels_of(field), Format::kRgba32));
      open_outputs(Format::kRgba32);
      const BrickList bricks = all_bricks(field.size);
      run(fixed, moving, Format::kRgba16, whole(), bricks);
      expect_oracle(bricks);
    }
  }
}

TEST_F(NormalEquationsKernel, LeaveOutPartnersMoreThanHalfAVoxelOutside) {
  make({9, 7, 5}, {1, 1, 1}, Format::kRgba32, 220);
  for (const double shift : {0.4375, 0.5625, -0.4375, -0.5625}) {
    SCOPED_TRACE(shift);
    for (glm::dvec3& u : field.values) u = shift * kSpacingMm;
    field = vectors_of(as_stored(texels_of(field), Format::kRgba32));
    open_outputs(Format::kRgba32);
    const BrickList bricks = all_bricks(field.size);
    run(fixed, moving, Format::kRgba32, whole(), bricks);
    expect_oracle(bricks);
    const Texels share = get(equations[2]);
    double counted = 0.0;
    for (const glm::dvec4& texel : share.values) counted += texel.z;
    EXPECT_EQ(counted, std::abs(shift) < 0.5 ? 9 * 7 * 5 : 8 * 6 * 4);
  }
}

TEST_F(NormalEquationsKernel, AreTheSameWithTheMovingImageInTwoSlabs) {
  for (const int cut : {1, 4, 8}) {
    SCOPED_TRACE(cut);
    make({9, 11, 9}, {2, 2, 2}, Format::kRgba32, 230);
    open_outputs(Format::kRgba32);
    const BrickList bricks = all_bricks(field.size);
    // A sample at z reads slices floor(z) and floor(z) + 1, so the lower slab contains one slice
    // more than it computes.
    const int held = std::min(cut + 1, size.z);
    shaders::NormalEquationsPush lower = whole();
    lower.moving_slab = {held, -kFar, cut, 0};
    run(fixed, slices(moving, 0, held), Format::kRgba32, lower, bricks);
    shaders::NormalEquationsPush upper = whole();
    upper.moving_size.w = cut;
    upper.moving_slab = {size.z - cut, cut, kFar, 1};
    run(fixed, slices(moving, cut, size.z), Format::kRgba32, upper, bricks);
    expect_oracle(bricks);
  }
}

TEST_F(NormalEquationsKernel, AreTheSameWithBothImagesInSlabs) {
  make({9, 7, 13}, {2, 1, 4}, Format::kRgba32, 240);
  open_outputs(Format::kRgba32);
  const BrickList bricks = all_bricks(field.size);
  // The fixed image is cut inside a cell, the moving one elsewhere: four pairs of slabs. The first
  // one writes, the others add.
  const std::array<int, 3> fixed_cuts = {0, 6, size.z};
  const std::array<int, 3> moving_cuts = {0, 5, size.z};
  int first = 1;
  for (size_t f = 0; f < 2; ++f) {
    for (size_t m = 0; m < 2; ++m) {
      const int held = std::min(moving_cuts[m + 1] + 1, size.z) - moving_cuts[m];
      shaders::NormalEquationsPush push = whole();
      push.fixed_size.w = fixed_cuts[f];
      push.fixed_slab = {fixed_cuts[f + 1] - fixed_cuts[f], fixed_cuts[f], fixed_cuts[f + 1], 0};
      push.moving_size.w = moving_cuts[m];
      push.moving_slab = {held, m == 0 ? -kFar : moving_cuts[m], m == 1 ? kFar : moving_cuts[m + 1],
                          1 - first};
      first = 0;
      run(slices(fixed, fixed_cuts[f], fixed_cuts[f + 1]),
          slices(moving, moving_cuts[m], moving_cuts[m] + held), Format::kRgba32, push, bricks);
    }
  }
  expect_oracle(bricks);
}

}  // namespace
}  // namespace palpate::test
