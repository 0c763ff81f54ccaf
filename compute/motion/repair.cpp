#include "compute/motion/repair.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace palpate {
namespace {

// Rounds of the vector median, before jumps are smoothed.
constexpr int kMedians = 4;
// Lengths, in cells, over which a jump is smoothed, and rounds with each, in turns. Short ones
// first: most folds need no more. A jump of many cells needs a longer ramp.
constexpr int kLengths = 2;
constexpr int kRoundsOfLength = 3;
// Rounds in all directions. A few suffice; but a jump of many cells becomes a ramp as long only if
// what lies beside it is smoothed, too: after kRoundsAtFolds whole bricks are, several times each.
constexpr int kMaxRepairs = 600;
constexpr int kRoundsAtFolds = 200;
constexpr int kPassesOverBricks = 16;

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
  const auto list = [&](const BrickList& bricks) {
    std::copy(bricks.begin(), bricks.end(), repair.list.as<uint32_t>().begin());
  };
  // Later rounds: only the bricks whose cells the last one may have changed. Only there do the two
  // images differ. To look between the cells' middles, too, takes about eight times as long. It is
  // left to the end where folds are likely, and done only where the field has changed since.
  BrickList not_yet;  // looked at between the middles
  bool between = along == 0;
  for (int round = 0; round < along + kMaxRepairs && !looked_at.empty();) {
    list(looked_at);
    recorder.restart();
    recorder.fill(repair.counts, 0, looked_at.size() * sizeof(uint32_t));
    recorder.dispatch(kernels.folds(),
                      {repair.list,
                       {repair.field, kernels.linear()},
                       repair.flags,
                       repair.counts,
                       {repair.field, kernels.nearest()}},
                      shaders::FoldsPush{glm::ivec4(level.cells, between ? 1 : 0),
                                         glm::ivec4(level.cell, 0), glm::ivec4(level.image_size, 0),
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
    if (!between) not_yet = both(not_yet, looked_at);
    if (folded.empty() && between) return;
    if (folded.empty()) {
      between = true;
      looked_at = std::exchange(not_yet, {});
      continue;
    }
    ++report.repaired;
    const BrickList changing = with_neighbours(folded, level.cells);
    const BrickList written = both(looked_at, changing);
    list(written);
    recorder.restart();
    if (round < std::min(along, kMedians)) {
      recorder.dispatch(kernels.median(),
                        {repair.list,
                         {repair.flags, kernels.nearest()},
                         {repair.field, kernels.nearest()},
                         repair.other},
                        shaders::MedianPush{glm::ivec4(level.cells, 0)}, slice_groups(written));
    } else if (round < along) {
      const int length = 1 + (round - kMedians) / kRoundsOfLength % kLengths;
      recorder.dispatch(
          kernels.blend_along(),
          {repair.list,
           {repair.flags, kernels.nearest()},
           {repair.field, kernels.linear()},
           repair.other,
           {repair.field, kernels.nearest()}},
          shaders::BlendAlongPush{glm::ivec4(level.cells, length), glm::vec4(level.cell_mm, 0)},
          slice_groups(written));
    } else {
      recorder.dispatch(kernels.blend(),
                        {repair.list,
                         {repair.flags, kernels.nearest()},
                         {repair.field, kernels.nearest()},
                         repair.other},
                        shaders::BlendPush{glm::ivec4(level.cells, 0)}, slice_groups(written));
    }
    recorder.run();
    std::swap(repair.field, repair.other);
    looked_at = changing;
    // The two images differ in the bricks that change only, so the passes over these are enough.
    // The cells beside them may fold now.
    if (round >= along + kRoundsAtFolds) {
      list(changing);
      for (int pass = 0; pass < kPassesOverBricks; ++pass) {
        recorder.restart();
        recorder.dispatch(kernels.blend(),
                          {repair.list,
                           {repair.flags, kernels.nearest()},
                           {repair.field, kernels.nearest()},
                           repair.other},
                          shaders::BlendPush{glm::ivec4(level.cells, 1)}, slice_groups(changing));
        recorder.run();
        std::swap(repair.field, repair.other);
      }
      looked_at = with_neighbours(changing, level.cells);
    }
    between = round >= along;
    ++round;
  }
}

}  // namespace palpate
