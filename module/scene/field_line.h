#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <vector>

namespace palpate {

/// How field lines are followed.
struct LineOptions {
  glm::dvec3 low_m{0.0}, high_m{0.0};  ///< the box in which there are data
  double step_m = 1e-3;                ///< length of a step; above 0
  int most_steps = 80;
  double least_length = 0.0;  ///< where the vector is shorter, a line ends
  bool closes = false;        ///< a line that is back at its start ends there
};

/// A field line: places along it, the first one its start.
struct FieldLine {
  std::vector<glm::dvec3> places_m;
  bool closed = false;  ///< with `closes`: the last place is the first one
};

/// The line through `start_m` along a vector field (direction 1) or against it (-1), dx/ds = v/|v|,
/// by the classic Runge-Kutta method: its error falls with the fourth power of the step. It ends
/// at the box, where the vectors are too short or not finite, and at sources and sinks, where the
/// directions within a step cancel. Allocates; any thread that may call `vector`.
FieldLine field_line(const std::function<glm::dvec3(glm::dvec3)>& vector, glm::dvec3 start_m,
                     double direction, const LineOptions& options);

}  // namespace palpate
