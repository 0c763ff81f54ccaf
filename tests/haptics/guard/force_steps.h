#pragma once

#include <algorithm>

#include "module/haptics/tick.h"

namespace palpate::test {

/// The largest change of a scene's force from one tick to the next, N per ms.
class ForceSteps {
 public:
  void add(const TickOutput& out) {
    if (known_) worst_n_ = std::max(worst_n_, glm::length(out.wanted_n - last_n_));
    last_n_ = out.wanted_n;
    known_ = true;
  }
  double worst_n() const { return worst_n_; }
  glm::dvec3 last_n() const { return last_n_; }

 private:
  glm::dvec3 last_n_{0.0};
  double worst_n_ = 0.0;
  bool known_ = false;
};

}  // namespace palpate::test
