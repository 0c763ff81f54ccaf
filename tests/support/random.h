#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>

namespace palpate::test {

/// Seeded random numbers, vectors and rotations. All but the normal ones are equal with every
/// standard library (the library's distributions are not).
class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  /// Uniform in [low, high).
  double draw(double low, double high) { return low + (high - low) * double(engine_()) * 0x1p-32; }
  /// Its logarithm is uniform.
  double log_draw(double low, double high) { return std::exp(draw(std::log(low), std::log(high))); }
  /// One of 0 to n - 1.
  int below(int n) { return int(engine_() % uint32_t(n)); }
  bool chance(double p) { return draw(0, 1) < p; }
  double normal() { return gauss_(engine_); }
  /// Each component uniform in [-reach, reach).
  glm::dvec3 vector(double reach) {
    const double x = draw(-reach, reach);
    const double y = draw(-reach, reach);
    return {x, y, draw(-reach, reach)};
  }
  glm::dvec3 direction() { return glm::normalize(vector(1.0) + glm::dvec3(1e-9)); }
  glm::dvec3 normal_vector(double sd) {
    const double x = normal(), y = normal();
    return sd * glm::dvec3(x, y, normal());
  }
  /// Any rotation, all alike.
  glm::dquat turn() {
    const double w = normal(), x = normal(), y = normal();
    return glm::normalize(glm::dquat(w, x, y, normal()));
  }
  glm::dquat small_turn(double reach_rad) { return small_turn(vector(reach_rad)); }
  glm::dquat small_normal_turn(double sd_rad) { return small_turn(normal_vector(sd_rad)); }

 private:
  static glm::dquat small_turn(glm::dvec3 by_rad) {
    return glm::normalize(glm::dquat(1.0, 0.5 * by_rad.x, 0.5 * by_rad.y, 0.5 * by_rad.z));
  }
  std::mt19937 engine_;
  std::normal_distribution<double> gauss_;
};

}  // namespace palpate::test
