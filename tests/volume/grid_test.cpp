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
  // About ten double roundings of coordinates of about 50 mm.
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

TEST(Grid, OverlapsWhereACentreLiesInTheOtherBox) {
  Grid a = oblique_grid();
  Grid b = a;
  const auto moved = [&](glm::dvec3 voxels) {
    b.origin_mm = a.lps_from_index(voxels);
    return has_centre_inside(a, b);
  };
  EXPECT_TRUE(moved({0, 0, 0}));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      glm::dvec3 shift(0.0);
      // The last centre is n - 1 voxels away, the border of b half a voxel before its first centre.
      shift[axis] = sign * (a.size[axis] - 0.6);
      EXPECT_TRUE(moved(shift)) << axis << sign;
      EXPECT_NEAR(gap_mm(a, b), 0.0, 1e-9);
      shift[axis] = sign * (a.size[axis] - 0.4);
      EXPECT_FALSE(moved(shift)) << axis << sign;
      shift[axis] = sign * (a.size[axis] + 3.0);
      EXPECT_FALSE(moved(shift)) << axis << sign;
      EXPECT_NEAR(gap_mm(a, b), 3.0 * a.spacing_mm[axis], 1e-9);
    }
  }
}

TEST(Grid, OverlapAndGapKnowTurnedBoxes) {
  Grid a;
  a.size = {10, 10, 10};
  Grid b = a;
  // Rotated by 45 degrees about z, with an edge towards a: the distance from the middle of b to
  // that edge is 10 / sqrt(2).
  const double c = std::sqrt(0.5);
  b.direction = glm::dmat3(c, c, 0, -c, c, 0, 0, 0, 1);
  const auto put_middle_at = [&](glm::dvec3 lps_mm) {
    b.origin_mm = glm::dvec3(0.0);
    b.origin_mm = lps_mm - b.lps_from_index(0.5 * glm::dvec3(b.size - 1));
  };
  put_middle_at({9.5 + 10.0 * c + 4.0, 4.5, 4.5});
  EXPECT_FALSE(has_centre_inside(a, b));
  EXPECT_NEAR(gap_mm(a, b), 4.0, 1e-6);
  put_middle_at({9.5 + 10.0 * c - 1.0, 4.5, 4.5});
  EXPECT_TRUE(has_centre_inside(a, b));
  EXPECT_NEAR(gap_mm(a, b), 0.0, 1e-6);
  // A plate between two planes of centres intersects the volume, but contains no centre.
  b = a;
  b.size = {10, 10, 1};
  b.spacing_mm.z = 0.2;
  b.origin_mm.z = 4.5;
  EXPECT_FALSE(has_centre_inside(a, b));
  EXPECT_TRUE(has_centre_inside(b, a));
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
