// A SpaceMouse from plugging in to unplugging, through the real libusb.
#include "integration/devices/spacemouse.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/devices/as_nobody.h"
#include "tests/devices/emulated_spacemouse.h"
#include "tests/devices/print_fault.h"
#include "tests/support/wait_for.h"

namespace palpate::devices::test {
namespace {

/// Waits longer for silence, so that a busy machine does not count as silent.
SpaceMouseOptions patient() {
  SpaceMouseOptions options;
  options.silence_ns = 5'000'000'000;
  return options;
}

bool at_rest(const SecondHandReading& reading) {
  return reading.linear_m_per_s == glm::dvec3(0.0) && reading.angular_rad_per_s == glm::dvec3(0.0);
}

bool ready(const SpaceMouse& mouse) {
  return wait_for([&] { return mouse.read().fault == DeviceFault::kNone; });
}

bool moves(const SpaceMouse& mouse) {
  return wait_for([&] { return !at_rest(mouse.read()); });
}

bool stops(const SpaceMouse& mouse) {
  return wait_for([&] { return at_rest(mouse.read()); });
}

bool has_fault(const SpaceMouse& mouse, DeviceFault fault) {
  return wait_for([&] { return mouse.read().fault == fault; });
}

TEST(SpaceMouse, TurnsAndMovesAsThePuckDoes) {
  for (const bool six : {false, true}) {
    SCOPED_TRACE(six ? "six axes in one report" : "two reports");
    EmulatedSpaceMouse puck({.six_axes_in_one = six});
    puck.plug();
    const SpaceMouse mouse(patient());
    ASSERT_TRUE(ready(mouse));
    EXPECT_TRUE(at_rest(mouse.read()));
    puck.push({350, 0, 0, 0, 0, -350});
    ASSERT_TRUE(wait_for([&] {
      const auto reading = mouse.read();
      return reading.linear_m_per_s.x > 0.0 && reading.angular_rad_per_s.y > 0.0;
    }));
    const SecondHandReading reading = mouse.read();
    // Full deflection gives full speed; the tolerance is rounding.
    EXPECT_LT(glm::distance(reading.linear_m_per_s, glm::dvec3(0.15, 0, 0)), 1e-12);
    EXPECT_LT(glm::distance(reading.angular_rad_per_s, glm::dvec3(0, 1.5, 0)), 1e-12);
    puck.push({});
    EXPECT_TRUE(stops(mouse));
    EXPECT_EQ(mouse.info().address, puck.place());
    EXPECT_EQ(mouse.info().name, "3Dconnexion SpaceNavigator");
  }
}

TEST(SpaceMouse, TellsItsButtons) {
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse mouse;
  ASSERT_TRUE(ready(mouse));
  puck.press(0x3);
  EXPECT_TRUE(wait_for([&] { return mouse.read().buttons == 0x3; }));
  puck.press(0);
  EXPECT_TRUE(wait_for([&] { return mouse.read().buttons == 0; }));
}

TEST(SpaceMouse, TakesSilenceForRest) {
  EmulatedSpaceMouse puck;
  puck.plug();
  SpaceMouseOptions options;
  options.silence_ns = 300'000'000;
  const SpaceMouse mouse(options);
  ASSERT_TRUE(ready(mouse));
  puck.push({0, 0, 200, 0, 0, 0});
  ASSERT_TRUE(moves(mouse));
  // The last report was a motion.
  puck.fall_silent();
  EXPECT_TRUE(stops(mouse));
  EXPECT_EQ(mouse.read().fault, DeviceFault::kNone);
  puck.push({0, 0, 200, 0, 0, 0});
  EXPECT_TRUE(moves(mouse));
}

TEST(SpaceMouse, RestsWhenUnpluggedAndGoesOnWhenPluggedInAgain) {
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse mouse(patient());
  ASSERT_TRUE(ready(mouse));
  for (int round = 0; round < 3; ++round) {
    puck.push({0, 300, 0, 0, 0, 0});
    ASSERT_TRUE(moves(mouse));
    puck.unplug();
    ASSERT_TRUE(has_fault(mouse, DeviceFault::kUnplugged));
    EXPECT_TRUE(at_rest(mouse.read()));
    puck.plug();
    ASSERT_TRUE(ready(mouse));
    EXPECT_TRUE(at_rest(mouse.read())) << "the earlier motion must not go on";
  }
  EXPECT_EQ(mouse.counts().opened, 4U);
}

TEST(SpaceMouse, IsTakenFromTheKernelAndGivenBack) {
  EmulatedSpaceMouse puck;
  puck.bind_kernel_driver("usbhid");
  puck.plug();
  {
    const SpaceMouse mouse(patient());
    ASSERT_TRUE(ready(mouse));
    EXPECT_EQ(puck.kernel_driver(), "");
    puck.push({100, 0, 0, 0, 0, 0});
    EXPECT_TRUE(moves(mouse));
  }
  EXPECT_EQ(puck.kernel_driver(), "usbhid");
}

TEST(SpaceMouse, SaysThatAnotherProgramHoldsItAndTakesItWhenItIsFree) {
  EmulatedSpaceMouse puck;
  puck.claim_elsewhere(true);
  puck.plug();
  const SpaceMouse mouse;
  ASSERT_TRUE(has_fault(mouse, DeviceFault::kBusy));
  puck.claim_elsewhere(false);
  EXPECT_TRUE(ready(mouse));
}

TEST(SpaceMouse, SaysThatItMayNotOpenIt) {
  EmulatedSpaceMouse puck;
  puck.plug();
  puck.permit(false);
  std::optional<AsNobody> nobody(std::in_place);
  const SpaceMouse mouse;
  // Its thread keeps the ordinary user's rights.
  nobody.reset();
  ASSERT_TRUE(has_fault(mouse, DeviceFault::kNoPermission));
  puck.permit(true);
  EXPECT_TRUE(ready(mouse));
}

TEST(SpaceMouse, ClearsAStallAndGoesOn) {
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse mouse(patient());
  ASSERT_TRUE(ready(mouse));
  puck.stall();
  ASSERT_TRUE(wait_for([&] { return puck.resets_of_halts() == 1; }));
  puck.push({0, 0, 0, 250, 0, 0});
  EXPECT_TRUE(moves(mouse));
  EXPECT_EQ(mouse.counts().opened, 1U);
}

TEST(SpaceMouse, RestsWhileItStallsForEver) {
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse mouse(patient());
  ASSERT_TRUE(ready(mouse));
  puck.push({0, 0, 0, 250, 0, 0});
  ASSERT_TRUE(moves(mouse));
  puck.stall_ever();
  ASSERT_TRUE(has_fault(mouse, DeviceFault::kTransfer));
  EXPECT_TRUE(at_rest(mouse.read()));
}

TEST(SpaceMouse, PassesOverReportsThatMeanNothing) {
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse mouse(patient());
  ASSERT_TRUE(ready(mouse));
  puck.push({0, 0, 0, 0, 0, 300});
  ASSERT_TRUE(moves(mouse));
  puck.say({});
  puck.say({1, 7});
  puck.say({23, 80});
  ASSERT_TRUE(wait_for([&] { return mouse.counts().rejected == 3; }));
  EXPECT_FALSE(at_rest(mouse.read()));
}

TEST(SpaceMouse, EndsWhileItIsBeingPushedAndWithNoneAtAll) {
  { const SpaceMouse mouse; }
  EmulatedSpaceMouse puck;
  puck.plug();
  const SpaceMouse first(patient());
  ASSERT_TRUE(ready(first));
  puck.push({1, 2, 3, 40, 50, 60});
  ASSERT_TRUE(moves(first));
}

}  // namespace
}  // namespace palpate::devices::test
