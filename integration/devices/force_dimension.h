#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "integration/devices/device_link.h"

namespace palpate::devices {

struct ForceDimensionOptions {
  std::string library;  ///< its maker's, a file; empty: where it usually is
  int index = -1;       ///< of the device, as its maker counts; -1: the first that can be opened
};

/// Force Dimension's omega, delta, sigma and lambda (and a Falcon that their library drives). Their
/// library is not part of palpate: it is searched for at run time, in $FDSDK, where the system's
/// loader looks, in ~/.local/lib and in /usr/local/lib, as libdrd.so or libdhd.so.
///
/// The arm is never moved by the program: one that has not been initialised is kNotHomed until its
/// maker's program has done that. Its brakes are off while it is open and on again after. What
/// the library says becomes a fault; motors at their limit are none.
std::unique_ptr<DeviceLink> make_force_dimension_link(const ForceDimensionOptions& options);

/// Whether the library is on this machine and has what is needed. It stays loaded.
bool force_dimension_library_is_there(const ForceDimensionOptions& options);

/// What an error of the library (dhdErrorGetLast) means here.
DeviceFault force_dimension_fault(int error) noexcept;

}  // namespace palpate::devices
