#include "integration/charts/color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace palpate::charts {
namespace {

// CIE L*a*b* to linear sRGB, white point D65.
std::array<double, 3> linear_from_lab(double lightness, double a, double b) {
  const auto decoded = [](double f) {
    return f > 6.0 / 29.0 ? f * f * f : 3.0 * (6.0 / 29.0) * (6.0 / 29.0) * (f - 4.0 / 29.0);
  };
  const double fy = (lightness + 16.0) / 116.0;
  const double x = 0.95047 * decoded(fy + a / 500.0);
  const double y = decoded(fy);
  const double z = 1.08883 * decoded(fy - b / 200.0);
  return {3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z,
          0.0557 * x - 0.2040 * y + 1.0570 * z};
}

double encoded(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

bool on_screen(const std::array<double, 3>& linear) {
  // A thousandth is under one step of an 8-bit screen.
  return std::all_of(linear.begin(), linear.end(),
                     [](double v) { return v >= -1e-3 && v <= 1.0 + 1e-3; });
}

// One arm of the signed map: from paper white to a full colour.
Color arm(double t, double chroma, double hue_deg) {
  return color_from_lch(97.0 - 57.0 * t, chroma * std::pow(t, 0.8), hue_deg);
}

Color exact_color(ColorMap map, double t) {
  switch (map) {
    case ColorMap::kGray:
      return {t, t, t};
    case ColorMap::kMotion: {
      // The screen has least chroma in the middle, for blue-green: the curve is bent away from that
      // limit.
      const double bow = (2.0 * t - 1.0) * (2.0 * t - 1.0);
      return color_from_lch(24.0 + 68.0 * t, 27.0 + 28.0 * bow, 308.0 - 212.0 * t);
    }
    case ColorMap::kError:
      return color_from_lch(97.0 - 73.0 * t, 6.0 + 210.0 * t * (1.0 - t) + 30.0 * t * t,
                            86.0 - 106.0 * t);
    case ColorMap::kDifference:
      return t < 0.5 ? arm(1.0 - 2.0 * t, 36.0, 265.0) : arm(2.0 * t - 1.0, 56.0, 35.0);
    case ColorMap::kConfidence:
      return color_from_lch(94.0 - 52.0 * t, 18.0 + 8.0 * t, 85.0 + 120.0 * t);
  }
  return {};
}

// The chroma search is too slow for every pixel; 512 steps are finer than an 8-bit screen tells
// apart.
constexpr int kSteps = 512;
using ColorTable = std::array<Color, kSteps>;

ColorTable table_of(ColorMap map) {
  ColorTable table;
  for (int n = 0; n < kSteps; ++n) table[size_t(n)] = exact_color(map, double(n) / (kSteps - 1));
  return table;
}

}  // namespace

Color color_from_lch(double lightness, double chroma, double hue_deg) {
  const double hue = hue_deg * std::numbers::pi / 180.0;
  std::array<double, 3> linear = linear_from_lab(lightness, 0.0, 0.0);
  for (double c = chroma; c > 0.0; c -= 1.0) {
    const auto candidate = linear_from_lab(lightness, c * std::cos(hue), c * std::sin(hue));
    if (!on_screen(candidate)) continue;
    linear = candidate;
    break;
  }
  return {encoded(linear[0]), encoded(linear[1]), encoded(linear[2])};
}

Color color_at(ColorMap map, double t) {
  static const std::array<ColorTable, 5> tables = {
      table_of(ColorMap::kGray), table_of(ColorMap::kMotion), table_of(ColorMap::kError),
      table_of(ColorMap::kDifference), table_of(ColorMap::kConfidence)};
  t = std::isnan(t) ? 0.0 : std::clamp(t, 0.0, 1.0);
  return tables[size_t(map)][size_t(t * (kSteps - 1) + 0.5)];
}

}  // namespace palpate::charts
