#pragma once

#include <array>

#include "compute/volume/sample_type.h"

namespace palpate::x3d {

/// Number type of H3D's RawImageLoader.
struct RawType {
  const char* kind;  ///< pixelComponentType
  int bits;          ///< of bitsPerPixel, per number of a pixel
  SampleType type;
};
inline constexpr std::array<RawType, 10> kRawTypes = {{
    {"UNSIGNED", 8, SampleType::kUint8},
    {"UNSIGNED", 16, SampleType::kUint16},
    {"UNSIGNED", 32, SampleType::kUint32},
    {"UNSIGNED", 64, SampleType::kUint64},
    {"SIGNED", 8, SampleType::kInt8},
    {"SIGNED", 16, SampleType::kInt16},
    {"SIGNED", 32, SampleType::kInt32},
    {"SIGNED", 64, SampleType::kInt64},
    {"RATIONAL", 32, SampleType::kFloat},
    {"RATIONAL", 64, SampleType::kDouble},
}};

}  // namespace palpate::x3d
