#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace palpate::test {

constexpr double kNarrow_mm = 0.05 / (1 << 14);

/// The largest change of value(place) over kNarrow_mm on a straight line of 20 mm: where it changes
/// by more than 1 over 0.05 mm, the half that changes more is halved again and again. A jump stays
/// as large as it is; other changes shrink with the distance.
template <class Value>
double largest_narrow_change(const Value& value, glm::dvec3 from, glm::dvec3 unit) {
  double largest = 0.0;
  const auto at = [&](double t) { return value(from + t * unit); };
  double before = at(0.0);
  for (int step = 1; step <= 400; ++step) {
    double low = 0.05 * (step - 1), high = 0.05 * step;
    double there = before, beyond = at(high);
    before = beyond;
    if (std::abs(beyond - there) < 1.0) continue;
    while (high - low > 1.5 * kNarrow_mm) {
      const double middle = 0.5 * (low + high), between = at(middle);
      const bool first = std::abs(between - there) > std::abs(beyond - between);
      (first ? high : low) = middle;
      (first ? beyond : there) = between;
    }
    largest = std::max(largest, std::abs(beyond - there));
  }
  return largest;
}

}  // namespace palpate::test
