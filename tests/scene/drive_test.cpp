#include "module/scene/drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate {
namespace {

DriveSpec keyed(KeyedPose pose) {
  DriveSpec drive;
  drive.kind = DriveSpec::Kind::kKeys;
  drive.poses = {std::move(pose)};
  return drive;
}

KeyedPose to_and_fro(bool loop) {
  KeyedPose pose;
  pose.translation_m = {
      {0.25, 0.5, 0.5, 1.0}, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}}, 4.0, loop};
  return pose;
}

TEST(Drive, KeysAreBlendedAndStayAtTheirEnds) {
  const DriveSpec over = keyed(to_and_fro(true)), once = keyed(to_and_fro(false));
  const auto x = [](const DriveSpec& drive, double time_s) {
    return driven(drive, {}, time_s).translation_m.x;
  };
  // Before the first key.
  EXPECT_EQ(x(over, 0.0), 0.0);
  EXPECT_EQ(x(over, 1.5), 0.5);
  // At a step the later one.
  EXPECT_EQ(x(over, 2.0), 2.0);
  EXPECT_EQ(x(over, 3.0), 1.0);
  EXPECT_EQ(x(over, 5.5), 0.5);
  EXPECT_EQ(x(once, 3.0), 1.0);
  EXPECT_EQ(x(once, 5.5), 0.0);
  EXPECT_EQ(x(once, 1e9), 0.0);
  EXPECT_EQ(x(once, -1.0), 0.0);
  // NaN is not a time.
  EXPECT_EQ(x(over, std::numeric_limits<double>::quiet_NaN()), 0.0);
}

TEST(Drive, RotationsTakeTheShorterWayAtAnEvenSpeed) {
  KeyedPose pose;
  pose.rotation = {
      {0.0, 1.0}, {glm::dquat(1, 0, 0, 0), -glm::angleAxis(2.0, glm::dvec3(0, 1, 0))}, 1.0, false};
  for (const double t : {0.0, 0.2, 0.7, 1.0}) {
    const glm::dvec3 at = driven(keyed(pose), {}, t).world_from_volume({1, 0, 0});
    EXPECT_LT(glm::length(at - glm::dvec3(std::cos(2 * t), 0, -std::sin(2 * t))), 1e-12);
  }
}

TEST(Drive, RefusesKeysThatCanNotBeFollowed) {
  EXPECT_TRUE(check(keyed(to_and_fro(true)), {}));
  const auto refused = [](auto change) {
    KeyedPose pose = to_and_fro(true);
    change(pose);
    return !check(keyed(pose), {});
  };
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.values.pop_back(); }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.cycle_s = 0.0; }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.keys[1] = 0.1; }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.keys[3] = 1.1; }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.keys[0] = std::nan(""); }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.translation_m.values[0].x = std::nan(""); }));
  EXPECT_TRUE(refused([](KeyedPose& p) {
    p.rotation = {{0.0}, {glm::dquat(2, 0, 0, 0)}, 1.0, true};
  }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.scale = {{0.0}, {{1, 0, 1}}, 1.0, true}; }));
  EXPECT_TRUE(refused([](KeyedPose& p) { p.pose.scale = {1e9, 1, 1}; }));
}

TEST(Drive, RefusesTransformsThatTogetherLeadTooFar) {
  KeyedPose large;
  large.pose.scale = glm::dvec3(200.0);
  DriveSpec drive = keyed(large);
  EXPECT_TRUE(check(drive, {}));
  drive.poses.push_back(large);
  EXPECT_FALSE(check(drive, {}));
  KeyedPose far;
  far.pose.translation_m.x = 1e300;
  EXPECT_FALSE(check(keyed(far), {}));
}

TEST(Drive, RefusesWhatWouldShear) {
  KeyedPose uneven;
  uneven.scale = {{0.0, 1.0}, {{1, 1, 1}, {1, 2, 1}}, 1.0, true};
  Transform turned;
  turned.rotation = glm::angleAxis(0.5, glm::dvec3(0, 0, 1));
  EXPECT_TRUE(check(keyed(uneven), {}));
  EXPECT_FALSE(check(keyed(uneven), turned));
  DriveSpec drive = keyed(uneven);
  drive.poses.emplace_back();
  drive.poses.back().rotation = {{0.0}, {glm::dquat(1, 0, 0, 0)}, 1.0, true};
  EXPECT_FALSE(check(drive, {}));
}

}  // namespace
}  // namespace palpate
