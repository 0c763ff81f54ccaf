#include "module/haptics/proxy/pose_curve.h"

#include <cmath>

#include "compute/volume/portable.h"

namespace palpate {
namespace {

constexpr double kSmallAngle = 1e-4;  // the short series are right to 1e-16 there

/// The body's angular velocity while its rotation is exp(theta(t)): the right Jacobian of the
/// rotation group times theta'.
glm::dvec3 angular_velocity(glm::dvec3 theta, glm::dvec3 theta_rate) {
  const double a2 = glm::dot(theta, theta), a = std::sqrt(a2);
  double b = 0.5 - a2 / 24.0, c = 1.0 / 6.0 - a2 / 120.0;
  if (a > kSmallAngle) {
    const auto [sine, cosine] = portable::sin_cos(0.5 * a);  // of half the angle
    b = 2.0 * sine * sine / a2;
    c = (a - 2.0 * sine * cosine) / (a2 * a);
  }
  const glm::dvec3 once = glm::cross(theta, theta_rate);
  return theta_rate - b * once + c * glm::cross(theta, once);
}

/// Its inverse: the theta' that gives this angular velocity. |theta| <= pi.
glm::dvec3 rotation_rate(glm::dvec3 theta, glm::dvec3 velocity) {
  const double a2 = glm::dot(theta, theta), half = 0.5 * std::sqrt(a2);
  double c = 1.0 / 12.0 + a2 / 720.0;
  if (half > kSmallAngle) {
    const auto [sine, cosine] = portable::sin_cos(half);
    c = (1.0 - half * cosine / sine) / a2;
  }
  const glm::dvec3 once = glm::cross(theta, velocity);
  return velocity + 0.5 * once + c * glm::cross(theta, once);
}

void hermite(glm::dvec3 way, glm::dvec3 from_rate, glm::dvec3 to_rate, double h,
             glm::dvec3 (&factors)[3]) {
  const glm::dvec3 a = h * from_rate, b = h * to_rate;
  factors[0] = a;
  factors[1] = 3.0 * way - 2.0 * a - b;
  factors[2] = a + b - 2.0 * way;
}

glm::dvec3 value(const glm::dvec3 (&f)[3], double u) {
  return u * (f[0] + u * (f[1] + u * f[2]));
}

glm::dvec3 slope(const glm::dvec3 (&f)[3], double u) {
  return f[0] + u * (2.0 * f[1] + 3.0 * u * f[2]);
}

bool is_zero(const glm::dvec3 (&f)[3]) {
  const glm::dvec3 zero(0.0);
  return f[0] == zero && f[1] == zero && f[2] == zero;
}

}  // namespace

PoseRate operator+(const PoseRate& a, const PoseRate& b) {
  return {a.translation + b.translation, a.rotation + b.rotation, a.log_scale + b.log_scale};
}

PoseRate operator*(double factor, const PoseRate& a) {
  return {factor * a.translation, factor * a.rotation, factor * a.log_scale};
}

glm::dquat quaternion_of(glm::dvec3 rotation) {
  const double squared = 0.25 * glm::dot(rotation, rotation);  // of half the angle
  if (squared < 0.25) {
    // Between two poses the angle is small, and the series need no root: their next terms are below
    // 1e-16.
    double sinc = 1.0, cosine = 1.0;
    for (int k = 7; k > 0; --k) {
      sinc = 1.0 - squared * sinc * (1.0 / double(2 * k * (2 * k + 1)));
      cosine = 1.0 - squared * cosine * (1.0 / double(2 * k * (2 * k - 1)));
    }
    return {cosine, 0.5 * sinc * rotation};
  }
  const double half = std::sqrt(squared);
  const auto [sine, cosine] = portable::sin_cos(half);
  return {cosine, sine / (2.0 * half) * rotation};
}

glm::dvec3 rotation_of(glm::dquat q) {
  if (q.w < 0.0) q = -q;
  const glm::dvec3 v(q.x, q.y, q.z);
  const double s = glm::length(v);
  if (s < kSmallAngle) return (2.0 + s * s / 3.0) * v;
  return 2.0 * portable::atan2(s, q.w) / s * v;
}

PoseRate difference(const Transform& from, const Transform& to) {
  PoseRate way{to.translation_m - from.translation_m, {}, {}};
  // Equal bits give zero, not a rounding of it: that is how standing still is told.
  if (to.rotation != from.rotation)
    way.rotation = rotation_of(glm::conjugate(from.rotation) * to.rotation);
  if (to.scale != from.scale)
    for (int a = 0; a < 3; ++a) way.log_scale[a] = portable::log(to.scale[a] / from.scale[a]);
  return way;
}

PoseCurve::PoseCurve(const Transform& from, const PoseRate& from_rate, const Transform& to,
                     const PoseRate& to_rate, double duration_s)
    : from_(from), to_(to), per_s_(1.0 / duration_s) {
  const PoseRate way = difference(from, to);
  hermite(way.translation, from_rate.translation, to_rate.translation, duration_s, translation_);
  hermite(way.rotation, from_rate.rotation, rotation_rate(way.rotation, to_rate.rotation),
          duration_s, rotation_);
  hermite(way.log_scale, from_rate.log_scale, to_rate.log_scale, duration_s, log_scale_);
  rotates_ = !is_zero(rotation_);
  scales_ = !is_zero(log_scale_);
  still_ = !rotates_ && !scales_ && is_zero(translation_);
}

Transform PoseCurve::pose(double share) const {
  if (share >= 1.0) return to_;
  Transform t = from_;
  t.translation_m += value(translation_, share);
  if (rotates_) {
    t.rotation = from_.rotation * quaternion_of(value(rotation_, share));
    // A product of unit quaternions is off by rounding only: one Newton step of 1 / root.
    t.rotation = t.rotation * (1.5 - 0.5 * glm::dot(t.rotation, t.rotation));
  }
  if (scales_) {
    const glm::dvec3 grown = value(log_scale_, share);
    for (int a = 0; a < 3; ++a) t.scale[a] *= portable::exp(grown[a]);
  }
  return t;
}

PoseRate PoseCurve::rate(double share) const {
  const glm::dvec3 theta = value(rotation_, share);
  return {per_s_ * slope(translation_, share),
          angular_velocity(theta, per_s_ * slope(rotation_, share)),
          per_s_ * slope(log_scale_, share)};
}

}  // namespace palpate
