#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "integration/devices/device_link.h"

namespace palpate::devices {

struct TouchOptions {
  std::string library;            ///< OpenHaptics' libHD.so, a file; empty: where it usually is
  std::string configuration;      ///< the device's name in its maker's setup; empty: the default
  int opening_wait_ms = 2000;     ///< for the first frame
  int answer_wait_ms = 5;         ///< for a frame
  int64_t order_ns = 30'000'000;  ///< a force ends after so long without another one
};

/// 3D Systems' Touch and Touch X, and the Phantoms before them, by OpenHaptics. Its library is not
/// part of palpate: it is searched for at run time, in $OH_SDK_BASE, where the system's loader
/// looks, in ~/.local/lib and in /usr/local/lib, as libHD.so.
///
/// A pen that is in its inkwell, or is not held, has no force (kNoHand), as far as the device tells
/// that. Until it is calibrated it is kNotHomed: palpate updates a calibration that needs no more
/// than that, and never moves the arm.
std::unique_ptr<DeviceLink> make_touch_link(const TouchOptions& options);

/// Whether the library is on this machine and has what is needed. It stays loaded.
bool touch_library_is_there(const TouchOptions& options);

}  // namespace palpate::devices
