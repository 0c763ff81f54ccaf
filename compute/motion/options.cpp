#include "compute/motion/options.h"

namespace palpate {

std::optional<MotionOptions> motion_preset(std::string_view name) {
  MotionOptions options;
  options.preset = std::string(name);
  if (name == "fast") {
    options.levels = {{4, 4, 3.0, 0.3}, {15, 2, 3.0, 0.3}, {20, 2, 2.0, 0.15}, {20, 2, 2.0, 0.15}};
  } else if (name == "balanced") {
    options.levels = {{10, 4, 3.0, 0.3}, {15, 2, 3.0, 0.3}, {25, 2, 2.0, 0.15}, {25, 2, 2.0, 0.15}};
  } else if (name == "best") {
    options.levels = {{20, 4, 3.0, 0.3}, {30, 2, 3.0, 0.3}, {40, 2, 2.0, 0.15}, {40, 2, 2.0, 0.15}};
  } else {
    return std::nullopt;
  }
  return options;
}

}  // namespace palpate
