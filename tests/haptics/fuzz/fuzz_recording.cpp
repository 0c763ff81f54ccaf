#include <cstddef>
#include <cstdint>

#include "tests/haptics/fuzz/recording_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::fuzz::parse_recording({reinterpret_cast<const char*>(data), size});
  return 0;
}
