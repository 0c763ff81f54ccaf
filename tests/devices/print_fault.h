#pragma once

#include <ostream>

#include "module/haptics/device.h"

namespace palpate {

inline void PrintTo(DeviceFault fault, std::ostream* out) {
  *out << '"' << sentence(fault) << '"';
}

}  // namespace palpate
