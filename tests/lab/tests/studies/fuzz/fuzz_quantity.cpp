#include <cstddef>
#include <cstdint>

#include "tests/lab/tests/studies/fuzz/quantity_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::studies::fuzz::parse_quantity_bytes({reinterpret_cast<const char*>(data), size});
  return 0;
}
