// ITK is the oracle: a field written by palpate must change an image as palpate's own arithmetic
// does.
#include <gtest/gtest.h>

#include <cmath>

#include "integration/files/raster/write_field.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

Grid moving_grid() {
  Grid grid = oblique_grid();
  grid.size = {24, 20, 16};
  return grid;
}

/// Smooth, so that a coarse field and a fine one are both far from zero and differ along all axes.
Volume smooth_volume(const Grid& grid) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        volume.values[grid.offset(i, j, k)] =
            float(100.0 * std::sin(0.5 * i) + 70.0 * std::cos(0.4 * j) + 9.0 * k);
      }
    }
  }
  return volume;
}

bool is_inside(const Grid& grid, glm::dvec3 index) {
  // A little inside, so that rounding does not decide on which side of the border a point is.
  return glm::all(glm::greaterThan(index, glm::dvec3(1e-3))) &&
         glm::all(glm::lessThan(index, glm::dvec3(grid.size - 1) - 1e-3));
}

/// File name, samples per cell of a coarse field, whether the image's file has mirrored axes.
class FieldWriter : public ::testing::TestWithParam<std::tuple<const char*, int, bool>> {};

TEST_P(FieldWriter, MakesItksTransformWarpAsOurOwnInterpolationDoes) {
  const auto& [name, cell, mirrored] = GetParam();
  const TemporaryFolder folder;
  Volume moving = smooth_volume(moving_grid());
  moving.grid.j_reversed_in_file = mirrored;
  const Field field = known_field(coarsened(moving.grid, glm::ivec3(cell)));
  const auto path = folder / name;
  const Status written = write_field(field, path);
  ASSERT_TRUE(written) << written.error().message;

  const std::vector<float> by_itk = itk_oracle::warp(moving, path);
  EXPECT_EQ(glm::determinant(itk_oracle::read(path).grid.direction) < 0.0, mirrored);
  size_t compared = 0;
  double largest_change = 0.0;
  for (int k = 0; k < moving.grid.size.z; ++k) {
    for (int j = 0; j < moving.grid.size.y; ++j) {
      for (int i = 0; i < moving.grid.size.x; ++i) {
        const glm::dvec3 x = moving.grid.lps_from_index(glm::dvec3(i, j, k));
        if (!is_inside(field.grid, field.grid.index_from_lps(x))) continue;
        const glm::dvec3 there = moving.grid.index_from_lps(x + sample_at_lps(field, x));
        if (!is_inside(moving.grid, there)) continue;
        // Both interpolate linearly: values of up to 300 from floats and, for NIfTI, geometry in
        // single precision.
        EXPECT_NEAR(by_itk[moving.grid.offset(i, j, k)], sample(moving, there), 0.02)
            << i << ' ' << j << ' ' << k;
        largest_change =
            std::max(largest_change, std::abs(double(moving.at(i, j, k)) - sample(moving, there)));
        ++compared;
      }
    }
  }
  // Else a field of zeros would pass too.
  EXPECT_GT(compared, 100u);
  EXPECT_GT(largest_change, 10.0);
}

TEST_P(FieldWriter, ComesBackThroughOurOwnReaderUnchanged) {
  const auto& [name, cell, mirrored] = GetParam();
  const TemporaryFolder folder;
  Grid image = oblique_grid();
  image.j_reversed_in_file = mirrored;
  const Field field = known_field(coarsened(image, glm::ivec3(cell)));
  ASSERT_TRUE(write_field(field, folder / name));
  const auto found = read_field(folder / name);
  ASSERT_TRUE(found) << found.error().message;
  const bool nifti = std::string(name).find(".nii") != std::string::npos;
  expect_grid(found->grid, field.grid, nifti ? kNiftiToleranceMm : kTextToleranceMm);
  EXPECT_EQ(found->u_mm, field.u_mm);
}

INSTANTIATE_TEST_SUITE_P(AllFormats, FieldWriter,
                         ::testing::Combine(::testing::Values("u.mha", "u.nrrd", "u.nii",
                                                              "u.nii.gz"),
                                            ::testing::Values(1, 2), ::testing::Bool()));

TEST(FieldReader, TurnsNiftiDisplacementVectorsFromRas) {
  // In the NIfTI standard displacement vectors (intent 1006) are along R, A, S.
  const TemporaryFolder folder;
  const Field field = known_field(oblique_grid());
  ASSERT_TRUE(write_field(field, folder / "u.nii"));
  std::string bytes = read_bytes(folder / "u.nii");
  ASSERT_EQ(bytes.substr(68, 2), std::string("\xef\x03", 2));
  bytes[68] = char(0xee);
  write_bytes(folder / "ras.nii", bytes);
  const auto found = read_field(folder / "ras.nii");
  ASSERT_TRUE(found) << found.error().message;
  for (size_t v = 0; v < field.u_mm.size(); ++v) {
    EXPECT_EQ(found->u_mm[v], glm::vec3(-1, -1, 1) * field.u_mm[v]) << v;
  }
}

TEST(FieldReader, RefusesAGrayImage) {
  const TemporaryFolder folder;
  itk_oracle::write(folder / "gray.mha", {known_volume(straight_grid())}, {});
  const auto found = read_field(folder / "gray.mha");
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("1 values per voxel"), std::string::npos)
      << found.error().message;
}

}  // namespace
}  // namespace palpate::files
