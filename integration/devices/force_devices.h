#pragma once

#include <memory>
#include <span>
#include <string>

#include "compute/volume/result.h"
#include "integration/devices/device_link.h"
#include "module/haptics/device.h"

namespace palpate::devices {

/// Which of the devices of a kind.
struct ForceDeviceOptions {
  std::string address;        ///< where, in the words of its kind; empty: the usual, or the first
  std::string firmware_file;  ///< the user's own, for a Falcon
  bool real_time = true;      ///< threads that pass on the force ask for real-time priority
};

/// A kind of force device. All of them are in force_device_kinds(). Texts are not copied: give
/// string literals.
struct ForceDeviceKind {
  const char* kind;       ///< the word for it: DeviceInfo::kind, --device
  const char* name;       ///< for people
  const char* addresses;  ///< what an address looks like, for people
  const char* homing;     ///< a sentence: what to do if it does not know where its grip is
  /// Whether one may be there: quick, without opening it. If false, it is not waited for.
  bool (*may_be_there)(const ForceDeviceOptions& options);
  /// kBadInput in one sentence. Not finding one is no error: the search goes on.
  Result<std::unique_ptr<ForceDevice>> (*make)(const ForceDeviceOptions& options);
  /// True: 'palpate devices' finds it by opening it; false: by looking at the USB bus.
  bool listed_by_opening;
};

/// In the order in which they are looked for.
std::span<const ForceDeviceKind> force_device_kinds();
/// Adds a kind, which is searched for after the others. Call it once per kind, before any search
/// for devices.
void add_force_device_kind(const ForceDeviceKind& kind);
/// The kind of that word; null if there is none.
const ForceDeviceKind* force_device_kind(const std::string& word);

/// The device at the end of a link, as a kind's `make` gives it: behind a MailboxDevice.
std::unique_ptr<ForceDevice> device_of_link(std::unique_ptr<DeviceLink> link,
                                            const ForceDeviceOptions& options);

/// What a person calls a device: "haply", or with its address "haply@localhost:10001".
struct ForceDeviceName {
  std::string kind, address;
};
ForceDeviceName force_device_name(const std::string& text);

/// The device of that name. "auto": the first kind of which one answers, each given a second; null
/// if none does. A named one is given a second too, since its reach is known only when it answers;
/// if it does not, it may still be plugged in later. `options` without an address. kBadInput for an
/// unknown name.
Result<std::unique_ptr<ForceDevice>> find_force_device(const std::string& name,
                                                       ForceDeviceOptions options);

}  // namespace palpate::devices
