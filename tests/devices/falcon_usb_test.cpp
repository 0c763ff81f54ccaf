// A Falcon from plugging in to pulling out, through the real libusb.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/devices/falcon_kinematics.h"
#include "tests/devices/falcon_loop.h"

namespace palpate::devices::test {
namespace {

TEST(Falcon, GivesPositionAndTakesForce) {
  EmulatedFalcon falcon;
  falcon.place({0.010, -0.005, 0.120});
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  // Half a count of each encoder is 22 um along its own direction.
  EXPECT_LT(glm::distance(loop.last.position_m, glm::dvec3(0.010, -0.005, 0.120)), 60e-6);
  EXPECT_EQ(device->info().place, "usb 1-1");
  EXPECT_EQ(falcon.malformed(), 0U);
  const auto motors = falcon.last().motors;
  const auto rows = falcon::jacobian(*falcon::inverse(loop.last.position_m));
  const glm::dvec3 felt =
      falcon::force_of(*rows, {int16_t(motors[0]), int16_t(motors[1]), int16_t(motors[2])});
  EXPECT_LT(glm::distance(felt, loop.wanted_n), 0.006);  // half a motor count, three times
}

}  // namespace
}  // namespace palpate::devices::test
