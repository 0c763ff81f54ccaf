#include "compute/volume/grid.h"

#include <gtest/gtest.h>

#include "tests/volume/grids.h"

namespace palpate {
namespace {

using test::oblique_grid;

TEST(Grid, IndexAndPhysicalSpaceAreInverse) {
  const Grid grid = oblique_grid();
  const glm::dvec3 index(3.25, -1.5, 6.0);
  const glm::dvec3 back = grid.index_from_lps(grid.lps_from_index(index));
  // Some ten double roundings of coordinates of about 50 mm.
  EXPECT_LT(glm::length(back - index), 1e-12);
}

TEST(Grid, SameGeometrySeesATenthOfAVoxelAndIgnoresRounding) {
  const Grid grid = oblique_grid();
  Grid rounded = grid;
  rounded.origin_mm += glm::dvec3(1e-6);
  EXPECT_TRUE(same_geometry(grid, rounded));
  Grid shifted = grid;
  shifted.origin_mm.x += 0.07;
  EXPECT_FALSE(same_geometry(grid, shifted));
  Grid stretched = grid;
  stretched.spacing_mm.z *= 1.01;
  EXPECT_FALSE(same_geometry(grid, stretched));
  Grid turned = grid;
  turned.direction = test::some_rotation(4);
  EXPECT_FALSE(same_geometry(grid, turned));
}

TEST(Grid, CoarseSampleIsTheCentreOfItsCell) {
  const Grid fine = oblique_grid();
  const Grid coarse = coarsened(fine, {4, 2, 1});
  EXPECT_EQ(coarse.size, glm::ivec3(4, 6, 7));
  const glm::dvec3 expected = fine.lps_from_index({5.5, 2.5, 3.0});
  EXPECT_LT(glm::length(coarse.lps_from_index({1.0, 1.0, 3.0}) - expected), 1e-12);
}

}  // namespace
}  // namespace palpate
