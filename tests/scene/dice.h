#pragma once

#include <random>

#include "module/scene/pose.h"

namespace palpate::test {

/// Seeded random numbers, places and rotations.
class Dice {
 public:
  explicit Dice(uint32_t seed) : engine_(seed) {}
  double draw(double low, double high) { return low + (high - low) * double(engine_()) * 0x1p-32; }
  int below(int n) { return int(engine_() % uint32_t(n)); }
  bool chance(double p) { return draw(0, 1) < p; }
  double normal() { return gauss_(engine_); }
  glm::dvec3 vector(double reach) {
    const double x = draw(-reach, reach), y = draw(-reach, reach);
    return {x, y, draw(-reach, reach)};
  }
  glm::dvec3 normal_vector(double sd) {
    const double x = normal(), y = normal();
    return sd * glm::dvec3(x, y, normal());
  }
  glm::dquat turn() {
    const double w = normal(), x = normal(), y = normal();
    return glm::normalize(glm::dquat(w, x, y, normal()));
  }
  glm::dquat small_turn(double reach_rad) {
    const glm::dvec3 v = 0.5 * vector(reach_rad);
    return glm::normalize(glm::dquat(1.0, v.x, v.y, v.z));
  }
  glm::dquat small_normal_turn(double sd_rad) {
    const glm::dvec3 v = 0.5 * normal_vector(sd_rad);
    return glm::normalize(glm::dquat(1.0, v.x, v.y, v.z));
  }
  Pose pose(double reach) {
    const glm::dvec3 at = vector(reach);
    return {at, turn()};
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> gauss_;
};

}  // namespace palpate::test
