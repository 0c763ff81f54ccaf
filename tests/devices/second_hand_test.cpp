// The meaning of a SpaceMouse's bytes, and the motion of a volume that follows from them. No bus.
#include "module/haptics/servo/second_hand.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

#include "integration/devices/spacemouse_protocol.h"

namespace palpate::devices {
namespace {

using spacemouse::Reports;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kRounding = 1e-12;  // some tens of operations in double, on numbers near 1

using Bytes = std::vector<uint8_t>;

TEST(SpaceMouseReports, AreReadByTheLetter) {
  Reports reports;
  // As recorded from a SpaceNavigator: 0xffe2 is -30.
  EXPECT_TRUE(reports.read(Bytes{2, 0, 0, 0xe2, 0xff, 0, 0}));
  EXPECT_THAT(reports.axes(), ElementsAre(0, 0, 0, 0, -30, 0));
  EXPECT_TRUE(reports.read(Bytes{1, 0x5e, 0x01, 0, 0, 0xff, 0xff}));
  EXPECT_THAT(reports.axes(), ElementsAre(350, 0, -1, 0, -30, 0));
  EXPECT_TRUE(reports.read(Bytes{3, 3, 0}));
  EXPECT_EQ(reports.buttons(), 3U);
  // A model with more buttons than are supported.
  EXPECT_TRUE(reports.read(Bytes{3, 0, 0, 1, 0x80, 0xff}));
  EXPECT_EQ(reports.buttons(), 0x80010000U);
  EXPECT_EQ(reports.rejected(), 0U);
}

TEST(SpaceMouseReports, CarryAllSixAxesInNewerModels) {
  Reports reports;
  EXPECT_TRUE(reports.read(Bytes{1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0}));
  EXPECT_THAT(reports.axes(), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(SpaceMouseReports, ThatMeanNothingChangeNothing) {
  Reports reports;
  ASSERT_TRUE(reports.read(Bytes{1, 10, 0, 20, 0, 30, 0}));
  const std::vector<Bytes> none = {
      {},  {0},         {1},    {1, 1, 0, 1, 0, 1},     {2, 9, 9, 9, 9},
      {3}, {23, 99, 0}, {4, 1}, {255, 1, 2, 3, 4, 5, 6}};
  for (const Bytes& report : none) EXPECT_FALSE(reports.read(report));
  EXPECT_THAT(reports.axes(), ElementsAre(10, 20, 30, 0, 0, 0));
  EXPECT_EQ(reports.rejected(), none.size());
}

TEST(SpaceMouseReports, OfAnyBytesStayInRange) {
  std::mt19937 random(20261121);
  Reports reports;
  for (int n = 0; n < 200'000; ++n) {
    Bytes report(random() % 17);
    for (uint8_t& byte : report) byte = uint8_t(random());
    if (!report.empty()) report[0] = uint8_t(random() % 5);
    reports.read(report);
    for (const int axis : reports.axes()) ASSERT_LE(std::abs(axis), spacemouse::kFull) << n;
  }
}

glm::dvec3 speed(std::array<int, 3> axes) {
  return spacemouse::speed(axes, 8, 0.15);
}

TEST(SpaceMouseSpeed, TurnsThePucksAxesIntoTheWorlds) {
  // Right stays right, away from the user is -z, up (the puck's z is down) is +y.
  EXPECT_GT(speed({350, 0, 0}).x, 0.149);
  EXPECT_LT(speed({0, -350, 0}).z, -0.149);
  EXPECT_GT(speed({0, 0, -350}).y, 0.149);
  // No mirror image: the images of x, y and z are right-handed.
  const glm::dvec3 x = speed({350, 0, 0}), y = speed({0, 350, 0}), z = speed({0, 0, 350});
  EXPECT_LT(glm::distance(glm::cross(x, y) / 0.15, z), kRounding);
}

TEST(SpaceMouseSpeed, IsZeroInTheDeadZoneAndGrowsWithTheSquare) {
  EXPECT_EQ(speed({8, 0, 0}), glm::dvec3(0.0));
  EXPECT_EQ(speed({5, -5, 3}), glm::dvec3(0.0));
  EXPECT_GT(speed({9, 0, 0}).x, 0.0);
  EXPECT_NEAR(speed({8 + 171, 0, 0}).x, 0.15 / 4.0, kRounding);
  EXPECT_NEAR(glm::length(speed({350, 350, 350})), 0.15, kRounding);
}

TEST(SpaceMouseModels, AreAllInTheUdevRuleAndNoOthers) {
  std::ifstream file(PALPATE_UDEV_RULE);
  std::stringstream text;
  text << file.rdbuf();
  std::string rule = text.str();
  ASSERT_THAT(rule, HasSubstr("0403"));
  ASSERT_THAT(rule, HasSubstr("cb48"));
  size_t listed = 0;
  for (const auto& model : spacemouse::models()) {
    char vendor[8], product[8];
    std::snprintf(vendor, sizeof vendor, "\"%04x\"", model.vendor);
    std::snprintf(product, sizeof product, "%04x", model.product);
    std::istringstream lines(rule);
    bool found = false;
    for (std::string line; std::getline(lines, line);)
      found |= line.find(vendor) != std::string::npos && line.find(product) != std::string::npos;
    EXPECT_TRUE(found) << vendor << product;
    ++listed;
  }
  size_t separators = 0, lines_of_maker = 0;
  std::istringstream lines(rule);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("046d") == std::string::npos && line.find("256f") == std::string::npos) continue;
    ++lines_of_maker;
    separators += size_t(std::count(line.begin(), line.end(), '|'));
  }
  EXPECT_EQ(separators + lines_of_maker, listed);
  // A mouse with a wheel.
  EXPECT_EQ(spacemouse::model_of(0x046d, 0xc077), nullptr);
}

SecondHandReading going(glm::dvec3 linear, glm::dvec3 angular) {
  SecondHandReading hand;
  hand.linear_m_per_s = linear;
  hand.angular_rad_per_s = angular;
  hand.fault = DeviceFault::kNone;
  return hand;
}

Transform somewhere() {
  Transform from;
  from.translation_m = {0.02, -0.01, 0.03};
  from.rotation = glm::normalize(glm::dquat(0.9, 0.1, -0.3, 0.2));
  from.scale = {1.0, 2.0, 0.5};
  return from;
}

TEST(MovedBySecondHand, StaysToTheBitAtRest) {
  const Transform from = somewhere();
  const Transform to = moved(from, going({}, {}), 0.016, {0.01, 0.02, 0.03});
  EXPECT_EQ(to.translation_m, from.translation_m);
  EXPECT_EQ(to.rotation, from.rotation);
}

TEST(MovedBySecondHand, GoesAndTurnsAsFarAsItsSpeedSays) {
  Transform at;
  for (int n = 0; n < 60; ++n)
    at = moved(at, going({0.1, 0.0, 0.0}, {0.0, 0.0, std::numbers::pi / 2}), 1.0 / 60.0);
  EXPECT_NEAR(at.translation_m.x, 0.1, kRounding);
  // A quarter turn about z takes x to y (right-hand rule).
  EXPECT_LT(glm::distance(at.rotation * glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)), kRounding);
}

TEST(MovedBySecondHand, TurnsAboutThePivotAndKeepsTheScale) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int n = 0; n < 1000; ++n) {
    const Transform from = somewhere();
    const glm::dvec3 pivot = 0.05 * glm::dvec3(any(random), any(random), any(random));
    const glm::dvec3 turn = 3.0 * glm::dvec3(any(random), any(random), any(random));
    const Transform to = moved(from, going({}, turn), 0.02, pivot);
    ASSERT_LT(glm::distance(to.world_from_volume(pivot), from.world_from_volume(pivot)), kRounding)
        << "run " << n;
    ASSERT_NEAR(glm::length(to.rotation), 1.0, kRounding);
    ASSERT_EQ(to.scale, from.scale);
  }
}

TEST(MovedBySecondHand, KeepsThePivotWithinReach) {
  MoveLimits limits;
  limits.home_m = {0.0, 0.1, 0.0};
  limits.reach_m = 0.05;
  Transform at;
  at.translation_m = limits.home_m;
  for (int n = 0; n < 1000; ++n) {
    at = moved(at, going({1.0, 0.3, 0.0}, {}), 0.01, {}, limits);
    ASSERT_LE(glm::distance(at.translation_m, limits.home_m), limits.reach_m + kRounding);
  }
  // It slides along the border and does not stick, up to the point in the direction of the speed.
  EXPECT_LT(glm::distance(at.translation_m,
                          limits.home_m + 0.05 * glm::normalize(glm::dvec3(1.0, 0.3, 0.0))),
            1e-6);
  // A volume that is out of reach from the start does not jump back.
  at.translation_m = {0.0, 0.4, 0.0};
  const Transform out = moved(at, going({0.0, 0.1, 0.0}, {}), 0.01, {}, limits);
  EXPECT_LT(glm::distance(out.translation_m, at.translation_m), kRounding);
  const Transform back = moved(at, going({0.0, -0.1, 0.0}, {}), 0.01, {}, limits);
  EXPECT_NEAR(back.translation_m.y, 0.399, kRounding);
}

TEST(MovedBySecondHand, DoesNotMakeUpForALongPause) {
  const Transform to = moved({}, going({0.1, 0.0, 0.0}, {}), 60.0);
  EXPECT_NEAR(to.translation_m.x, 0.1 * MoveLimits().longest_step_s, kRounding);
  EXPECT_EQ(moved({}, going({0.1, 0.0, 0.0}, {}), -5.0).translation_m, glm::dvec3(0.0));
}

TEST(MovedBySecondHand, IgnoresWhatIsNoNumber) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double endless = std::numeric_limits<double>::infinity();
  for (const auto& hand : {going({none, 0, 0}, {}), going({}, {0, endless, 0})}) {
    const Transform to = moved(somewhere(), hand, 0.016);
    EXPECT_EQ(to.translation_m, somewhere().translation_m);
    EXPECT_EQ(to.rotation, somewhere().rotation);
  }
  EXPECT_EQ(moved({}, going({0.1, 0, 0}, {}), none).translation_m, glm::dvec3(0.0));
}

}  // namespace
}  // namespace palpate::devices
