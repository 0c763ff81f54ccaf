#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace palpate::files {

template <class T>
void put(std::string& bytes, size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

/// The header of a NIfTI-1 file (352 bytes) as NIfTI-2 (544 bytes), by the standard's table.
inline std::string nifti2_of(const std::string& nifti1) {
  std::string bytes(544, '\0');
  const auto widen = [&]<class From, class To>(From, To, size_t from, size_t to, size_t count) {
    for (size_t n = 0; n < count; ++n) {
      From value;
      std::memcpy(&value, nifti1.data() + from + n * sizeof(From), sizeof(From));
      put<To>(bytes, to + n * sizeof(To), To(value));
    }
  };
  put<int32_t>(bytes, 0, 540);
  bytes.replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
  widen(int16_t{}, int16_t{}, 70, 12, 2);    // datatype, bitpix
  widen(int16_t{}, int64_t{}, 40, 16, 8);    // dim
  widen(float{}, double{}, 76, 104, 8);      // pixdim
  put<int64_t>(bytes, 168, 544);             // vox_offset
  widen(float{}, double{}, 112, 176, 2);     // scl_slope, scl_inter
  widen(float{}, double{}, 136, 216, 1);     // toffset
  widen(int16_t{}, int32_t{}, 252, 344, 2);  // qform_code, sform_code
  widen(float{}, double{}, 256, 352, 18);    // quatern, qoffset, srow
  widen(uint8_t{}, int32_t{}, 123, 500, 1);  // xyzt_units
  widen(int16_t{}, int32_t{}, 68, 504, 1);   // intent_code
  return bytes;
}

}  // namespace palpate::files
