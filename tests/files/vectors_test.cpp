// Frames of vectors, as a flow simulation writes them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_volume.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

Field known_vectors(const Grid& grid, int k) {
  Field field{grid, {}};
  for (size_t v = 0; v < grid.count(); ++v)
    field.u_mm.emplace_back(float(v) + 0.5F, -float(v) * 0.25F, float(k) + float(v % 7));
  return field;
}

TEST(Vectors, OfAFolderAreReadInTheNaturalOrderOfNames) {
  const TemporaryFolder folder;
  for (const int k : {0, 2, 10})
    ASSERT_TRUE(write_field(known_vectors(oblique_grid(), k),
                            folder / ("v" + std::to_string(k) + (k == 2 ? ".nrrd" : ".mha"))));
  EXPECT_TRUE(holds_vectors({folder.path()}));
  const auto found = read_vectors({folder.path()});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->size(), 3U);
  const int order[] = {0, 2, 10};
  for (size_t n = 0; n < 3; ++n) {
    EXPECT_EQ((*found)[n].values, known_vectors(oblique_grid(), order[n]).u_mm) << n;
    EXPECT_TRUE(same_geometry((*found)[n].grid, oblique_grid())) << n;
  }
}

TEST(Vectors, AreToldFromScalarsAndFromWhatCanNotBeRead) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_volume(known_volume(oblique_grid(), 0), folder / "scalar.mha"));
  write_bytes(folder / "noise.mha", "no header");
  EXPECT_FALSE(holds_vectors({folder / "scalar.mha"}));
  EXPECT_FALSE(holds_vectors({folder / "noise.mha"}));
  EXPECT_FALSE(holds_vectors({folder / "none.mha"}));
  EXPECT_FALSE(holds_vectors({}));
}

TEST(Vectors, AreRefusedWithScalarsOrOtherGridsBetweenThem) {
  const TemporaryFolder folder;
  const Grid grid = oblique_grid();
  Grid moved = grid;
  moved.origin_mm.x += 5.0;
  ASSERT_TRUE(write_field(known_vectors(grid, 0), folder / "a.mha"));
  ASSERT_TRUE(write_field(known_vectors(moved, 0), folder / "moved.mha"));
  ASSERT_TRUE(write_volume(known_volume(grid, 0), folder / "scalar.mha"));
  const auto refusal = [&](const char* second) {
    const auto found = read_vectors({folder / "a.mha", folder / second});
    return found ? std::string() : found.error().message;
  };
  EXPECT_THAT(refusal("moved.mha"), HasSubstr("(frame 1) has an origin of"));
  EXPECT_THAT(refusal("scalar.mha"),
              HasSubstr("holds 1 values per voxel where vectors have three"));
  EXPECT_THAT(refusal("none.mha"), HasSubstr("does not exist"));
}

}  // namespace
}  // namespace palpate::files
