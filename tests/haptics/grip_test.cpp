#include "module/haptics/grip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

GripReading turned() {
  GripReading grip;
  grip.turns = grip.opens = true;
  // A quarter about x: z goes to -y.
  grip.device_from_grip = glm::dquat(std::sqrt(0.5), std::sqrt(0.5), 0.0, 0.0);
  grip.angular_velocity_rad_per_s = {1.0, 2.0, 3.0};
  grip.opening_rad = 0.3;
  return grip;
}

TEST(Grip, IsBelievedAsItIsAndItsLengthIsCorrected) {
  GripReading grip = turned();
  grip.device_from_grip *= 1.009;
  const GripReading believed = believable(grip);
  EXPECT_TRUE(believed.turns && believed.opens);
  EXPECT_NEAR(glm::length(believed.device_from_grip), 1.0, 1e-15);
  EXPECT_EQ(believed.angular_velocity_rad_per_s, glm::dvec3(1.0, 2.0, 3.0));
  EXPECT_EQ(believed.opening_rad, 0.3);
  EXPECT_LT(glm::distance(shaft_of(believed), glm::dvec3(0.0, -1.0, 0.0)), 1e-15);
}

TEST(Grip, DoesNotBelieveWhatCanNotBe) {
  for (const glm::dquat& wrong : {glm::dquat(0.0, 0.0, 0.0, 0.0), glm::dquat(kNan, 0.0, 0.0, 0.0),
                                  glm::dquat(1.0, kInf, 0.0, 0.0), glm::dquat(1.2, 0.0, 0.0, 0.0),
                                  glm::dquat(0.98, 0.0, 0.0, 0.0)}) {
    GripReading grip = turned();
    grip.device_from_grip = wrong;
    const GripReading believed = believable(grip);
    EXPECT_FALSE(believed.turns) << wrong.w << ' ' << wrong.x;
    EXPECT_TRUE(believed.opens);
    EXPECT_EQ(believed.device_from_grip, glm::dquat(1.0, 0.0, 0.0, 0.0));
    EXPECT_EQ(shaft_of(believed), glm::dvec3(0.0));
  }
  GripReading spins = turned();
  spins.angular_velocity_rad_per_s.y = kNan;
  EXPECT_FALSE(believable(spins).turns);
  GripReading gapes = turned();
  gapes.opening_rad = kInf;
  EXPECT_FALSE(believable(gapes).opens);
  EXPECT_TRUE(believable(gapes).turns);
}

TEST(Grip, SensesNothingUnlessItSaysSo) {
  GripReading grip = turned();
  grip.turns = grip.opens = false;
  const GripReading believed = believable(grip);
  EXPECT_EQ(believed.device_from_grip, glm::dquat(1.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(believed.opening_rad, 0.0);
  EXPECT_EQ(shaft_of(GripReading()), glm::dvec3(0.0));
}

}  // namespace
}  // namespace palpate
