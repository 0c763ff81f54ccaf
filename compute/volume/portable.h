#pragma once

#include <algorithm>
#include <cmath>

/// Functions of real numbers by additions, multiplications, divisions and square roots alone. Those
/// give the same bits on every system and processor; the functions of a system's mathematical
/// library differ in the last bit. What a force depends on uses these, so that a recording gives
/// the same forces wherever it is replayed. Within 4 units in the last place of the true value. Any
/// thread; real-time safe.
namespace palpate::portable {

/// Of a number that is not below 0.
inline double cube_root(double x) {
  if (!(x > 0.0) || !std::isfinite(x)) return x;
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // 0.5 to 1
  const int over = ((exponent % 3) + 3) % 3;
  m = std::ldexp(m, over);
  double root = (2.0 + m) / 3.0;
  // Newton's steps: the first guess is wrong by a quarter at most, and each step squares that.
  for (int step = 0; step < 6; ++step) root -= (root - m / (root * root)) / 3.0;
  return std::ldexp(root, (exponent - over) / 3);
}

/// Finite below 709; 0 below -745.
inline double exp(double x) {
  if (!(x > -745.2)) return std::isnan(x) ? x : 0.0;
  constexpr double kPerLn2 = 1.4426950408889634, kLn2 = 0.693147180369123816490,
                   kLn2Rest = 1.90821492927058770002e-10;
  const double whole = std::floor(x * kPerLn2 + 0.5);
  if (whole > 1024.0) return HUGE_VAL;
  const double r = (x - whole * kLn2) - whole * kLn2Rest;  // at most 0.347
  double sum = 1.0;
  for (int k = 14; k > 1; --k) sum = 1.0 + sum * r * (1.0 / k);
  return std::ldexp(1.0 + r * sum, int(whole));
}

/// Of a number above 0.
inline double log(double x) {
  if (!(x > 0.0) || !std::isfinite(x)) return x > 0.0 ? x : x < 0.0 ? std::nan("") : -HUGE_VAL;
  constexpr double kLn2 = 0.693147180369123816490, kLn2Rest = 1.90821492927058770002e-10;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < 0.70710678118654752) m *= 2.0, --exponent;
  // 2 artanh(s)
  const double f = m - 1.0, s = f / (2.0 + f), s2 = s * s;
  double sum = 0.0;
  for (int k = 21; k > 1; k -= 2) sum = s2 * (1.0 / k + sum);
  // 2 s is f - s f: exact for the largest part.
  return exponent * kLn2 + (f - (s * (f - 2.0 * sum) - exponent * kLn2Rest));
}

struct SinCos {
  double sin, cos;
};

/// Beyond a hundred thousand turns, rad, with the error that a turn of 53 bits has then.
inline SinCos sin_cos(double angle) {
  if (!std::isfinite(angle)) return {std::nan(""), std::nan("")};
  if (std::abs(angle) > 6e5) angle = std::fmod(angle, 6.283185307179586);
  constexpr double kPerQuarter = 0.63661977236758134, kQuarter = 1.57079632673412561417,
                   kQuarterRest = 6.07710050630396597660e-11,
                   kLastRest = 2.02226624879595063154e-21;
  const double quarters = std::floor(angle * kPerQuarter + 0.5);
  const double r = ((angle - quarters * kQuarter) - quarters * kQuarterRest) - quarters * kLastRest;
  const double r2 = r * r;
  double s = 1.0, c = 1.0;
  for (int k = 9; k > 0; --k) {
    s = 1.0 - r2 * s * (1.0 / (2 * k * (2 * k + 1)));
    c = 1.0 - r2 * c * (1.0 / (2 * k * (2 * k - 1)));
  }
  s *= r;
  switch (int(std::fmod(quarters, 4.0)) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}
inline double sin(double angle) {
  return sin_cos(angle).sin;
}
inline double cos(double angle) {
  return sin_cos(angle).cos;
}

/// The angle of (x, y), -pi to pi.
inline double atan2(double y, double x) {
  constexpr double kPi = 3.14159265358979312;
  const double ay = std::abs(y), ax = std::abs(x);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  // The tangent of an eighth of a turn at most, then of half of that.
  const double tangent = std::min(ax, ay) / std::max(ax, ay);
  const double t = tangent / (1.0 + std::sqrt(1.0 + tangent * tangent)), t2 = t * t;
  double sum = 0.0;
  for (int k = 43; k > 1; k -= 2) sum = t2 * (1.0 / k - sum);
  double angle = 2.0 * (t - t * sum);
  if (ay > ax) angle = 0.5 * kPi - angle;
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

}  // namespace palpate::portable
