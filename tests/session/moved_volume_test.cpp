// The volume moved to the present time, for data whose motion is one vector.
#include "module/session/moved_volume.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compute/motion/estimate_sequence.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"

namespace palpate {
namespace {

// Of the values along L, P, S, 1/mm.
const glm::dvec3 kSlope(2.0, -1.0, 3.0);
const glm::vec3 kMoved_mm(3.0F, -2.0F, 1.0F);
// Of the second frame's own values.
constexpr double kChange = 10.0;

Grid turned_grid() {
  Grid grid;
  grid.size = {17, 16, 15};
  grid.spacing_mm = {2.0, 1.5, 2.5};
  grid.origin_mm = {-20.0, 30.0, 5.0};
  grid.direction =
      glm::dmat3(glm::dvec3(0.8, 0.6, 0.0), glm::dvec3(-0.6, 0.8, 0.0), glm::dvec3(0.0, 0.0, 1.0));
  return grid;
}

/// Values rise linearly in space. The second frame has them at the places to which the motion moves
/// them, plus kChange.
VolumeData two_frames() {
  const Grid grid = turned_grid();
  Volume first{grid, {}}, second{grid, {}};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        first.values.push_back(float(glm::dot(kSlope, x)));
        second.values.push_back(float(glm::dot(kSlope, x - glm::dvec3(kMoved_mm)) + kChange));
      }
  VolumeData data;
  data.frames.frames = {first, second};
  data.frames.times_s = {0.0, 1.0};
  data.frames.times_known = true;
  return data;
}

Field the_field() {
  const Grid grid = turned_grid();
  return {grid, std::vector<glm::vec3>(grid.count(), kMoved_mm)};
}

/// Well inside: at the border of an image its values are clamped.
template <class Work>
void inside(const Grid& grid, int border, const Work& work) {
  for (int k = border; k < grid.size.z - border; ++k)
    for (int j = border; j < grid.size.y - border; ++j)
      for (int i = border; i < grid.size.x - border; ++i)
        work(grid.offset(i, j, k), grid.lps_from_index({i, j, k}));
}

void expect_moved(const MovedVolume& moved, double share, double change, int border) {
  ASSERT_EQ(moved.values.values.size(), moved.values.grid.count());
  ASSERT_EQ(moved.moved_mm.size(), moved.values.grid.count());
  const glm::dvec3 way_mm = share * glm::dvec3(kMoved_mm);
  inside(moved.values.grid, border, [&](size_t v, glm::dvec3 x) {
    EXPECT_NEAR(moved.values.values[v], glm::dot(kSlope, x - way_mm) + change, 1e-2);
    EXPECT_NEAR(glm::length(glm::dvec3(moved.moved_mm[v]) - way_mm), 0.0, 1e-5);
  });
}

MovingVolume pairwise() {
  VolumeSpec spec;
  spec.name = "ramp";
  spec.cyclic = false;
  spec.motions = {{"data", {}, {}}};
  VolumeData data = two_frames();
  data.motions = {{{the_field()}, {}}};
  auto built = build(spec, std::move(data));
  EXPECT_TRUE(built) << built.error().message;
  return *built;
}

TEST(MovedVolume, OfTwoFramesIsOnTheWayFromOneToTheOther) {
  const MovingVolume volume = pairwise();
  for (const double share : {0.0, 0.25, 0.5}) {
    const MovedVolume moved = moved_volume(volume, share, 1'000'000);
    EXPECT_TRUE(same_geometry(moved.values.grid, turned_grid()));
    expect_moved(moved, share, share * kChange, 4);
  }
}

TEST(MovedVolume, OfOneMotionIsTheReferenceFrameCarried) {
  VolumeSpec spec;
  spec.name = "ramp";
  spec.cyclic = false;
  const auto own = build(spec, two_frames());
  ASSERT_TRUE(own) << own.error().message;
  const auto motion = motion_of_steps(std::vector<Field>{the_field()}, {{0.0, 1.0}, 0.0, 0}, 0);
  ASSERT_TRUE(motion) << motion.error().message;
  const auto volume = carried(*own, *motion);
  ASSERT_TRUE(volume) << volume.error().message;
  expect_moved(moved_volume(*volume, 1.0, 1'000'000), 1.0, 0.0, 4);
}

TEST(MovedVolume, IsOnACoarserGridWhereItHasTooManySamples) {
  const MovedVolume moved = moved_volume(pairwise(), 0.5, 1000);
  const Grid& grid = moved.values.grid;
  EXPECT_EQ(grid.size, glm::ivec3(9, 8, 8));
  EXPECT_NEAR(glm::length(grid.origin_mm - turned_grid().origin_mm), 0.0, 1e-9);
  EXPECT_NEAR(glm::length(grid.spacing_mm - 2.0 * turned_grid().spacing_mm), 0.0, 1e-9);
  expect_moved(moved, 0.5, 0.5 * kChange, 2);
}

TEST(MovedVolume, IsEmptyWhereThereAreNoSamples) {
  VolumeSpec spec;
  spec.name = "molecule";
  spec.source = "molecule";
  const auto molecule = build(spec);
  ASSERT_TRUE(molecule) << molecule.error().message;
  EXPECT_TRUE(moved_volume(*molecule, 0.0, 1000).values.values.empty());
}

}  // namespace
}  // namespace palpate
