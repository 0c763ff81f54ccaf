// The oracle is the patient: a motion to the left must point to the right of an axial picture. The
// pictures have one slice, so that each has one view, and a motion that is large only in the
// middle, so that few arrows are drawn.

#include <gtest/gtest.h>

#include <cmath>

#include "integration/charts/charts.h"
#include "tests/charts/picture_file.h"

namespace palpate::charts {
namespace {

// An arrow of 10 mm on a view of 128 mm and 280 px is 22 px long at stretch 1. Its opposite starts
// at the same point, so the centres of the two are about one length apart. Half of that is a clear
// difference.
constexpr double kClearlyApartPx = 12.0;

ReadPicture picture_of(const Grid& grid, glm::dvec3 motion_mm) {
  const Volume frame = filled_volume(grid, [](glm::dvec3 x) { return x.x > 0 ? 1.0f : 0.0f; });
  const Field field = filled_field(grid, [&](glm::dvec3 x) {
    return motion_mm * std::exp(-0.5 * glm::dot(x, x) / (4.0 * 4.0));
  });
  const ScratchFile file("arrow.png");
  const auto written = write_sequence_strip(file.path(), {{&frame, &field}}, {"Motion", ""});
  EXPECT_TRUE(written) << (written ? "" : written.error().message);
  return read_png(file.path());
}

// The difference on the page between the arrow of a motion and that of the opposite motion.
glm::dvec2 direction_on_page(const Grid& grid, glm::dvec3 motion_mm) {
  const ReadPicture there = picture_of(grid, motion_mm);
  const ReadPicture back = picture_of(grid, -motion_mm);
  int there_count = 0;
  int back_count = 0;
  const glm::dvec2 there_px = centre_of_new_colors(there, back, &there_count);
  const glm::dvec2 back_px = centre_of_new_colors(back, there, &back_count);
  EXPECT_GT(there_count, 20);
  EXPECT_GT(back_count, 20);
  return there_px - back_px;
}

constexpr glm::dvec3 kSpacing(2.0, 2.0, 2.0);

TEST(Arrows, PointRightForMotionToThePatientsLeftOnAxialViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({64, 64, 1}, kSpacing), {10, 0, 0});
  EXPECT_GT(step.x, kClearlyApartPx);
  EXPECT_LT(std::abs(step.y), 0.2 * step.x);
}

TEST(Arrows, PointDownForMotionToTheBackOnAxialViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({64, 64, 1}, kSpacing), {0, 10, 0});
  EXPECT_GT(step.y, kClearlyApartPx);
  EXPECT_LT(std::abs(step.x), 0.2 * step.y);
}

TEST(Arrows, PointUpForMotionToTheHeadOnCoronalViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({64, 1, 64}, kSpacing), {0, 0, 10});
  EXPECT_LT(step.y, -kClearlyApartPx);
  EXPECT_LT(std::abs(step.x), -0.2 * step.y);
}

TEST(Arrows, PointRightForMotionToThePatientsLeftOnCoronalViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({64, 1, 64}, kSpacing), {10, 0, 0});
  EXPECT_GT(step.x, kClearlyApartPx);
}

TEST(Arrows, PointRightForMotionToTheBackOnSagittalViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({1, 64, 64}, kSpacing), {0, 10, 0});
  EXPECT_GT(step.x, kClearlyApartPx);
}

TEST(Arrows, PointUpForMotionToTheHeadOnSagittalViews) {
  const glm::dvec2 step = direction_on_page(centred_grid({1, 64, 64}, kSpacing), {0, 0, 10});
  EXPECT_LT(step.y, -kClearlyApartPx);
}

TEST(Arrows, FollowThePatientAndNotTheIndexWhenTheGridIsTurned) {
  // i runs to the right and j to the front, as in files written RAS.
  const glm::dmat3 turned(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1));
  const Grid grid = centred_grid({64, 64, 1}, kSpacing, turned);
  EXPECT_GT(direction_on_page(grid, {10, 0, 0}).x, kClearlyApartPx);
  EXPECT_GT(direction_on_page(grid, {0, 10, 0}).y, kClearlyApartPx);
}

TEST(Arrows, HaveTheirTrueLengthWhereVoxelsAreUneven) {
  // 8 mm are 2 voxels along i and 8 along j: both arrows must have the same length on the page.
  const Grid grid = centred_grid({32, 128, 1}, {4.0, 1.0, 3.0});
  const double across = direction_on_page(grid, {8, 0, 0}).x;
  const double down = direction_on_page(grid, {0, 8, 0}).y;
  // Arrows are about 18 px long, with whole pixels.
  EXPECT_NEAR(across / down, 1.0, 0.15);
}

TEST(Frame, ShowsThePatientsLeftOnTheRightWhenTheGridIsTurned) {
  const glm::dmat3 turned(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1));
  const Grid grid = centred_grid({64, 64, 1}, kSpacing, turned);
  const Volume frame = filled_volume(grid, [](glm::dvec3 x) { return x.x > 0 ? 1.0f : 0.0f; });
  const ScratchFile file("left.png");
  ASSERT_TRUE(write_sequence_strip(file.path(), {{&frame}}, {"Left is bright", ""}));
  const ReadPicture picture = read_png(file.path());
  ASSERT_GT(picture.width, 0);
  // The view lies right of the words of its row, from 9/20 of the page to 18/20.
  const int row = picture.height * 6 / 10;
  EXPECT_LT(picture.rgb(picture.width * 11 / 20, row).x, 20);
  // The brightest tissue of a page stays grey: 255 / 1.35.
  EXPECT_NEAR(picture.rgb(picture.width * 16 / 20, row).x, 189, 2);
}

}  // namespace
}  // namespace palpate::charts
