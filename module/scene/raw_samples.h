#pragma once

#include <glm/glm.hpp>

#include "compute/volume/sample_type.h"

namespace palpate {

/// The samples of a file without a header: one volume, little-endian, i fastest, then j, then k.
/// The axes i, j, k, and the components of vectors, are along x, y, z of the volume's space.
struct RawSamples {
  glm::ivec3 size{1};  ///< samples along i, j, k
  SampleType type = SampleType::kUint8;
  int components = 1;           ///< numbers per sample: 1, or 3 for vectors
  glm::dvec3 spacing_m{0.001};  ///< between samples, where the volume has no box
  bool operator==(const RawSamples&) const = default;
};

}  // namespace palpate
