#pragma once

#include <utility>
#include <vector>

namespace palpate::studies {

/// A straight line through measurements, by least squares: cost = base + slope * content.
struct Line {
  double base = 0.0, slope = 0.0;
  double at(double x) const { return base + slope * x; }
};

/// Needs at least two different x; else the slope is 0 and the base the mean (0 without points).
inline Line line_through(const std::vector<std::pair<double, double>>& points) {
  Line line;
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  const auto n = double(points.size());
  if (points.empty()) return line;
  for (const auto& [px, py] : points) x += px / n, y += py / n;
  for (const auto& [px, py] : points) xx += (px - x) * (px - x), xy += (px - x) * (py - y);
  line.slope = xx > 0.0 ? xy / xx : 0.0;
  line.base = y - line.slope * x;
  return line;
}

}  // namespace palpate::studies
