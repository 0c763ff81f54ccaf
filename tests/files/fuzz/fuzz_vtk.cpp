#include <cstddef>
#include <cstdint>

#include "tests/files/fuzz/parse_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  palpate::files::fuzz::parse_vtk({reinterpret_cast<const char*>(data), size});
  return 0;
}
