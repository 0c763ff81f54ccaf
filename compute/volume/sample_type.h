#pragma once

#include <cstdint>

namespace palpate {

/// What a number in a file or in memory is.
enum class SampleType : uint8_t {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble
};

}  // namespace palpate
