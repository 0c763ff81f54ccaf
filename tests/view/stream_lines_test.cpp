// Stream tubes of moving data: they are carried with the material.
#include <gtest/gtest.h>

#include "module/scene/make_volume.h"
#include "module/view/stream_lines.h"

namespace palpate::test {
namespace {

Grid cube(int n, double spacing_mm) {
  Grid grid;
  grid.size = glm::ivec3(n);
  grid.spacing_mm = glm::dvec3(spacing_mm);
  return grid;
}

/// Straight streams along L, in two frames; the material of the first moves 4 mm along S to the
/// second.
MovingVolume stream_that_rises() {
  const Grid grid = cube(12, 2.0);
  MovingVolume volume;
  volume.times = {{0.0, 1.0}, 0.0};
  for (int k = 0; k < 2; ++k)
    volume.frames.push_back(
        sampled_vector(grid, std::vector<glm::vec3>(grid.count(), glm::vec3(3.0F, 0.0F, 0.0F))));
  Field up{grid, std::vector<glm::vec3>(grid.count(), glm::vec3(0.0F, 0.0F, 4.0F))};
  volume.motions = {{"data", {MotionMap::of(up)}}};
  return volume;
}

Things laid(const MovingVolume& volume, FramePointer at, bool whole_frames,
            const Transform& place = {}) {
  StreamLines lines(2);
  Things things;
  lines.add(things, volume, place, at, 0.0005, whole_frames);
  return things;
}

TEST(StreamLines, AreCarriedByTheMotionOfTheMaterial) {
  const MovingVolume volume = stream_that_rises();
  const Things start = laid(volume, {0, 0.0}, false), later = laid(volume, {0, 0.75}, false);
  ASSERT_GT(start.size(), 20U);
  ASSERT_EQ(start.size(), later.size());
  const glm::dvec3 risen(0.0, 0.75 * 0.004, 0.0);  // S is up
  for (size_t k = 0; k < start.size(); ++k) {
    // Fields are stored as floats: 4 mm to 5e-10 m.
    EXPECT_LT(glm::distance(later[k].from, start[k].from + risen), 1e-9);
    EXPECT_LT(glm::distance(later[k].to, start[k].to + risen), 1e-9);
    EXPECT_LT(std::abs(start[k].to.y - start[k].from.y), 1e-12) << "streams run along L";
    EXPECT_EQ(start[k].from_radius_m, 0.0005);
  }
}

TEST(StreamLines, AreCarriedByOneMotionForAllTimes) {
  const MovingVolume own = stream_that_rises();
  const Grid grid = cube(12, 2.0);
  SequenceMotion motion;
  motion.reference = 1;
  motion.basis = {own.times.times_s, 0.0, 0};
  const Field down{grid, std::vector<glm::vec3>(grid.count(), glm::vec3(0.0F, 0.0F, -4.0F))};
  motion.terms = {down, still_field(grid)};
  const auto volume = carried(own, motion);
  ASSERT_TRUE(volume);
  const Things start = laid(*volume, {0, 0.0}, false), end = laid(*volume, {1, 0.0}, false);
  ASSERT_GT(start.size(), 20U);
  ASSERT_EQ(start.size(), end.size());
  for (size_t k = 0; k < start.size(); ++k)
    EXPECT_LT(glm::distance(end[k].from, start[k].from + glm::dvec3(0.0, 0.004, 0.0)), 1e-9);
}

TEST(StreamLines, StayWhereWholeFramesAreShownOrNothingIsKnownOfTheirMotion) {
  MovingVolume volume = stream_that_rises();
  const auto same = [](const Things& a, const Things& b) {
    if (a.size() != b.size()) return false;
    for (size_t k = 0; k < a.size(); ++k)
      if (a[k].from != b[k].from || a[k].to != b[k].to) return false;
    return true;
  };
  const Things start = laid(volume, {0, 0.0}, false);
  EXPECT_TRUE(same(start, laid(volume, {0, 0.75}, true)));
  EXPECT_FALSE(same(start, laid(volume, {0, 0.75}, false)));
  EXPECT_TRUE(same(laid(volume, {1, 0.0}, true), laid(volume, {1, 0.0}, false)));  // the last frame
  volume.motions.clear();
  EXPECT_TRUE(same(start, laid(volume, {0, 0.75}, false)));
}

TEST(StreamLines, AColourMeansTheSameLengthInEveryFrame) {
  // The second frame's vectors are four times as long; frame by frame all would have one colour.
  const Grid grid = cube(12, 2.0);
  MovingVolume volume;
  volume.times = {{0.0, 1.0, 2.0}, 0.0};
  for (const float length : {2.0F, 8.0F, 4.0F})
    volume.frames.push_back(
        sampled_vector(grid, std::vector<glm::vec3>(grid.count(), glm::vec3(length, 0.0F, 0.0F))));
  StreamLines lines(2);
  for (const int frame : {0, 1, 2}) {
    Things things;
    const glm::dvec2 lengths = lines.add(things, volume, {}, {frame, 0.0}, 0.0005, false);
    const double unit = glm::length(volume.frames[0]->vector(glm::dvec3(0.0, 0.0, 0.01))) / 2.0;
    EXPECT_NEAR(lengths.x, 2.0 * unit, 1e-6 * unit);
    EXPECT_NEAR(lengths.y, 8.0 * unit, 1e-6 * unit);
    ASSERT_GT(things.size(), 20U);
    const glm::dvec3 expected = tube_colour(frame == 0 ? 2.0 : frame == 1 ? 8.0 : 4.0, 2.0, 8.0);
    for (const RoundCone& rod : things)
      ASSERT_LT(glm::distance(rod.colour, expected), 1e-4) << frame;
  }
  // A frame that comes in live changes what a colour means, and keeps the lines.
  Things before, after;
  lines.add(before, volume, {}, {0, 0.0}, 0.0005, false);
  volume.frames.push_back(
      sampled_vector(grid, std::vector<glm::vec3>(grid.count(), glm::vec3(32.0F, 0.0F, 0.0F))));
  volume.times.times_s.push_back(3.0);
  const glm::dvec2 lengths = lines.add(after, volume, {}, {1, 0.0}, 0.0005, false);
  EXPECT_NEAR(lengths.y / lengths.x, 16.0, 1e-5);
  ASSERT_EQ(before.size(), after.size());
  EXPECT_LT(glm::distance(after[0].colour, tube_colour(4.0, 1.0, 16.0)), 1e-4);
}

TEST(StreamLines, StandWhereTheVolumeIs) {
  const MovingVolume volume = stream_that_rises();
  Transform place;
  place.translation_m = {0.1, -0.2, 0.3};
  place.rotation = glm::angleAxis(0.7, glm::dvec3(0.0, 1.0, 0.0));
  place.scale = glm::dvec3(2.0);
  const Things here = laid(volume, {0, 0.5}, false), there = laid(volume, {0, 0.5}, false, place);
  ASSERT_EQ(here.size(), there.size());
  for (size_t k = 0; k < here.size(); ++k) {
    EXPECT_LT(glm::distance(there[k].from, place.world_from_volume(here[k].from)), 1e-12);
    EXPECT_EQ(there[k].from_radius_m, 0.0005);
  }
}

TEST(StreamLines, OfScalarsFollowTheirGradient) {
  const Grid grid = cube(12, 2.0);
  Volume ramp{grid, std::vector<float>(grid.count())};
  for (size_t v = 0; v < ramp.values.size(); ++v)
    ramp.values[v] = float(v / size_t(grid.size.x * grid.size.y));  // rises along S
  MovingVolume volume;
  volume.times = {{0.0}, 0.0};
  volume.frames = {sampled_scalar(std::move(ramp))};
  const Things tubes = laid(volume, {0, 0.0}, false);
  ASSERT_GT(tubes.size(), 20U);
  for (const RoundCone& tube : tubes) {
    const glm::dvec3 way = glm::normalize(tube.to - tube.from);
    EXPECT_GT(std::abs(way.y), 1.0 - 1e-9);
  }
}

}  // namespace
}  // namespace palpate::test
