#pragma once

#include "integration/devices/usb.h"
#include "module/haptics/device.h"

namespace palpate::devices {

/// What a problem of the bus means for who uses the device.
constexpr DeviceFault fault_of(usb::Problem problem) noexcept {
  switch (problem) {
    case usb::Problem::kNone:
      return DeviceFault::kNone;
    case usb::Problem::kNoPermission:
      return DeviceFault::kNoPermission;
    case usb::Problem::kBusy:
      return DeviceFault::kBusy;
    case usb::Problem::kGone:
      return DeviceFault::kUnplugged;
    case usb::Problem::kTimedOut:
      return DeviceFault::kTimeout;
    case usb::Problem::kStalled:
    case usb::Problem::kFailed:
      return DeviceFault::kTransfer;
  }
  return DeviceFault::kTransfer;
}

}  // namespace palpate::devices
