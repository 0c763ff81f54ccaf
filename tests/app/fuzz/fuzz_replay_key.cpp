#include <cstddef>
#include <cstdint>

#include "tests/app/fuzz/replay_key_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::app::fuzz::parse_replay_key_bytes({reinterpret_cast<const char*>(data), size});
  return 0;
}
