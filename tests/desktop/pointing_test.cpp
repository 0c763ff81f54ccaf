// Oracle: an eye at the origin, with simple geometry; then properties for any eye.

#include "integration/desktop/pointing.h"

#include <gtest/gtest.h>

#include <random>

#include "integration/desktop/camera.h"

namespace palpate::desktop {
namespace {

// Metres, of a few double operations.
constexpr double kPointingRounding = 1e-12;

void expect_near(glm::dvec3 a, glm::dvec3 b, double within) {
  EXPECT_LE(glm::distance(a, b), within)
      << a.x << ' ' << a.y << ' ' << a.z << " against " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Pointing, FindsThePlaceUnderACursor) {
  Eye eye;  // looks along -z from the origin
  eye.tan_left = -0.4;
  eye.tan_right = 0.8;  // not symmetric, as a headset's eye
  eye.tan_down = -0.5;
  eye.tan_up = 0.5;
  expect_near(place_under(eye, {-1.0, 1.0}, 2.0), {-0.8, 1.0, -2.0}, kPointingRounding);
  expect_near(place_under(eye, {1.0, -1.0}, 2.0), {1.6, -1.0, -2.0}, kPointingRounding);
  expect_near(place_under(eye, {0.0, 0.0}, 2.0), {0.4, 0.0, -2.0}, kPointingRounding);
}

TEST(Pointing, SeesAPlaceWhereTheCursorWas) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> across(-1.0, 1.0), depth(0.05, 3.0);
  for (int k = 0; k < 1000; ++k) {
    const Camera camera =
        orbit(camera_before(glm::dvec3(across(random)), 0.1), across(random), across(random));
    const Eye eye = eye_of(camera, {800, 500});
    const InPicture cursor(across(random), across(random));
    const double depth_m = depth(random);
    const glm::dvec3 place = place_under(eye, cursor, depth_m);
    EXPECT_NEAR(depth_of(eye, place), depth_m, 1e-11) << k;
    EXPECT_LE(glm::distance(cursor_over(eye, place), cursor), 1e-9) << k;
  }
}

TEST(Pointing, MovesInThePlaneOfThePictureAndTheWheelInAndOut) {
  const Eye eye = eye_of(camera_before(glm::dvec3(0.0), 0.1), {800, 600});
  const glm::dvec3 ahead = eye.orientation * glm::dvec3(0.0, 0.0, -1.0);
  Pointing pointing(glm::dvec3(0.0));
  pointing.point(eye, {0.3, -0.2}, 0.0);
  const glm::dvec3 moved = pointing.place_m();
  EXPECT_NEAR(glm::dot(moved, ahead), 0.0, kPointingRounding) << "the depth has changed";
  EXPECT_LE(glm::distance(cursor_over(eye, moved), InPicture(0.3, -0.2)), 1e-9);
  pointing.point(eye, {0.3, -0.2}, 0.01);
  EXPECT_NEAR(glm::dot(pointing.place_m(), ahead), 0.01, kPointingRounding);
  EXPECT_LE(glm::distance(cursor_over(eye, pointing.place_m()), InPicture(0.3, -0.2)), 1e-9)
      << "the pressed place is not under the cursor";
  pointing.point(eye, {0.3, -0.2}, -0.01);
  expect_near(pointing.place_m(), moved, kPointingRounding);
}

TEST(Pointing, StaysInTheWorldWhileTheViewTurnsAndGoesOnFromThere) {
  const Camera camera = camera_before(glm::dvec3(0.0), 0.1);
  const Eye before = eye_of(camera, {800, 600});
  const Eye after = eye_of(orbit(camera, 0.7, -0.2), {800, 600});
  Pointing pointing(glm::dvec3(0.0));
  pointing.point(before, {0.1, 0.2}, 0.0);
  const glm::dvec3 held = pointing.place_m();
  pointing.keep(after, {0.4, 0.0});
  expect_near(pointing.place_m(), held, 0.0);
  pointing.point(after, {0.4, 0.0}, 0.0);
  // No jump when the hand moves on.
  expect_near(pointing.place_m(), held, kPointingRounding);
  const InPicture seen = cursor_over(after, held);
  pointing.point(after, {0.5, 0.1}, 0.0);
  EXPECT_LE(glm::distance(cursor_over(after, pointing.place_m()), seen + InPicture(0.1, 0.1)),
            1e-9);
}

TEST(Pointing, ComesUnderTheCursorWhenRecentred) {
  const Eye eye = eye_of(camera_before(glm::dvec3(0.0), 0.1), {800, 600});
  Pointing pointing(glm::dvec3(0.02, 0.0, 0.0));
  pointing.keep(eye, {-0.5, -0.5});
  pointing.recentre(eye, {0.0, 0.0}, glm::dvec3(0.0));
  expect_near(pointing.place_m(), glm::dvec3(0.0), kPointingRounding);
}

TEST(Pointing, NeverComesBehindTheEye) {
  const Eye eye = eye_of(camera_before(glm::dvec3(0.0), 0.1), {800, 600});
  Pointing pointing(glm::dvec3(0.0));
  pointing.point(eye, {0.0, 0.0}, -100.0);
  EXPECT_GT(depth_of(eye, pointing.place_m()), 0.0);
}

TEST(Pointing, OwesNothingBackForAWheelThatIsTurnedOnAtAnEnd) {
  const Eye eye = eye_of(camera_before(glm::dvec3(0.0), 0.1), {800, 600});
  const Pointing::Depths depths{0.3, 0.5};
  Pointing pointing(place_under(eye, {0.0, 0.0}, 0.4));
  for (int k = 0; k < 1000; ++k) pointing.point(eye, {0.0, 0.0}, 0.01, depths);
  EXPECT_NEAR(depth_of(eye, pointing.place_m()), 0.5, 1e-11);
  pointing.point(eye, {0.0, 0.0}, -0.01, depths);
  EXPECT_NEAR(depth_of(eye, pointing.place_m()), 0.49, 1e-11);
  for (int k = 0; k < 1000; ++k) pointing.point(eye, {0.0, 0.0}, -0.01, depths);
  EXPECT_NEAR(depth_of(eye, pointing.place_m()), 0.3, 1e-11);
}

}  // namespace
}  // namespace palpate::desktop
