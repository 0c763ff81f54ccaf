#include <cstddef>
#include <cstdint>

#include "tests/devices/fuzz/parse_path_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::devices::fuzz::parse_path_bytes({reinterpret_cast<const char*>(data), size});
  return 0;
}
