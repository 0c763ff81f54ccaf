// Which iso-surface is a wall. Oracle: shapes that are closed or open by construction.
#include "module/scene/wall_value.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace palpate {
namespace {

template <class Value>
Volume sampled(const Value& value) {
  Volume volume;
  volume.grid.size = {64, 64, 64};
  volume.grid.origin_mm = glm::dvec3(-31.5);
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i)
        volume.values.push_back(float(value(volume.grid.lps_from_index({i, j, k}))));
  return volume;
}

/// 1 inside, 0 outside, over one voxel.
double edge(double inside_mm) {
  return std::clamp(0.5 + inside_mm, 0.0, 1.0);
}

double ball(glm::dvec3 x, double radius_mm) {
  return edge(radius_mm - glm::length(x));
}

TEST(WallValue, ABallIsAClosedWall) {
  const Volume frame = sampled([](glm::dvec3 x) { return 100.0 + 900.0 * ball(x, 22.0); });
  const WallQuality wall = wall_of(frame);
  EXPECT_EQ(wall.at.iso_value, value_between_groups(frame).iso_value);
  // The values of the edge shift both means inwards.
  EXPECT_NEAR(wall.at.iso_value, 550.0, 20.0);
  EXPECT_LT(wall.ends, 0.01);
  // Central differences over a voxel, of an edge that is one voxel wide.
  EXPECT_GT(wall.slope_per_mm, 350.0);
}

TEST(WallValue, APlateFullOfHolesIsNone) {
  const Volume frame = sampled([](glm::dvec3 x) {
    const glm::dvec2 cell = glm::mod(glm::dvec2(x), 10.0) - 5.0;
    return 1000.0 * std::min(edge(2.5 - std::abs(x.z)), edge(glm::length(cell) - 3.0));
  });
  EXPECT_GT(wall_of(frame).ends, kClosedWall);
}

TEST(WallValue, TakesTheValueThatGivesAClosedWall) {
  // Half of the volume around the ball is small regions of 500: Otsu's value is between 0 and 500.
  test::Random random(5);
  std::vector<double> crumbs(16 * 16 * 16);
  for (double& crumb : crumbs) crumb = random.draw(0.0, 1.0) < 0.5 ? 0.0 : 500.0;
  const Volume frame = sampled([&](glm::dvec3 x) {
    const glm::ivec3 cell = (glm::ivec3(x + 31.5)) / 4;
    const double around = crumbs[size_t(cell.x + 16 * (cell.y + 16 * cell.z))];
    return std::max(around, 1000.0 * ball(x, 20.0));
  });
  const WallQuality otsu = wall_quality(frame, value_between_groups(frame));
  EXPECT_LT(otsu.at.iso_value, 500.0);
  EXPECT_GT(otsu.ends, kClosedWall);
  const WallQuality wall = wall_of(frame);
  EXPECT_GT(wall.at.iso_value, 500.0);
  EXPECT_LT(wall.ends, 0.05);
}

TEST(WallValue, OneValueEverywhereIsNoWall) {
  const Volume frame = sampled([](glm::dvec3) { return 7.0; });
  EXPECT_EQ(wall_of(frame).ends, 1.0);
  EXPECT_EQ(wall_of(frame).at.iso_value, 7.0);
}

}  // namespace
}  // namespace palpate
