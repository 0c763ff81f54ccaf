#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

/// Robust weights for distances of three-dimensional residuals.
namespace palpate::tukey {

/// The standard deviation per axis of distances most of which are normal: the median distance of a
/// three-dimensional normal distribution is 1.5382 of it.
inline double scale(std::vector<double> distances) {
  if (distances.empty()) return 0.0;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle / 1.5382;
}

/// Tukey's biweight, zero from 6 standard deviations on: in three dimensions this costs a few per
/// cent of efficiency, and everything beyond is ignored.
inline double weight(double distance, double scale) {
  // For data without noise everything counts.
  const double reach = std::max(6.0 * scale, 1e-9);
  if (!(distance < reach)) return 0.0;
  const double share = distance / reach;
  return (1.0 - share * share) * (1.0 - share * share);
}

/// For the last steps, when the outliers are known: 1 up to 4.2 standard deviations, which one in
/// two thousand normal residuals exceeds, and 0 beyond. Uses the full information of the others.
inline double belongs(double distance, double scale) {
  return distance <= std::max(4.2 * scale, 1e-9) ? 1.0 : 0.0;
}

}  // namespace palpate::tukey
