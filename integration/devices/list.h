#pragma once

#include <string>
#include <vector>

#include "module/haptics/device.h"

namespace palpate::devices {

/// A force device or a second hand that was found.
struct ListedDevice {
  enum class Role { kForce, kSecondHand } role = Role::kForce;
  DeviceInfo info;         ///< what it is, where it is, what it can do
  std::string usb_id;      ///< "0403:cb48"; empty: not on the bus
  bool usable = false;     ///< palpate can use it as it is
  std::string wrong;       ///< one sentence: why not, and what to do; empty if usable
  std::string notes = {};  ///< what else is to know, in sentences; often empty
};

struct DeviceList {
  /// Those on the bus in its order, then those that something else drives, then the simulated one.
  std::vector<ListedDevice> devices;
  std::string wrong;  ///< one sentence if the bus itself can not be used
};

/// What is plugged in now. Opens each device briefly to see whether it can be used: a Falcon's
/// motors are told zero and asked for an answer, which takes about a second if it has no firmware.
/// What a maker's service or library drives is opened too, within 1.5 s a kind. A device in use by
/// another program is left alone. Not real-time safe.
DeviceList list_devices();

}  // namespace palpate::devices
