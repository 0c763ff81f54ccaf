// The input of `palpate devices`: everything that may be plugged in, with and without faults.
#include "integration/devices/list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/devices/polhem.h"
#include "tests/devices/as_nobody.h"
#include "tests/devices/emulated_falcon.h"
#include "tests/devices/emulated_spacemouse.h"

namespace palpate::devices::test {
namespace {

using testing::HasSubstr;
using Role = ListedDevice::Role;

/// The devices on the emulated bus and the simulated one: those of a service or a library of this
/// machine are not part of these tests.
DeviceList list_bus() {
  DeviceList list = list_devices();
  std::erase_if(list.devices, [](const ListedDevice& device) {
    return device.usb_id.empty() && device.info.kind != "simulated";
  });
  return list;
}

ListedDevice only() {
  const DeviceList list = list_bus();
  EXPECT_EQ(list.devices.size(), 2U);
  EXPECT_EQ(list.devices.back().info.kind, "simulated");
  return list.devices.front();
}

TEST(DeviceList, HasASimulatedOneAlways) {
  const DeviceList list = list_bus();
  ASSERT_EQ(list.devices.size(), 1U);
  EXPECT_EQ(list.devices[0].info.kind, "simulated");
  EXPECT_TRUE(list.devices[0].usable);
  EXPECT_GT(list.devices[0].info.max_force_n, 0.0);
}

TEST(DeviceList, SaysWhatAHealthyFalconCanDo) {
  EmulatedFalcon falcon;
  falcon.plug();
  const ListedDevice found = only();
  EXPECT_EQ(found.info.kind, "falcon");
  EXPECT_EQ(found.info.address, "usb 1-1");
  EXPECT_EQ(found.usb_id, "0403:cb48");
  EXPECT_TRUE(found.usable) << found.wrong;
  EXPECT_EQ(found.notes, "");
  EXPECT_GT(found.info.max_force_n, 4.0);
  EXPECT_FALSE(falcon.last().pushes());
}

TEST(DeviceList, SaysHowToHome) {
  EmulatedFalcon falcon({.homed = false});
  falcon.plug();
  const ListedDevice found = only();
  EXPECT_TRUE(found.usable);
  EXPECT_THAT(found.notes, HasSubstr("push it all the way in"));
}

TEST(DeviceList, SaysWhereFirmwareComesFrom) {
  EmulatedFalcon falcon({.firmware = false});
  falcon.plug();
  const ListedDevice found = only();
  EXPECT_FALSE(found.usable);
  EXPECT_THAT(found.wrong, HasSubstr("driver disc or SDK and give it with `falcon_firmware`."));
}

TEST(DeviceList, NamesTheUdevRuleWithoutPermission) {
  EmulatedFalcon falcon;
  falcon.plug();
  falcon.permit(false);
  const AsNobody nobody;
  const ListedDevice found = only();
  EXPECT_FALSE(found.usable);
  EXPECT_THAT(found.wrong, HasSubstr("60-palpate.rules"));
}

TEST(DeviceList, SaysThatAnotherProgramHoldsIt) {
  EmulatedFalcon falcon;
  falcon.claim_elsewhere(true);
  falcon.plug();
  EXPECT_THAT(only().wrong, HasSubstr("Another program"));
}

TEST(DeviceList, LeavesAloneWhatOnlyHasTheSameId) {
  EmulatedFalcon falcon({.product_name = "USB Relay"});
  falcon.plug();
  const ListedDevice found = only();
  EXPECT_FALSE(found.usable);
  EXPECT_EQ(found.info.name, "USB Relay");
  EXPECT_THAT(found.wrong, HasSubstr("another device"));
  EXPECT_EQ(falcon.received_count(), 0U) << "it must not be sent a Falcon's commands";
}

TEST(DeviceList, SaysThatTheBusFails) {
  EmulatedFalcon falcon;
  EmulatedFalcon::Faults faults;
  faults.stall_control = true;
  falcon.set(faults);
  falcon.plug();
  const ListedDevice found = only();
  EXPECT_FALSE(found.usable);
  EXPECT_THAT(found.wrong, HasSubstr("refused"));
}

TEST(DeviceList, TellsOfTheKernelsDriverAndGivesItBack) {
  EmulatedSpaceMouse puck;
  puck.bind_kernel_driver("usbhid");
  puck.plug();
  const ListedDevice found = only();
  EXPECT_EQ(found.role, Role::kSecondHand);
  EXPECT_EQ(found.usb_id, "046d:c626");
  EXPECT_EQ(found.info.name, "3Dconnexion SpaceNavigator");
  EXPECT_EQ(found.info.sensed_dof, 6);
  EXPECT_TRUE(found.usable) << found.wrong;
  EXPECT_THAT(found.notes, HasSubstr("kernel"));
  EXPECT_EQ(puck.kernel_driver(), "usbhid");
}

TEST(DeviceList, ShowsAllOfSeveralInTheOrderOfTheBus) {
  EmulatedFalcon second({.port = 3}), first({.port = 2, .firmware = false});
  EmulatedSpaceMouse puck({.vendor = 0x256f, .product = 0xc635, .product_name = "Compact"});
  second.plug();
  puck.plug();
  first.plug();
  const DeviceList list = list_bus();
  ASSERT_EQ(list.devices.size(), 4U);
  EXPECT_EQ(list.devices[0].info.address, "usb 1-2");
  EXPECT_FALSE(list.devices[0].usable);
  EXPECT_EQ(list.devices[1].info.address, "usb 1-3");
  EXPECT_TRUE(list.devices[1].usable);
  EXPECT_EQ(list.devices[2].info.name, "3Dconnexion SpaceMouse Compact");
}

/// A serial port on the emulated bus, as the kernel presents it.
void add_port(const std::string& name, const std::string& place, const std::string& product_id,
              const std::string& maker) {
  const std::string device = "/devices/usb1/" + place, interface = device + "/" + place + ":1.0";
  const std::string text =
      "P: " + device +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nA: idVendor=16c0\nA: idProduct=" + product_id +
      "\nA: manufacturer=" + maker + "\nA: product=USB Serial\n\nP: " + interface +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n\nP: " + interface + "/tty/" + name +
      "\nE: SUBSYSTEM=tty\nL: device=../../../" + place + ":1.0\n\n";
  GError* error = nullptr;
  umockdev_testbed_add_from_string(EmulatedBus::get().testbed(), text.c_str(), &error);
  ASSERT_EQ(error, nullptr) << error->message;
}

TEST(PolhemPorts, AreThoseOfATeensyThatIsNotHaplys) {
  EXPECT_TRUE(polhem_ports().empty());
  add_port("ttyACM1", "1-5", "0483", "Teensyduino");
  add_port("ttyACM0", "1-6", "0483", "Teensyduino");
  add_port("ttyACM2", "1-7", "0483", "Haply Robotics");
  add_port("ttyACM3", "1-8", "0486", "Teensyduino");
  EXPECT_THAT(polhem_ports(), testing::ElementsAre("/dev/ttyACM0", "/dev/ttyACM1"));
  for (const char* place : {"1-5", "1-6", "1-7", "1-8"})
    umockdev_testbed_remove_device(EmulatedBus::get().testbed(),
                                   (std::string("/sys/devices/usb1/") + place).c_str());
}

}  // namespace
}  // namespace palpate::devices::test
