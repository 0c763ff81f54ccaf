// Oracle: the geometry of a ball and a cone, and properties of every camera.

#include "integration/desktop/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "integration/desktop/pointing.h"

namespace palpate::desktop {
namespace {

// Of a few double operations on numbers of about 1.
constexpr double kRounding = 1e-12;

TEST(Camera, SeesTheWholeBallAtFirst) {
  const Camera camera = camera_before({0.1, -0.2, 0.3}, 0.05);
  // The ball's silhouette is at an angle of asin(r / d), within half the picture's angle.
  const double half_angle = std::asin(0.05 / camera.distance_m);
  EXPECT_LT(half_angle, 0.5 * camera.height_angle);
  EXPECT_GT(half_angle, 0.8 * 0.5 * camera.height_angle) << "it fills the picture";
}

TEST(Camera, LooksAtItsTargetFromItsDistanceWhereverItIs) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> turn(-4.0, 4.0), place(-1.0, 1.0);
  for (int k = 0; k < 1000; ++k) {
    Camera camera = camera_before({place(random), place(random), place(random)}, 0.1);
    for (int t = 0; t < 5; ++t) camera = orbit(camera, turn(random), turn(random));
    const Eye eye = eye_of(camera, {640, 480});
    EXPECT_NEAR(glm::distance(eye.position_m, camera.target_m), camera.distance_m, kRounding) << k;
    const InPicture seen = cursor_over(eye, camera.target_m);
    EXPECT_NEAR(glm::length(seen), 0.0, 1e-9) << k;
    // Upright: the eye's own x axis is horizontal.
    EXPECT_NEAR((eye.orientation * glm::dvec3(1.0, 0.0, 0.0)).y, 0.0, kRounding) << k;
    EXPECT_LE(std::abs(camera.elevation), kSteepest) << k;
    EXPECT_LE(std::abs(camera.azimuth), std::numbers::pi) << k;
  }
}

TEST(Camera, TurnsToTheRightAndUpwards) {
  Camera camera;
  EXPECT_NEAR(eye_of(camera, {64, 64}).position_m.z, camera.distance_m, kRounding);
  const glm::dvec3 right = eye_of(orbit(camera, 0.5, 0.0), {64, 64}).position_m;
  EXPECT_NEAR(right.x, camera.distance_m * std::sin(0.5), kRounding);
  const glm::dvec3 above = eye_of(orbit(camera, 0.0, 0.5), {64, 64}).position_m;
  EXPECT_NEAR(above.y, camera.distance_m * std::sin(0.5), kRounding);
}

TEST(Camera, ComesBackByTheOppositeTurn) {
  const Camera camera = camera_before(glm::dvec3(0.0), 0.1);
  const Camera back = orbit(orbit(camera, 2.0, 0.3), -2.0, -0.3);
  EXPECT_NEAR(back.azimuth, camera.azimuth, kRounding);
  EXPECT_NEAR(back.elevation, camera.elevation, kRounding);
}

TEST(Camera, ZoomsWithinItsLimits) {
  const Camera camera = camera_before(glm::dvec3(0.0), 0.1);
  EXPECT_DOUBLE_EQ(zoom(camera, 0.5).distance_m, 0.5 * camera.distance_m);
  EXPECT_EQ(zoom(camera, 1e-9).distance_m, camera.nearest_m);
  EXPECT_EQ(zoom(camera, 1e9).distance_m, camera.furthest_m);
}

TEST(Camera, StaysAsItIsForWhatIsNoTurn) {
  const Camera camera = camera_before(glm::dvec3(0.0), 0.1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(orbit(camera, nan, 0.0), camera);
  EXPECT_EQ(orbit(camera, 0.0, infinite), camera);
  for (const double factor : {nan, 0.0, -1.0, infinite}) EXPECT_EQ(zoom(camera, factor), camera);
  EXPECT_TRUE(std::isfinite(camera_before(glm::dvec3(0.0), nan).distance_m));
}

}  // namespace
}  // namespace palpate::desktop
