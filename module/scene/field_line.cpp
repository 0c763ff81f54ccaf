#include "module/scene/field_line.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// A line may meet its start only after it has left it.
constexpr size_t kLeft = 4;

bool is_inside(glm::dvec3 x, const LineOptions& options) {
  return glm::all(glm::greaterThan(x, options.low_m)) && glm::all(glm::lessThan(x, options.high_m));
}

}  // namespace

FieldLine field_line(const std::function<glm::dvec3(glm::dvec3)>& vector, glm::dvec3 start_m,
                     double direction, const LineOptions& options) {
  const double least = std::max(options.least_length, 1e-300);
  const auto unit = [&](glm::dvec3 x) {
    const glm::dvec3 v = vector(x);
    const double length = glm::length(v);
    // In this order, so that what is not finite has no direction either.
    return length > least && std::isfinite(length) ? v / length : glm::dvec3(0.0);
  };
  const double h = direction * options.step_m;
  FieldLine line;
  line.places_m.push_back(start_m);
  const glm::dvec3 first = direction * unit(start_m);
  glm::dvec3 x = start_m;
  for (int k = 0; k < options.most_steps; ++k) {
    const glm::dvec3 k1 = unit(x), k2 = unit(x + 0.5 * h * k1), k3 = unit(x + 0.5 * h * k2),
                     k4 = unit(x + h * k3);
    const glm::dvec3 step = h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    // At a source or sink the directions cancel, and the line ends.
    if (glm::length(step) < 0.5 * std::abs(h)) break;
    x += step;
    if (!is_inside(x, options)) break;
    line.places_m.push_back(x);
    if (!options.closes || line.places_m.size() <= kLeft) continue;
    // Back at the start: within a step behind it, less than a fifth of one aside, going the same
    // way. The last step leads to the start itself.
    const glm::dvec3 left = start_m - x;
    const double ahead = glm::dot(left, first);
    if (ahead < 0.0 || ahead > options.step_m || glm::dot(step, first) < 0.0) continue;
    if (glm::length(left - ahead * first) > 0.2 * options.step_m) continue;
    line.places_m.push_back(start_m);
    line.closed = true;
    break;
  }
  return line;
}

}  // namespace palpate
