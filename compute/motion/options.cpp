#include "compute/motion/options.h"

#include <algorithm>

namespace palpate {
namespace {

/// The step for sliding borders on cells of the levels. Such a cell is too coarse to follow steep
/// motion, so its neighbour's motion often matches a little better, though nothing slides: only
/// clearly better candidates count (docs/decisions/motion/sliding-borders.md).
SlidingOptions on_cells_of(const LevelOptions& level, SlidingOptions sliding) {
  sliding.cell = level.cell;
  sliding.share = std::max(sliding.share, 0.5);
  sliding.slope = std::max(sliding.slope, 0.4);
  return sliding;
}

}  // namespace

std::optional<MotionOptions> motion_preset(std::string_view name) {
  MotionOptions options;
  options.preset = std::string(name);
  // Finest level first: iterations, cell, window, smoothness. On the finest level the window does
  // the smoothing, above it the total variation, too. The finest level's values were found by
  // random search on a chest CT and a heart phantom. How it yields where its window is too wide,
  // and the values of the levels above, were found by leaving out one anatomy with known motion at
  // a time (palpate-lab anatomies, docs/decisions/motion-engine.md).
  if (name == "fast") {
    options.levels = {{3, 4, 7.0, 0.06}, {8, 4, 3.0, 0.16}, {12, 4, 3.0, 0.1}};
    options.normalise_window = 3.0;  // wide enough for moments on cells of four voxels
    options.search_work = 1e7;
    options.yield.window = 2.5;
    options.sliding = on_cells_of(options.levels.front(), options.sliding);
  } else if (name == "balanced") {
    options.levels = {{10, 4, 7.0, 0.06, 0.005}, {12, 4, 3.0, 0.16}, {25, 4, 3.0, 0.1}};
    options.filter_steps = 3;
    options.search_work = 1e7;
    options.yield.window = 2.5;
    options.yield.choose_after = 5;
    options.sliding.cell = 2;
  } else if (name == "best") {
    options.levels = {{20, 4, 7.0, 0.04, 0.025}, {25, 4, 3.0, 0.16}, {40, 4, 3.0, 0.1}};
    options.filter_steps = 6;
    options.checkerboard = false;
    options.search_work = 6e7;
    options.yield.window = 2.5;
    options.yield.smoothness = 0.08;
    options.yield.choose_after = 6;
    options.sliding.cell = 2;
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

MotionOptions on_solved_cells(MotionOptions options) {
  if (options.sliding.cell > 0)
    options.sliding = on_cells_of(options.levels.front(), options.sliding);
  return options;
}

MotionOptions without_sliding_step(MotionOptions options) {
  options.sliding.cell = 0;
  return options;
}

}  // namespace palpate
