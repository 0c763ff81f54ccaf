// Slices through data in closed form, on a grid that is turned in the patient.
#include "module/session/slices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "module/session/moved_volume.h"

namespace palpate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const glm::dvec3 kMiddle_mm(10.0, -20.0, 30.0);  // LPS
constexpr double kRadius_mm = 20.0;

/// Axes near A, S and R, in this order: no axis is where a picture has it.
Grid slanted_grid() {
  Grid grid;
  grid.size = {41, 31, 21};
  grid.spacing_mm = {1.5, 2.0, 3.0};
  const double c = std::cos(0.2), s = std::sin(0.2);
  grid.direction =
      glm::dmat3(glm::dvec3(s, -c, 0.0), glm::dvec3(0.0, 0.0, 1.0), glm::dvec3(-c, -s, 0.0));
  grid.origin_mm =
      kMiddle_mm - grid.direction * (0.5 * grid.spacing_mm * glm::dvec3(grid.size - 1));
  return grid;
}

/// A still volume with these values of a place, LPS mm, and a ball around its middle as a segment.
template <class Value>
MovingVolume volume_of(const Value& value) {
  const Grid grid = slanted_grid();
  Volume values{grid, {}}, distance{grid, {}};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        values.values.push_back(float(value(x)));
        distance.values.push_back(float(kRadius_mm - glm::distance(x, kMiddle_mm)));
      }
  MovingVolume volume;
  volume.times.times_s = {0.0};
  volume.frames = {sampled_scalar(values)};
  volume.segments = {{"ball", glm::vec3(1.0F), {sampled_scalar(distance)}, true}};
  return volume;
}

TEST(Slices, LieAsRadiologistsExpectThem) {
  const MovingVolume volume = volume_of([](glm::dvec3) { return 0.0; });
  const OrthogonalSlices slices = slices_through(volume, 0.0, volume_from_lps(kMiddle_mm), 50, {});
  EXPECT_THAT(slices.planes[0].sides, ElementsAre("A", "P", "S", "I"));  // sagittal
  EXPECT_THAT(slices.planes[1].sides, ElementsAre("R", "L", "A", "P"));  // axial
  EXPECT_THAT(slices.planes[2].sides, ElementsAre("R", "L", "S", "I"));  // coronal
  // 63 mm along the longest axis, and 62, 61.5 mm.
  EXPECT_NEAR(slices.px_mm, 63.0 / 50.0, 1e-12);
  EXPECT_EQ(slices.planes[1].width, 50);
  EXPECT_EQ(slices.planes[1].height, 49);
}

TEST(Slices, HaveTheValuesOfTheirPlaces) {
  // Of a value that is linear in space, pixels to the right differ by its slope along that side.
  const glm::dvec3 slope(3.0, -2.0, 5.0);
  const MovingVolume volume = volume_of([&](glm::dvec3 x) { return glm::dot(slope, x); });
  const glm::dvec3 place_mm = kMiddle_mm + glm::dvec3(4.0, 3.0, -5.0);
  const OrthogonalSlices slices = slices_through(volume, 0.0, volume_from_lps(place_mm), 60, {});
  const glm::dmat3 axes = slanted_grid().direction;
  const std::array<glm::dvec3, 3> right{-axes[0], -axes[2], -axes[2]};
  const std::array<glm::dvec3, 3> down{-axes[1], -axes[0], -axes[1]};
  for (size_t n = 0; n < 3; ++n) {
    const Slice& slice = slices.planes[n];
    int compared = 0;
    for (int j = 10; j < slice.height - 10; ++j)
      for (int i = 10; i < slice.width - 10; ++i, ++compared) {
        const glm::dvec2 from = glm::dvec2(i + 0.5, j + 0.5) - slice.place_px;
        const glm::dvec3 at = place_mm + slices.px_mm * (from.x * right[n] + from.y * down[n]);
        ASSERT_NEAR(slice.values[size_t(j * slice.width + i)], glm::dot(slope, at), 0.02)
            << "plane " << n << ", pixel " << i << ' ' << j;
      }
    EXPECT_GT(compared, 500);
  }
}

TEST(Slices, ShowAPlaceOutsideAtTheNearestInside) {
  const MovingVolume volume = volume_of([](glm::dvec3 x) { return x.z; });
  const OrthogonalSlices slices =
      slices_through(volume, 0.0, volume_from_lps(kMiddle_mm + glm::dvec3(0, 0, 500)), 50, {});
  EXPECT_NEAR(slices.planes[0].place_px.y, 0.0, 1e-9);  // at the upper edge
}

TEST(Slices, DrawWallsAroundWhatIsInside) {
  const MovingVolume volume =
      volume_of([](glm::dvec3 x) { return 100.0 - glm::distance(x, kMiddle_mm); });
  const OrthogonalSlices slices =
      slices_through(volume, 0.0, volume_from_lps(kMiddle_mm), 120,
                     {{"ball", glm::vec3(1.0F), 0.0, 0}, {"90", glm::vec3(1.0F), 90.0, -1}});
  const std::array<double, 2> radii_mm{kRadius_mm, 10.0};
  for (const Slice& slice : slices.planes)
    for (size_t w = 0; w < 2; ++w) {
      const auto& ends = slice.contours_px[w];
      double length_mm = 0.0;
      for (size_t k = 0; k + 1 < ends.size(); k += 2) {
        EXPECT_NEAR(slices.px_mm * glm::distance(ends[k], slice.place_px), radii_mm[w], 0.25);
        length_mm += slices.px_mm * glm::distance(ends[k], ends[k + 1]);
      }
      EXPECT_NEAR(length_mm, 2.0 * M_PI * radii_mm[w], 0.02 * 2.0 * M_PI * radii_mm[w]);
    }
}

TEST(Slices, KnowASegmentOfOneFrameOnlyThere) {
  MovingVolume volume = volume_of([](glm::dvec3 x) { return x.x; });
  volume.times.times_s = {0.0, 1.0};
  volume.frames.push_back(volume.frames.front());
  volume.segments_frame = 1;
  const std::vector<SliceWall> walls{{"ball", glm::vec3(1.0F), 0.0, 0}};
  const glm::dvec3 place = volume_from_lps(kMiddle_mm);
  EXPECT_THAT(slices_through(volume, 0.0, place, 60, walls).planes[0].contours_px[0], IsEmpty());
  EXPECT_GT(slices_through(volume, 1.0, place, 60, walls).planes[0].contours_px[0].size(), 20U);
}

TEST(Contour, HasNoLineBesideWhatIsNotFinite) {
  std::vector<float> values{0, 1, 1, 0, 1, 1, 0, 1, 1};
  EXPECT_EQ(contour(values, 3, 0.25).size(), 4U);
  for (const glm::dvec2 end : contour(values, 3, 0.25)) EXPECT_NEAR(end.x, 0.75, 1e-6);
  values[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(contour(values, 3, 0.25), IsEmpty());
  EXPECT_THAT(contour({}, 0, 0.0), IsEmpty());
}

}  // namespace
}  // namespace palpate
