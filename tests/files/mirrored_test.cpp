// Left-handed axes (FSL, dcm2niix, most 4D echo): read as right-handed ones with every sample at
// its place, and written back with the axes of the file. ITK is the oracle for the content of a
// file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

// ITK looks for the samples of x.nii.gz in an x.nii beside it.
constexpr const char* kNames[] = {"v.mha", "v.nrrd", "v.nii", "packed.nii.gz"};

/// Left-handed in each possible way: one axis reversed, or all three.
std::vector<Grid> left_handed_grids() {
  std::vector<Grid> grids(4, oblique_grid());
  for (int axis = 0; axis < 3; ++axis) {
    grids[size_t(axis)].direction[axis] *= -1.0;
    grids[3].direction[axis] *= -1.0;
  }
  return grids;
}

/// The same value at the same place, whatever its index.
void expect_same_samples(const Volume& found, const Volume& wanted, double tolerance_mm) {
  ASSERT_EQ(found.grid.size, wanted.grid.size);
  EXPECT_NEAR(glm::determinant(found.grid.direction), 1.0, 1e-6);
  for (int k = 0; k < wanted.grid.size.z; ++k) {
    for (int j = 0; j < wanted.grid.size.y; ++j) {
      for (int i = 0; i < wanted.grid.size.x; ++i) {
        const glm::dvec3 x = wanted.grid.lps_from_index(glm::dvec3(i, j, k));
        const glm::ivec3 at = glm::ivec3(glm::round(found.grid.index_from_lps(x)));
        ASSERT_LT(glm::distance(found.grid.lps_from_index(glm::dvec3(at)), x), tolerance_mm);
        EXPECT_EQ(found.at(at.x, at.y, at.z), wanted.at(i, j, k)) << i << ' ' << j << ' ' << k;
      }
    }
  }
}

TEST(MirroredAxes, AreReadWithEverySampleAtItsPlaceInEveryFormat) {
  const TemporaryFolder folder;
  for (const Grid& grid : left_handed_grids()) {
    for (const char* name : kNames) {
      const Volume volume = known_volume(grid);
      itk_oracle::write(folder / name, {volume}, {});
      const auto found = read_volume(folder / name);
      ASSERT_TRUE(found) << found.error().message;
      EXPECT_TRUE(found->grid.j_reversed_in_file);
      expect_same_samples(*found, volume, 10.0 * tolerance_of(name));
    }
  }
}

TEST(MirroredAxes, AreReadInEveryFrameOfASequence) {
  const TemporaryFolder folder;
  const Grid grid = left_handed_grids()[0];
  const std::vector<Volume> frames = {known_volume(grid, 0), known_volume(grid, 1),
                                      known_volume(grid, 2)};
  itk_oracle::write(folder / "s.nii", frames, {});
  // The list axis first: all frames of a voxel are adjacent.
  const glm::dvec3 i = grid.direction[0] * grid.spacing_mm.x,
                   j = grid.direction[1] * grid.spacing_mm.y,
                   k = grid.direction[2] * grid.spacing_mm.z;
  const auto vector = [](glm::dvec3 v) {
    return "(" + std::to_string(v.x) + "," + std::to_string(v.y) + "," + std::to_string(v.z) + ") ";
  };
  std::string data;
  for (size_t v = 0; v < grid.count(); ++v) {
    data += bytes_of_values<float>({frames[0].values[v], frames[1].values[v], frames[2].values[v]});
  }
  write_bytes(
      folder / "s.nrrd",
      "NRRD0004\ntype: float\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 5 4 3\n"
      "kinds: list domain domain domain\nspace directions: none " +
          vector(i) + vector(j) + vector(k) + "\nspace origin: " + vector(grid.origin_mm) +
          "\nendian: little\nencoding: raw\n\n" + data);
  // std::to_string() gives six decimals, over up to 4 voxels.
  for (const auto& [name, tolerance] : {std::pair("s.nii", 3e-4), std::pair("s.nrrd", 1e-5)}) {
    const auto found = read_sequence({folder / name});
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_EQ(found->frames.size(), 3U);
    for (size_t n = 0; n < 3; ++n) expect_same_samples(found->frames[n], frames[n], tolerance);
  }
}

TEST(MirroredAxes, OfSomeFramesOnlyAreNoDifference) {
  const TemporaryFolder folder;
  const Grid grid = oblique_grid();
  Grid mirrored = grid;
  mirrored.origin_mm = grid.lps_from_index({grid.size.x - 1, 0, 0});
  mirrored.direction[0] = -grid.direction[0];
  Volume second = known_volume(mirrored, 1);
  itk_oracle::write(folder / "f0.mha", {known_volume(grid, 0)}, {});
  itk_oracle::write(folder / "f1.mha", {second}, {});
  // A file reversed along i, read as right-handed, gets its j reversed: its axes are rotated by
  // half a turn, so it is another grid.
  const auto refused = read_sequence({folder.path()});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("a direction of axis 0"));

  mirrored.origin_mm = grid.lps_from_index({0, grid.size.y - 1, 0});
  mirrored.direction = grid.direction;
  mirrored.direction[1] = -grid.direction[1];
  second = known_volume(mirrored, 1);
  itk_oracle::write(folder / "f1.mha", {second}, {});
  const auto found = read_sequence({folder.path()});
  ASSERT_TRUE(found) << found.error().message;
  expect_same_samples(found->frames[0], known_volume(grid, 0), kTextToleranceMm);
  expect_same_samples(found->frames[1], second, 10.0 * kTextToleranceMm);
}

TEST(MirroredAxes, AreWrittenBackAsTheFileHadThem) {
  const TemporaryFolder folder;
  for (const Grid& grid : left_handed_grids()) {
    for (const char* name : kNames) {
      const Volume volume = known_volume(grid);
      itk_oracle::write(folder / name, {volume}, {});
      const auto found = read_volume(folder / name);
      ASSERT_TRUE(found) << found.error().message;
      const double tolerance = tolerance_of(name);

      ASSERT_TRUE(write_volume(*found, folder / name));
      auto by_itk = itk_oracle::read(folder / name);
      expect_grid(by_itk.grid, grid, tolerance);
      EXPECT_EQ(by_itk.values, volume.values) << name;

      Mask mask{found->grid, {}};
      for (const float value : found->values) mask.values.push_back(uint8_t(value > 100.0F));
      ASSERT_TRUE(write_mask(mask, folder / name));
      by_itk = itk_oracle::read(folder / name);
      expect_grid(by_itk.grid, grid, tolerance);
      for (size_t v = 0; v < volume.values.size(); ++v)
        EXPECT_EQ(by_itk.values[v], volume.values[v] > 100.0F ? 1.0F : 0.0F) << name << v;
    }
  }
}

TEST(MirroredAxes, OfAFieldKeepVectorsAlongThePatientsAxes) {
  const TemporaryFolder folder;
  for (const Grid& grid : left_handed_grids()) {
    for (const char* name : kNames) {
      const Field field = known_field(grid);
      itk_oracle::write_field(folder / name, field);
      const auto found = read_field(folder / name);
      ASSERT_TRUE(found) << found.error().message;
      for (int k = 0; k < grid.size.z; ++k) {
        for (int j = 0; j < grid.size.y; ++j) {
          for (int i = 0; i < grid.size.x; ++i) {
            const glm::dvec3 x = grid.lps_from_index(glm::dvec3(i, j, k));
            EXPECT_LT(glm::distance(sample_at_lps(*found, x), glm::dvec3(field.at(i, j, k))), 1e-3);
          }
        }
      }
      ASSERT_TRUE(write_field(*found, folder / name));
      const auto by_itk = itk_oracle::read(folder / name);
      expect_grid(by_itk.grid, grid, tolerance_of(name));
      for (size_t v = 0; v < field.u_mm.size(); ++v) {
        for (int c = 0; c < 3; ++c)
          EXPECT_EQ(by_itk.values[3 * v + size_t(c)], field.u_mm[v][c]) << name << v;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::files
