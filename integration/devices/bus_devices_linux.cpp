#include <fmt/format.h>

#include "integration/devices/bus_devices.h"
#include "integration/devices/falcon.h"
#include "integration/devices/falcon_setup.h"
#include "integration/devices/force_dimension.h"
#include "integration/devices/spacemouse.h"
#include "integration/devices/spacemouse_protocol.h"
#include "integration/devices/usb.h"
#include "integration/devices/usb_faults.h"

namespace palpate::devices {
namespace {

using usb::UsbProblem;

constexpr const char* kFirmwareMissing =
    "It has no firmware. palpate may not ship it: take the image from its maker's driver disc or "
    "SDK and give it with `falcon_firmware`.";
constexpr const char* kNotHomed =
    "After power-up, pull the grip all the way out, then push it all the way in.";
constexpr const char* kFromKernel =
    "A driver of the kernel holds it; palpate takes it over while it runs and gives it back.";

constexpr uint16_t kForceDimension = 0x1451;
constexpr const char* kNoLibrary =
    "Its maker's library is missing: install Force Dimension's SDK and set FDSDK to its folder.";

bool is_ours(uint16_t vendor, uint16_t product) {
  return vendor == kForceDimension || (vendor == falcon::kVendor && product == falcon::kProduct) ||
         spacemouse::model_of(vendor, product) != nullptr;
}

/// The bus problem in a sentence that fits into a list.
std::string wrong_of(UsbProblem problem) {
  return problem == UsbProblem::kNone ? "" : usb::sentence(problem);
}

void check_falcon(libusb_device* device, ListedDevice& listed) {
  listed.info = falcon_info();
  const usb::ClaimedDevice opened = usb::open(device, 0);
  listed.wrong = wrong_of(opened.problem);
  if (opened.problem != UsbProblem::kNone) return;
  if (opened.had_kernel_driver) listed.notes = kFromKernel;
  const std::string name = usb::product_name(opened.handle.get());
  if (!name.empty() && name != falcon::kProductName) {
    listed.info = {};
    listed.info.kind = "other";
    listed.info.name = name;
    listed.wrong = "It has a Falcon's USB id but is another device: palpate leaves it alone.";
    return;
  }
  const falcon::StopFlag stop = false;
  UsbProblem problem = falcon::set_up(opened.handle.get()).problem;
  falcon::FalconAnswer answer;
  if (problem == UsbProblem::kNone)
    problem = falcon::find_firmware(opened.handle.get(), stop, &answer);
  listed.wrong = problem == UsbProblem::kTimedOut ? kFirmwareMissing : wrong_of(problem);
  if (problem == UsbProblem::kNone && answer.homed != falcon::kAllHomed)
    listed.notes += (listed.notes.empty() ? "" : " ") + std::string(kNotHomed);
}

void check_spacemouse(const usb::BusDevice& found, ListedDevice& listed) {
  listed.role = ListedDevice::Role::kSecondHand;
  listed.info.kind = "spacemouse";
  listed.info.name =
      std::string("3Dconnexion ") + spacemouse::model_of(found.vendor, found.product)->name;
  listed.info.sensed_dof = 6;
  listed.info.actuated_dof = 0;
  const auto input = usb::hid_input(found.device.get());
  if (!input) {
    listed.wrong = "It has no input that palpate understands.";
    return;
  }
  const usb::ClaimedDevice opened = usb::open(found.device.get(), input->interface);
  listed.wrong = wrong_of(opened.problem);
  if (opened.had_kernel_driver) listed.notes = kFromKernel;
}

}  // namespace

void list_bus(DeviceList& list) {
  const usb::ContextPtr context = usb::make_context();
  if (!context)
    list.wrong =
        "This system shows no USB bus, so no USB device is found (in a container, pass "
        "/dev/bus/usb in).";
  else
    for (const usb::BusDevice& found : usb::find(context.get(), is_ours)) {
      ListedDevice listed;
      // With its maker's library it is listed below, with what the library reports.
      if (found.vendor == kForceDimension && force_dimension_library_is_there({})) continue;
      listed.usb_id = fmt::format("{:04x}:{:04x}", found.vendor, found.product);
      if (found.vendor == kForceDimension) {
        listed.info.kind = "force-dimension";
        listed.info.name = "Force Dimension device";
        listed.wrong = kNoLibrary;
      } else if (found.vendor == falcon::kVendor)
        check_falcon(found.device.get(), listed);
      else
        check_spacemouse(found, listed);
      listed.info.address = found.address;
      listed.usable = listed.wrong.empty();
      list.devices.push_back(std::move(listed));
    }
}

std::unique_ptr<SecondHand> make_second_hand() {
  return std::make_unique<SpaceMouse>();
}

}  // namespace palpate::devices
