#include <cstddef>
#include <cstdint>

#include "tests/x3d/fuzz/parse_x3d.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::x3d::fuzz::parse_x3d_file({reinterpret_cast<const char*>(data), size});
  return 0;
}
