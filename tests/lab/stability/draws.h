#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>

namespace palpate::stability {

/// Seeded random numbers that are equal with every standard library (the library's distributions
/// are not).
class Draws {
 public:
  explicit Draws(uint32_t seed) : engine_(seed) {}
  /// Uniform in [low, high).
  double even(double low, double high) { return low + (high - low) * double(engine_()) * 0x1p-32; }
  double log_even(double low, double high) { return std::exp(even(std::log(low), std::log(high))); }
  glm::dvec3 vector(double reach) {
    const double x = even(-reach, reach);
    const double y = even(-reach, reach);
    return {x, y, even(-reach, reach)};
  }
  glm::dvec3 direction() { return glm::normalize(vector(1.0) + glm::dvec3(1e-9)); }

 private:
  std::mt19937 engine_;
};

}  // namespace palpate::stability
