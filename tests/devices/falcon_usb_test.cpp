// A Falcon from plugging in to unplugging, through the real libusb: its functions without faults,
// and its start.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "integration/devices/falcon_kinematics.h"
#include "integration/devices/falcon_protocol.h"
#include "tests/devices/as_nobody.h"
#include "tests/devices/falcon_loop.h"
#include "tests/devices/image_file.h"

namespace palpate::devices::test {
namespace {

// Half a count of each encoder is 22 um along its own direction.
constexpr double kCount_m = 60e-6;

TEST(Falcon, GivesPositionAndTakesForce) {
  EmulatedFalcon falcon;
  falcon.place({0.010, -0.005, 0.120});
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_LT(glm::distance(loop.last.position_m, glm::dvec3(0.010, -0.005, 0.120)), kCount_m);
  EXPECT_EQ(device->info().address, "usb 1-1");
  EXPECT_EQ(falcon.malformed(), 0U);
  const auto motors = falcon.last().motors;
  const auto rows = falcon::jacobian(*falcon::inverse(loop.last.position_m));
  const glm::dvec3 felt =
      falcon::force_of(*rows, {int16_t(motors[0]), int16_t(motors[1]), int16_t(motors[2])});
  // Half a motor count, three times.
  EXPECT_LT(glm::distance(felt, loop.wanted_n), 0.006);
}

/// Moves the grip before each exchange and checks that the answer has the new place. One answer
/// left over would make every later one an exchange old.
void expect_fresh_answers(FalconLoop& loop, EmulatedFalcon& falcon) {
  for (int n = 0; n < 20; ++n) {
    const glm::dvec3 place(0.0, n % 2 ? 0.4e-3 : -0.4e-3, 0.130);
    loop.each = [&] { falcon.place(place); };
    loop.step();
    // If the machine stood still for longer than the waiting time, or than a host may be away, the
    // loop asks again.
    const auto answered = [&] { return loop.last.fresh && loop.last.fault == DeviceFault::kNone; };
    if (!answered()) {
      ASSERT_TRUE(loop.until(answered, "an answer"));
    }
    EXPECT_LT(glm::distance(loop.last.position_m, place), kCount_m) << "exchange " << n;
  }
  loop.each = nullptr;
}

TEST(Falcon, AnswersWithThePositionOfNow) {
  EmulatedFalcon falcon;
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  expect_fresh_answers(loop, falcon);
}

TEST(Falcon, AnswersWithThePositionOfNowAfterAnswersThatCameTooLate) {
  EmulatedFalcon falcon;
  falcon.plug();
  FalconOptions options = patient();
  options.answer_wait_ns = 20'000'000;
  const auto device = opened(options);
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  // Three answers come after their exchange has ended, the last one also after the next exchange.
  falcon.delay_next({50'000'000, 50'000'000, 70'000'000});
  loop.run(4);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_TRUE(loop.until_pushing());
  expect_fresh_answers(loop, falcon);
}

TEST(Falcon, AnswersWithThePositionOfNowAfterAStall) {
  EmulatedFalcon falcon;
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  falcon.change([](auto& faults) { faults.stall_in = true; });
  ASSERT_TRUE(loop.until_fault(DeviceFault::kTransfer));
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_EQ(device->counts().opened, 1U);
  expect_fresh_answers(loop, falcon);
}

TEST(Falcon, TurnsItsAnswersAroundByTheEventCharacter) {
  EmulatedFalcon falcon;
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_TRUE(falcon.event_character_on());
  EXPECT_EQ(falcon.latency_ms(), 1);
  EXPECT_TRUE(device->counts().event_character);
}

TEST(Falcon, WorksWithoutTheEventCharacter) {
  EmulatedFalcon falcon;
  falcon.set({.no_event_character = true});
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_FALSE(device->counts().event_character);
  expect_fresh_answers(loop, falcon);
}

TEST(Falcon, GivesNoForceBeforeItIsHomed) {
  EmulatedFalcon falcon({.homed = false});
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_fault(DeviceFault::kNotHomed));
  loop.run(300);
  EXPECT_EQ(loop.last.fault, DeviceFault::kNotHomed);
  EXPECT_EQ(falcon.last().lights, falcon::kRed);
  EXPECT_TRUE(falcon.last().homing);
  // All the way out, all the way in.
  for (const int counts : {1000, -1000}) {
    falcon.set_counts({counts, counts, counts});
    loop.run(5);
  }
  EXPECT_EQ(loop.last.fault, DeviceFault::kStarting);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_EQ(falcon.last().lights, falcon::kBlue);
  EXPECT_FALSE(falcon.last().homing);
  loop.in_contact = false;
  loop.step();
  EXPECT_EQ(falcon.last().lights, falcon::kGreen);
}

TEST(Falcon, TellsItsButtons) {
  EmulatedFalcon falcon;
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  for (const int buttons : {1, 2, 4, 8, 15, 0}) {
    falcon.press(buttons);
    EXPECT_EQ(loop.step().buttons, uint32_t(buttons));
  }
}

TEST(Falcon, TakesItsMotorsToZeroWhenItIsClosed) {
  EmulatedFalcon falcon;
  falcon.plug();
  {
    const auto device = opened(patient());
    FalconLoop loop(*device, falcon);
    ASSERT_TRUE(loop.until_pushing());
  }
  EXPECT_FALSE(falcon.last().pushes());
}

TEST(Falcon, LoadsTheUsersFirmwareThoughGreetingsFail) {
  const ImageFile image(made_image(500));
  EmulatedFalcon falcon({.firmware = false, .image = image.bytes()});
  // A greeting is tried a hundred times, so 30 failures are within one upload.
  falcon.set({.failing_uploads = 30});
  falcon.plug();
  FalconOptions options = patient();
  options.firmware_file = image.path();
  const auto device = opened(options);
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_TRUE(falcon.runs_firmware());
  EXPECT_EQ(falcon.uploads(), 1);
  EXPECT_TRUE(falcon.event_character_on()) << "the settings for packets must come back";
}

TEST(Falcon, LoadsFirmwareAgainAfterAPowerCut) {
  const ImageFile image(made_image(200));
  EmulatedFalcon falcon({.image = image.bytes()});
  falcon.plug();
  FalconOptions options = patient();
  options.answer_wait_ns = 15'000'000;
  options.firmware_file = image.path();
  const auto device = opened(options);
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  falcon.power_cycle();
  ASSERT_TRUE(loop.until_fault(DeviceFault::kTimeout));
  ASSERT_TRUE(loop.until_fault(DeviceFault::kNotHomed));
  // More than one if the machine stood still for longer than an image may take.
  EXPECT_GE(falcon.uploads(), 1);
}

TEST(Falcon, SaysThatItHasNoFirmware) {
  EmulatedFalcon falcon({.firmware = false});
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  EXPECT_TRUE(loop.until_fault(DeviceFault::kNoFirmware));
}

TEST(Falcon, TriesAnImageThatTheDeviceDoesNotTakeAgain) {
  const ImageFile image(made_image(100));
  EmulatedFalcon falcon({.firmware = false, .image = made_image(300)});
  falcon.plug();
  FalconOptions options = patient();
  options.firmware_file = image.path();
  const auto device = opened(options);
  FalconLoop loop(*device, falcon);
  // All ten tries take ten seconds; the test only needs a second try.
  ASSERT_TRUE(loop.until([&] { return falcon.uploads() >= 2; }, "a second try"));
  EXPECT_EQ(loop.last.fault, DeviceFault::kStarting);
  EXPECT_FALSE(falcon.runs_firmware());
}

TEST(Falcon, RefusesFirmwareFilesThatAreNone) {
  FalconOptions options;
  options.firmware_file = "/nowhere/falcon.bin";
  const auto none = FalconDevice::make(options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(none.error().message, testing::HasSubstr("/nowhere/falcon.bin"));
  const ImageFile huge(made_image((1 << 20) + 1));
  options.firmware_file = huge.path();
  const auto large = FalconDevice::make(options);
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().message, testing::HasSubstr("too large"));
}

TEST(Falcon, IsOnTheBusAsLongAsItIsPluggedInWhetherItMayBeOpenedOrNot) {
  EmulatedFalcon falcon;
  EXPECT_FALSE(FalconDevice::is_plugged_in());
  falcon.plug();
  EXPECT_TRUE(FalconDevice::is_plugged_in());
  falcon.permit(false);
  EXPECT_TRUE(FalconDevice::is_plugged_in());
  falcon.unplug();
  EXPECT_FALSE(FalconDevice::is_plugged_in());
}

TEST(Falcon, SaysThatItMayNotOpenItAndOpensItWhenItMay) {
  EmulatedFalcon falcon;
  falcon.plug();
  falcon.permit(false);
  std::optional<AsNobody> nobody(std::in_place);
  const auto device = opened(patient());
  // Its thread keeps the ordinary user's rights.
  nobody.reset();
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_fault(DeviceFault::kNoPermission));
  falcon.permit(true);
  EXPECT_TRUE(loop.until_pushing());
}

TEST(Falcon, LeavesAloneWhatOnlyHasItsId) {
  EmulatedFalcon relay({.product_name = "USB Relay", .port = 1});
  EmulatedFalcon falcon({.port = 2});
  relay.plug();
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_EQ(device->info().address, "usb 1-2");
  EXPECT_EQ(relay.received_count(), 0U);
}

TEST(Falcon, TakesTheSecondOneIfAnotherProgramHasTheFirst) {
  EmulatedFalcon held({.port = 1}), falcon({.port = 2});
  held.claim_elsewhere(true);
  held.plug();
  falcon.plug();
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  EXPECT_EQ(device->info().address, "usb 1-2");
}

TEST(Falcon, IsTwoDevicesWhereTwoArePluggedIn) {
  EmulatedFalcon left({.port = 1}), right({.port = 2});
  left.place({0, 0, 0.120});
  right.place({0, 0, 0.140});
  left.plug();
  right.plug();
  FalconOptions options = patient();
  options.address = "usb 1-2";
  const auto of_right = opened(options);
  options.address = "usb 1-1";
  const auto of_left = opened(options);
  FalconLoop left_loop(*of_left, left), right_loop(*of_right, right);
  ASSERT_TRUE(left_loop.until_pushing());
  ASSERT_TRUE(right_loop.until_pushing());
  EXPECT_LT(glm::distance(left_loop.last.position_m, {0, 0, 0.120}), kCount_m);
  EXPECT_LT(glm::distance(right_loop.last.position_m, {0, 0, 0.140}), kCount_m);
}

TEST(Falcon, IsTakenFromTheKernelsDriverAndGivenBack) {
  EmulatedFalcon falcon;
  falcon.bind_kernel_driver("ftdi_sio");
  falcon.plug();
  {
    const auto device = opened(patient());
    FalconLoop loop(*device, falcon);
    ASSERT_TRUE(loop.until_pushing());
    EXPECT_EQ(falcon.kernel_driver(), "");
  }
  EXPECT_EQ(falcon.kernel_driver(), "ftdi_sio");
}

TEST(Falcon, CutsTheForceWhenNobodyExchangesAnyMore) {
  EmulatedFalcon falcon;
  falcon.plug();
  FalconOptions options = patient();
  options.away_ns = 100'000'000;
  const auto device = opened(options);
  FalconLoop loop(*device, falcon);
  ASSERT_TRUE(loop.until_pushing());
  ASSERT_TRUE(wait_for([&] { return !falcon.last().pushes(); }));
  // More than one if the machine stood still for so long while the force came in.
  EXPECT_GE(device->counts().cuts, 1U);
  EXPECT_EQ(loop.step().fault, DeviceFault::kTimeout)
      << "a loop that comes back must get the fault";
  ASSERT_TRUE(loop.until_pushing());
  expect_fresh_answers(loop, falcon);
}

TEST(Falcon, IsLookedForWhileThereIsNone) {
  EmulatedFalcon falcon;
  const auto device = opened(patient());
  FalconLoop loop(*device, falcon);
  loop.run(5);
  EXPECT_EQ(loop.last.fault, DeviceFault::kNotOpened);
  EXPECT_FALSE(loop.last.fresh);
  falcon.plug();
  EXPECT_TRUE(loop.until_pushing());
}

}  // namespace
}  // namespace palpate::devices::test
