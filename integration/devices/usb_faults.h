#pragma once

#include "integration/devices/usb.h"
#include "module/haptics/device.h"

namespace palpate::devices {

/// What a problem of the bus means for who uses the device.
constexpr DeviceFault fault_of(usb::UsbProblem problem) noexcept {
  switch (problem) {
    case usb::UsbProblem::kNone:
      return DeviceFault::kNone;
    case usb::UsbProblem::kNoPermission:
      return DeviceFault::kNoPermission;
    case usb::UsbProblem::kBusy:
      return DeviceFault::kBusy;
    case usb::UsbProblem::kGone:
      return DeviceFault::kUnplugged;
    case usb::UsbProblem::kTimedOut:
      return DeviceFault::kTimeout;
    case usb::UsbProblem::kStalled:
    case usb::UsbProblem::kFailed:
      return DeviceFault::kTransfer;
  }
  return DeviceFault::kTransfer;
}

}  // namespace palpate::devices
