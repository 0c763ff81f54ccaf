#pragma once

#include <cstring>
#include <glm/glm.hpp>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

/// Four doubles at once, in two registers that every x86-64 and ARM64 machine has. The hand's reads
/// are short chains of sums of 3 or 4 channels: written with these they take half the instructions
/// that one channel at a time takes. Vector types of GCC and Clang; nothing here is specific to a
/// machine.
namespace palpate::lanes {

using Double2 = double __attribute__((vector_size(16)));
using Float4 = float __attribute__((vector_size(16)));

/// (x, y, z, w) in double.
struct Quad {
  Double2 xy, zw;
};

inline Quad operator+(Quad a, Quad b) {
  return {a.xy + b.xy, a.zw + b.zw};
}
inline Quad operator-(Quad a, Quad b) {
  return {a.xy - b.xy, a.zw - b.zw};
}
inline Quad operator*(double s, Quad a) {
  return {s * a.xy, s * a.zw};
}
/// a + w (b - a), given the difference.
inline Quad moved(Quad a, double w, Quad difference) {
  return {a.xy + w * difference.xy, a.zw + w * difference.zw};
}
inline glm::dvec3 xyz(Quad a) {
  return {a.xy[0], a.xy[1], a.zw[0]};
}

/// Two floats in memory, widened. (GCC 12 widens a generic vector one float at a time.)
inline Double2 load2(const float* values) {
#ifdef __SSE2__
  double both;
  std::memcpy(&both, values, sizeof both);
  return _mm_cvtps_pd(_mm_castpd_ps(_mm_set_sd(both)));
#else
  return Double2{values[0], values[1]};
#endif
}

/// Four floats in memory, widened: differences and blends of them are then as good as exact.
inline Quad load(const glm::vec4& value) {
  return {load2(&value.x), load2(&value.z)};
}

}  // namespace palpate::lanes
