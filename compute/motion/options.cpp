#include "compute/motion/options.h"

namespace palpate {

std::optional<MotionOptions> motion_preset(std::string_view name) {
  MotionOptions options;
  options.preset = std::string(name);
  if (name == "fast") {
    options.levels = {{4, 4, 5.3, 0.25}, {12, 4, 1.2, 0.43}, {20, 2, 1.4, 0.36}};
  } else if (name == "balanced") {
    options.levels = {{10, 4, 5.3, 0.25}, {15, 4, 1.2, 0.43}, {25, 2, 1.4, 0.36}};
  } else if (name == "best") {
    options.levels = {{20, 4, 5.3, 0.25}, {30, 4, 1.2, 0.43}, {40, 2, 1.4, 0.36}};
  } else if (name == "classic") {
    options.method = MotionMethod::kClassic;
    options.levels = {{50, 1}, {50, 1}, {50, 1}, {50, 1}};
    options.normalise = false;
    options.converged = 0.0;
    options.structure = 0.0;
    options.search_mm = 0.0;
  } else {
    return std::nullopt;
  }
  return options;
}

}  // namespace palpate
