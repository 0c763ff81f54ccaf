#include "module/scene/cycle_closing.h"

namespace palpate {
namespace {

// The cycle is close to the identity, so correcting the start by the error at the end converges
// fast.
constexpr int kMostRounds = 8;
constexpr double kClosed = 1e-9;  // of a cell

glm::dvec3 up_to_last(const std::vector<std::shared_ptr<const MotionMap>>& steps, glm::dvec3 x) {
  for (size_t s = 0; s + 1 < steps.size(); ++s)
    if (steps[s]) x += steps[s]->displacement(x);
  return x;
}

glm::dvec3 last_step(const std::vector<std::shared_ptr<const MotionMap>>& steps, glm::dvec3 x) {
  return steps.back() ? steps.back()->displacement(x) : glm::dvec3(0.0);
}

}  // namespace

glm::dvec3 closing_forward(const std::vector<std::shared_ptr<const MotionMap>>& steps,
                           glm::dvec3 last) noexcept {
  const glm::dvec3 end = last + last_step(steps, last);
  const double cell = steps.back() ? steps.back()->cell_m() : 1e-3;
  glm::dvec3 start = end;
  double before = 1e300;
  for (int round = 0; round < kMostRounds; ++round) {
    const glm::dvec3 miss = up_to_last(steps, start) - last;
    const double size = glm::length(miss);
    if (size <= kClosed * cell) return start - end;
    if (!(size < before)) break;
    before = size;
    // The last step undoes what the others did, so the same miss at the end of the others is this
    // miss at the start.
    const glm::dvec3 landed = last + miss;
    start -= (landed + last_step(steps, landed)) - end;
  }
  return before < 1e-3 * cell ? start - end : glm::dvec3(0.0);
}

glm::dvec3 closing_backward(const std::vector<std::shared_ptr<const MotionMap>>& steps,
                            glm::dvec3 first) noexcept {
  const glm::dvec3 last = up_to_last(steps, first);
  return first - (last + last_step(steps, last));
}

}  // namespace palpate
