#pragma once

#include <cmath>
#include <glm/glm.hpp>

/// Dual numbers: a value and its exact derivative by place, computed together (forward
/// differentiation). A formula that is written for any number type then also gives its gradient.
namespace palpate::dual {

/// A value and its gradient.
struct Dual {
  double value = 0.0;
  glm::dvec3 slope{0.0};

  Dual() = default;
  Dual(double v) : value(v) {}
  Dual(double v, glm::dvec3 s) : value(v), slope(s) {}
};

inline Dual operator+(const Dual& a, const Dual& b) {
  return {a.value + b.value, a.slope + b.slope};
}
inline Dual operator-(const Dual& a, const Dual& b) {
  return {a.value - b.value, a.slope - b.slope};
}
inline Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.value * b.slope + b.value * a.slope};
}
inline Dual operator/(const Dual& a, const Dual& b) {
  const double quotient = a.value / b.value;
  return {quotient, (a.slope - quotient * b.slope) / b.value};
}

/// A place given by duals.
struct Point {
  Dual x, y, z;
};
inline Point operator*(const Point& p, const Dual& s) {
  return {p.x * s, p.y * s, p.z * s};
}
inline Point operator/(const Point& p, const Dual& s) {
  return {p.x / s, p.y / s, p.z / s};
}

/// The place itself: its slopes are the unit vectors.
inline Point variable(glm::dvec3 x) {
  return {{x.x, {1, 0, 0}}, {x.y, {0, 1, 0}}, {x.z, {0, 0, 1}}};
}

inline double value(double v) {
  return v;
}
inline double value(const Dual& v) {
  return v.value;
}

/// What a function of one number becomes: f and f' at a's value.
inline Dual chained(const Dual& a, double f, double derivative) {
  return {f, derivative * a.slope};
}

inline double square_root(double v) {
  return std::sqrt(v);
}
/// Needs a value above 0.
inline Dual square_root(const Dual& v) {
  const double root = std::sqrt(v.value);
  return chained(v, root, 0.5 / root);
}

inline double length(glm::dvec3 p) {
  return glm::length(p);
}
/// At the origin, where the length has no slope, 0.
inline Dual length(const Point& p) {
  const glm::dvec3 x(p.x.value, p.y.value, p.z.value);
  const double r = glm::length(x);
  const glm::dvec3 sum = x.x * p.x.slope + x.y * p.y.slope + x.z * p.z.slope;
  return {r, r > 0.0 ? sum / r : glm::dvec3(0.0)};
}

}  // namespace palpate::dual
