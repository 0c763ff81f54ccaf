#pragma once

#include <algorithm>
#include <cmath>

#include "module/haptics/mode.h"
#include "module/haptics/proxy/placed.h"

namespace palpate {

/// Carries a mode's primitives from the data frame to the world: x' = forward(x), tangents by the
/// map's derivative G, normals by its cofactor matrix (det G times the inverse transpose), which
/// needs no division.
template <class Forward>
class WorldSink final : public PrimitiveSink {
 public:
  /// proxy: where the proxy is in the data frame, at: in the world (so that what is placed there
  /// needs no map).
  WorldSink(Placed& out, const glm::dmat3& derivative, glm::dvec3 proxy, glm::dvec3 at,
            double weight, double cap_n, const Forward& forward)
      : out_(out),
        derivative_(derivative),
        proxy_(proxy),
        at_(at),
        weight_(weight),
        cap_n_(cap_n),
        forward_(forward) {}

  void surface(glm::dvec3 position, glm::dvec3 outward, double strength_n,
               double friction) noexcept override {
    const glm::dvec3 a = derivative_[0], b = derivative_[1], c = derivative_[2];
    const glm::dvec3 normal =
        outward.x * glm::cross(b, c) + outward.y * glm::cross(c, a) + outward.z * glm::cross(a, b);
    add(Primitive::Kind::kPlane, world(position), normal, strength_n, friction);
  }
  void line(glm::dvec3 position, glm::dvec3 tangent, double strength_n) noexcept override {
    add(Primitive::Kind::kLine, world(position), derivative_ * tangent, strength_n, 0.0);
  }
  void point(glm::dvec3 position, double strength_n) noexcept override {
    add(Primitive::Kind::kPoint, world(position), glm::dvec3(0.0, 0.0, 1.0), strength_n, 0.0);
  }
  void force(glm::dvec3 tangent, double strength_n) noexcept override {
    add(Primitive::Kind::kForce, at_, derivative_ * tangent, strength_n, 0.0);
  }
  void drag(double n_s_per_m) noexcept override {
    if (n_s_per_m > 0.0 && std::isfinite(n_s_per_m)) out_.drag_n_s_per_m += weight_ * n_s_per_m;
  }

 private:
  glm::dvec3 world(glm::dvec3 x) const { return x == proxy_ ? at_ : forward_(x); }

  void add(Primitive::Kind kind, glm::dvec3 position, glm::dvec3 direction, double strength_n,
           double friction) noexcept {
    const double length = glm::length(direction);
    // Not finite or without direction: nothing is placed, so nothing can be felt of it.
    if (!(length > 0.0) || !std::isfinite(length) || !(strength_n > 0.0) ||
        !std::isfinite(strength_n) || !std::isfinite(glm::dot(position, position)))
      return;
    const double strength = std::min(strength_n * weight_, cap_n_);
    out_.set.add({kind, position, direction / length, strength, friction > 0.0 ? friction : 0.0});
  }

  Placed& out_;
  const glm::dmat3& derivative_;
  glm::dvec3 proxy_, at_;
  double weight_, cap_n_;
  const Forward& forward_;
};

}  // namespace palpate
