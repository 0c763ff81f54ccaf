#include "compute/motion/repair.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace palpate {
namespace {

// Lengths, in cells, over which a jump is smoothed, in turns: a jump of many cells needs a long
// ramp.
constexpr int kLengths = 3;
constexpr int kMaxRepairs = 200;  // rounds in all directions; a few suffice on all data tested

/// Bricks of two sorted lists.
BrickList both(const BrickList& a, const BrickList& b) {
  BrickList result;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

}  // namespace

void repair_folds(vulkan::Recorder& recorder, MotionKernels& kernels, const LevelPlan& level,
                  double min_determinant, int along, const FoldRepair& repair, BrickList looked_at,
                  SolveReport& report) {
  const glm::ivec4 cells(level.cells, 0);
  const auto list = [&](const BrickList& bricks) {
    std::copy(bricks.begin(), bricks.end(), repair.list.as<uint32_t>().begin());
  };
  // Later rounds: only the bricks whose cells the last one may have changed. Only there do the two
  // images differ.
  for (int round = 0; round < along + kMaxRepairs && !looked_at.empty(); ++round) {
    list(looked_at);
    recorder.restart();
    recorder.fill(repair.counts, 0, looked_at.size() * sizeof(uint32_t));
    recorder.dispatch(
        kernels.folds(),
        {repair.list,
         {repair.field, kernels.linear()},
         repair.flags,
         repair.counts,
         {repair.field, kernels.nearest()}},
        shaders::FoldsPush{cells, glm::ivec4(level.cell, 0), glm::ivec4(level.image_size, 0),
                           glm::vec4(level.spacing_mm, min_determinant)},
        slice_groups(looked_at));
    recorder.run();
    BrickList folded;
    report.folded_cells = 0;
    const auto counts = repair.counts.as<uint32_t>();
    for (size_t i = 0; i < looked_at.size(); ++i) {
      if (counts[i] > 0) folded.push_back(looked_at[i]);
      report.folded_cells += counts[i];
    }
    if (folded.empty()) return;
    ++report.repaired;
    const BrickList changing = with_neighbours(folded, level.cells);
    const BrickList written = both(looked_at, changing);
    list(written);
    recorder.restart();
    if (round < along) {
      recorder.dispatch(kernels.blend_along(),
                        {repair.list,
                         {repair.flags, kernels.nearest()},
                         {repair.field, kernels.linear()},
                         repair.other,
                         {repair.field, kernels.nearest()}},
                        shaders::BlendAlongPush{glm::ivec4(level.cells, 1 + round % kLengths),
                                                glm::vec4(level.cell_mm, 0)},
                        slice_groups(written));
    } else {
      recorder.dispatch(kernels.blend(),
                        {repair.list,
                         {repair.flags, kernels.nearest()},
                         {repair.field, kernels.nearest()},
                         repair.other},
                        shaders::BlendPush{cells}, slice_groups(written));
    }
    recorder.run();
    std::swap(repair.field, repair.other);
    looked_at = changing;
  }
}

}  // namespace palpate
