#include <cstddef>
#include <cstdint>

#include "tests/devices/fuzz/spacemouse_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::devices::fuzz::read_spacemouse_bytes({reinterpret_cast<const char*>(data), size});
  return 0;
}
