#pragma once

#include <cstring>
#include <glm/glm.hpp>

/// Four doubles at once, in two registers that every x86-64 and ARM64 machine has. The hand's reads
/// are short chains of sums of 3 or 4 channels: written with these they take half the instructions
/// that one channel at a time takes. Vector types of GCC and Clang; nothing here is specific to a
/// machine.
namespace palpate::lanes {

using Double2 = double __attribute__((vector_size(16)));
using Float2 = float __attribute__((vector_size(8)));
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

/// Four floats in memory, widened: differences and blends of them are then as good as exact.
inline Quad load(const glm::vec4& value) {
  Float2 xy, zw;
  std::memcpy(&xy, &value.x, sizeof xy);
  std::memcpy(&zw, &value.z, sizeof zw);
  return {__builtin_convertvector(xy, Double2), __builtin_convertvector(zw, Double2)};
}

}  // namespace palpate::lanes
