#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <type_traits>

#include "compute/volume/dual.h"

/// Noise for synthetic data, from integer hashes alone: the same on every machine and in every
/// order of evaluation.
namespace palpate::texture {

/// A well mixed 32-bit value of its argument (multiply-xorshift; each step is invertible).
inline uint32_t mixed(uint32_t value) {
  value ^= value >> 16;
  value *= 0x7feb352dU;
  value ^= value >> 15;
  value *= 0x846ca68bU;
  value ^= value >> 16;
  return value;
}

/// Uniform in [0, 1).
inline double uniform(uint32_t value) {
  return double(mixed(value)) * 0x1p-32;
}

/// Close to normal, mean 0, SD 1, at most 3.5: the sum of four uniforms. `sample` numbers the
/// draws.
inline double gaussian_like(uint32_t seed, size_t sample) {
  const uint32_t base = mixed(seed ^ mixed(uint32_t(sample)) ^ uint32_t(sample >> 32));
  double sum = 0.0;
  for (uint32_t draw = 0; draw < 4; ++draw) sum += uniform(base + draw * 0x9e3779b9U);
  return (sum - 2.0) * std::sqrt(3.0);
}

/// Smooth noise in [-1, 1] with structures of about one unit: random lattice values, joined with
/// two continuous derivatives. Point: glm::dvec3, or dual::Point for the gradient too.
template <class Point>
auto smooth_noise(uint32_t seed, const Point& point) {
  using Scalar = std::remove_cvref_t<decltype(point.x)>;
  const glm::dvec3 cell =
      glm::floor(glm::dvec3(dual::value(point.x), dual::value(point.y), dual::value(point.z)));
  const auto eased = [](const Scalar& f) -> Scalar {
    return f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
  };
  const Scalar wx = eased(point.x - cell.x), wy = eased(point.y - cell.y),
               wz = eased(point.z - cell.z);
  const glm::ivec3 c(cell);
  const auto lattice = [&](int i, int j, int k) {
    const uint32_t x = uint32_t(c.x + i) * 0x8da6b343U;
    const uint32_t y = uint32_t(c.y + j) * 0xd8163841U;
    const uint32_t z = uint32_t(c.z + k) * 0xcb1ab31fU;
    return 2.0 * uniform(seed ^ x ^ y ^ z) - 1.0;
  };
  const auto along_x = [&](int j, int k) -> Scalar {
    const double low = lattice(0, j, k);
    return low + wx * (lattice(1, j, k) - low);
  };
  const auto along_y = [&](int k) -> Scalar {
    const Scalar low = along_x(0, k);
    return low + wy * (along_x(1, k) - low);
  };
  const Scalar near = along_y(0);
  return Scalar(near + wz * (along_y(1) - near));
}

/// Structures of two sizes, in [-1, 1].
template <class Point>
auto tissue(uint32_t seed, const Point& point_mm, double fine_mm, double coarse_mm) {
  return 0.5 * smooth_noise(mixed(seed), point_mm / fine_mm) +
         0.5 * smooth_noise(mixed(seed + 1), point_mm / coarse_mm);
}

/// 0 well below the edge, 1 well above, smooth over `width` around it.
template <class Scalar>
Scalar soft_step(const Scalar& distance, double width) {
  const Scalar t = distance / width + 0.5;
  if (!(dual::value(t) > 0.0)) return 0.0;
  if (dual::value(t) >= 1.0) return 1.0;
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace palpate::texture
