#include "integration/devices/scripted_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "integration/devices/simulated_paths.h"

namespace palpate::devices {
namespace {

using testing::HasSubstr;

std::string error_of(std::string_view text) {
  const auto path = parse_path("hand.csv", text);
  return path ? "" : path.error().message;
}

TEST(ScriptedPath, GivesItsPointsAtTheirTimesAndWaitsAtBothEnds) {
  const auto path = parse_path("hand.csv", "t_s,x_m,y_m,z_m,buttons\n1,0,0,0.5,0\n2,0.1,0,0.5,3\n");
  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(path->position_m(0.0), glm::dvec3(0, 0, 0.5));
  EXPECT_EQ(path->position_m(1.0), glm::dvec3(0, 0, 0.5));
  EXPECT_EQ(path->position_m(2.0), glm::dvec3(0.1, 0, 0.5));
  EXPECT_EQ(path->position_m(99.0), glm::dvec3(0.1, 0, 0.5));
  EXPECT_EQ(path->buttons(0.5), 0u);
  EXPECT_EQ(path->buttons(1.5), 0u);
  EXPECT_EQ(path->buttons(2.0), 3u);
  EXPECT_EQ(path->duration_s(), 2.0);
}

TEST(ScriptedPath, IsLinearWhereAskedFor) {
  const auto path =
      parse_path("hand.csv", "0,0,0,0\n2,0.2,0,0\n3,0.2,0.4,0\n", ScriptedPath::Between::kLinear);
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->position_m(0.5).x, 0.05, 1e-15);  // rounding of one multiplication
  EXPECT_NEAR(path->position_m(2.25).y, 0.1, 1e-15);
}

TEST(ScriptedPath, KeepsItsVelocityAcrossPointsWhenSmooth) {
  const auto path = parse_path("hand.csv", "0,0,0,0\n1,0.1,0.02,0\n1.5,0.3,0.01,0\n3,0.35,0,0\n");
  ASSERT_TRUE(path);
  const double h = 1e-6;
  for (const double t : {0.0, 1.0, 1.5, 3.0}) {
    const glm::dvec3 before = (path->position_m(t) - path->position_m(t - h)) / h;
    const glm::dvec3 after = (path->position_m(t + h) - path->position_m(t)) / h;
    // One-sided differences over h of a path with an acceleration below 10 m/s^2.
    EXPECT_NEAR(glm::distance(before, after), 0.0, 10.0 * h) << "at " << t;
  }
  // Where one coordinate reverses, it is at rest: y at t = 1.
  EXPECT_NEAR(path->position_m(1.0 + h).y, 0.02, 1e-10);
}

TEST(ScriptedPath, SaysWhatIsWrongWithALine) {
  EXPECT_THAT(error_of("0,0,0,0\n1,0,zero,0\n"),
              HasSubstr("'hand.csv' has no point in line 2 ('1,0,zero,0'): write"));
  EXPECT_THAT(error_of("0,0,0\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of("0,0,0,0,0,0\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of("0,0,0,0,-1\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of("0,0,0,0,4294967296\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of("0,nan,0,0\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of("# path\n\n0,0,0,0\n0,0,0,1\n"), HasSubstr("goes back in time in line 4"));
  EXPECT_THAT(error_of("0,25,0,0\n"), HasSubstr("positions are in metres"));
  EXPECT_THAT(error_of("# nothing\n"), HasSubstr("holds no points"));
  EXPECT_THAT(error_of("t,x,y,z\nt,x,y,z\n"), HasSubstr("line 2"));
}

TEST(ScriptedPath, IsReadFromAFileAndMissingOnesAreSaid) {
  const auto file = std::filesystem::temp_directory_path() / "palpate_scripted_path_test.csv";
  std::ofstream(file) << "0,0,0,0\r\n1,0.01,0,0\r\n";
  const auto path = read_path(file);
  ASSERT_TRUE(path) << path.error().message;
  EXPECT_EQ(path->points().size(), 2u);
  std::filesystem::remove(file);
  const auto missing = read_path(file);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("does not exist"));
  const auto neither = path_named("wobble", {});
  ASSERT_FALSE(neither);
  EXPECT_THAT(neither.error().message, HasSubstr("'wobble' is no file and no path of ours"));
}

TEST(MadePaths, StayAtTheSpeedAndInThePlaceAskedFor) {
  PathPlace place;
  place.surface_m = {0.01, 0.0, -0.01};
  place.outward = {0.0, 0.0, 2.0};
  place.times = 2;
  const glm::dvec3 out(0, 0, 1);
  for (const char* name : {"press", "tap", "stroke", "circle", "sweep"}) {
    const auto path = path_named(name, place);
    ASSERT_TRUE(path) << name;
    EXPECT_NEAR(glm::dot(path->position_m(0.0) - place.surface_m, out), place.clearance_m, 1e-12);
    double deepest = 1.0, farthest = 0.0, fastest = 0.0;
    const double h = 1e-4;
    for (double t = 0.0; t < path->duration_s(); t += h) {
      const glm::dvec3 from = path->position_m(t) - place.surface_m;
      const double height = glm::dot(from, out);
      deepest = std::min(deepest, height);
      farthest = std::max(farthest, glm::length(from - out * height));
      fastest = std::max(fastest, glm::length(path->position_m(t + h) - path->position_m(t)) / h);
    }
    EXPECT_NEAR(deepest, -place.depth_m, 1e-9) << name;
    const bool strokes = name == std::string("stroke") || name == std::string("circle");
    // 72 corners are on the circle; the curve between them is inside it by less than a thousandth.
    EXPECT_NEAR(farthest, strokes ? place.reach_m : 0.0, 1e-3 * place.reach_m) << name;
    // A cubic that rests at both ends is 1.5 times as fast in the middle.
    EXPECT_LE(fastest, 1.5 * place.speed_m_per_s * (1.0 + 1e-3)) << name;
    EXPECT_GE(fastest, place.speed_m_per_s * (1.0 - 1e-3)) << name;
  }
}

TEST(MadePaths, SweepIsEvenlyFast) {
  PathPlace place;
  place.hold_s = 0.5;
  const ScriptedPath path = sweep_path(place);
  const double way_s = (place.clearance_m + place.depth_m) / place.speed_m_per_s;
  for (double t = 0.51; t < 0.5 + way_s - 0.02; t += 0.01) {
    const double speed = glm::length(path.position_m(t + 0.01) - path.position_m(t)) / 0.01;
    EXPECT_NEAR(speed, place.speed_m_per_s, 1e-9);
  }
}

TEST(MadePaths, FindADirectionAlongTheSurfaceWhenNoneIsGiven) {
  PathPlace place;
  place.along = place.outward;
  const ScriptedPath path = stroke_path(place);
  double farthest = 0.0;
  for (const auto& point : path.points())
    farthest = std::max(farthest, std::abs(point.position_m.x) + std::abs(point.position_m.z));
  EXPECT_NEAR(farthest, place.reach_m, 1e-12);
}

}  // namespace
}  // namespace palpate::devices
