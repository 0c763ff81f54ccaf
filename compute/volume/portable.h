#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

/// Elementary functions from additions, multiplications, divisions and square roots alone. These
/// give the same bits on every system and processor; a system's mathematical library differs in the
/// last bit. What a force depends on uses these, so that a recording gives the same forces wherever
/// it is replayed. At most 4 units in the last place from the true value. NaN gives NaN. Any
/// thread; real-time safe.
namespace palpate::portable {
namespace series {

/// c[0] + c[1] x + c[2] x^2 + ..., the even and the odd powers side by side: half the latency.
template <size_t n>
double sum(const std::array<double, n>& c, double x) {
  static_assert(n >= 4);
  const double x2 = x * x;
  constexpr size_t kEven = (n - 1) / 2 * 2, kOdd = (n - 2) / 2 * 2 + 1;
  double even = c[kEven], odd = c[kOdd];
  for (size_t k = kEven; k > 0; k -= 2) even = c[k - 2] + x2 * even;
  for (size_t k = kOdd; k > 1; k -= 2) odd = c[k - 2] + x2 * odd;
  return even + x * odd;
}

/// Factors behind the first one of a power series: 1 / n! for n = first, first + step, ..., with
/// the signs sign, sign^2, ...
template <size_t n>
constexpr std::array<double, n> inverse_factorials(int first, int step, double sign) {
  std::array<double, n> factors{};
  double factorial = 1.0, signs = sign;  // factorials to 22 are exact
  for (int m = 2; m <= first; ++m) factorial *= m;
  int at = first;
  for (double& factor : factors) {
    factor = signs / factorial;
    signs *= sign;
    for (int m = 0; m < step; ++m) factorial *= ++at;
  }
  return factors;
}

/// The same: 1 / 3, 1 / 5, 1 / 7, ..., with the signs sign, sign^2, ...
template <size_t n>
constexpr std::array<double, n> inverse_odd_numbers(double sign) {
  std::array<double, n> factors{};
  double signs = sign;
  for (size_t k = 0; k < n; ++k, signs *= sign) factors[k] = signs / double(2 * k + 3);
  return factors;
}

/// The nearest whole number, for |x| below 2^51: what lies behind the point does not fit beside
/// this.
inline double nearest_whole(double x) {
  constexpr double kLarge = 6755399441055744.0;  // 1.5 * 2^52
  return (x + kLarge) - kLarge;
}

// ln 2 and pi / 2 in parts: products of the first with small whole numbers are exact.
constexpr double kLn2 = 0.693147180369123816490, kLn2Rest = 1.90821492927058770002e-10;
constexpr double kQuarter = 1.57079632673412561417, kQuarterRest = 6.07710050630396597660e-11,
                 kQuarterLast = 2.02226624879595063154e-21;

}  // namespace series

/// NaN below 0. For what is computed once: it takes longer than the others.
inline double cube_root(double x) {
  if (x < 0.0) return std::numeric_limits<double>::quiet_NaN();
  if (!(x > 0.0) || !std::isfinite(x)) return x;
  int exponent = 0;
  const double fraction = std::frexp(x, &exponent);  // 0.5 to 1
  const int over = ((exponent % 3) + 3) % 3;
  const double m = std::ldexp(fraction, over);
  double root = (2.0 + m) / 3.0;
  // Newton's steps: the first guess is wrong by a quarter at most, and each step squares that.
  for (int step = 0; step < 6; ++step) root -= (root - m / (root * root)) / 3.0;
  return std::ldexp(root, (exponent - over) / 3);
}

/// Infinite above 709.78; 0 below -745.2.
inline double exp(double x) {
  using namespace series;
  static constexpr auto kFactors = inverse_factorials<13>(2, 1, 1.0);
  if (!(x > -745.2)) return std::isnan(x) ? x : 0.0;
  if (x > 710.0) return std::numeric_limits<double>::infinity();
  // e^x = 2^whole e^r
  const double whole = nearest_whole(x * 1.4426950408889634);
  const double r = (x - whole * kLn2) - whole * kLn2Rest;  // at most 0.347
  const double power = 1.0 + (r + r * r * sum(kFactors, r));
  if (std::abs(whole) > 1000.0) return std::ldexp(power, int(whole));
  return power * std::bit_cast<double>(uint64_t(int64_t(whole) + 1023) << 52);
}

/// NaN below 0, -infinity at 0.
inline double log(double x) {
  using namespace series;
  static constexpr auto kFactors = inverse_odd_numbers<10>(1.0);
  if (x == 0.0) return -std::numeric_limits<double>::infinity();
  if (!(x > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(x)) return x;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < 0.70710678118654752) m *= 2.0, --exponent;
  // ln m = 2 artanh s = 2 s (1 + s^2 / 3 + ...), s = (m - 1) / (m + 1). 2 s is f - s f, whose
  // first part is exact.
  const double f = m - 1.0, s = f / (2.0 + f), s2 = s * s;
  const double rest = s2 * sum(kFactors, s2);
  return exponent * kLn2 + (f - (s * (f - 2.0 * rest) - exponent * kLn2Rest));
}

struct SinCos {
  double sin, cos;
};

/// Of an angle, rad. Beyond 6e5 it is taken modulo a rounded turn first; infinite: NaN.
inline SinCos sin_cos(double angle) {
  using namespace series;
  static constexpr auto kSine = inverse_factorials<8>(3, 2, -1.0);
  static constexpr auto kCosine = inverse_factorials<9>(2, 2, -1.0);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(angle)) return {kNone, kNone};
  if (std::abs(angle) > 6e5) angle = std::fmod(angle, 6.283185307179586);
  const double quarters = nearest_whole(angle * 0.63661977236758134);
  const double r =
      ((angle - quarters * kQuarter) - quarters * kQuarterRest) - quarters * kQuarterLast;
  const double r2 = r * r, s = r + r * (r2 * sum(kSine, r2)), c = 1.0 + r2 * sum(kCosine, r2);
  switch (int64_t(quarters) & 3) {
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

/// The angle of the finite vector (x, y), -pi to pi; 0 for no length.
inline double atan2(double y, double x) {
  using namespace series;
  static constexpr auto kFactors = inverse_odd_numbers<21>(-1.0);
  constexpr double kPi = 3.14159265358979312;
  if (!std::isfinite(x) || !std::isfinite(y)) return std::numeric_limits<double>::quiet_NaN();
  const double ay = std::abs(y), ax = std::abs(x);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  // The tangent of an eighth of a turn at most, then of half of that.
  const double tangent = std::min(ax, ay) / std::max(ax, ay);
  const double t = tangent / (1.0 + std::sqrt(1.0 + tangent * tangent));
  const double t2 = t * t;
  double angle = 2.0 * (t + t * (t2 * sum(kFactors, t2)));
  if (ay > ax) angle = 0.5 * kPi - angle;
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

}  // namespace palpate::portable
