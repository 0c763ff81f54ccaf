#pragma once

#include <map>
#include <memory>
#include <string>

#include "compute/vulkan/context.h"
#include "tests/lab/bench/accuracy_data.h"
#include "tests/lab/bench/tools.h"

namespace palpate::bench {

/// What all accuracy tables need, and what they find for the table of targets.
struct AccuracyBench {
  std::shared_ptr<vulkan::Context> context;
  int threads = 2;
  int runs = 3;
  /// found[measure][preset or "ITK"]; measures are named where they are asked for (targets_table).
  std::map<std::string, std::map<std::string, double>> found;
};

// Each throws Mismatch if a field is no better than none, vulkan::Failure if the device fails.

/// The whole breath: every contender in alternation, error beside time.
Table pair_table(AccuracyBench& bench, const LungData& lung);
/// The same with another contrast in the moving frame.
Table gain_table(AccuracyBench& bench, const LungData& lung);
/// Two steps of the breathing sequence.
Table steps_table(AccuracyBench& bench, const LungData& lung);
/// All eight pairs of the cycle: target registration error, and the drift of the whole cycle.
Table cycle_table(AccuracyBench& bench, const LungData& lung);
/// Forward against backward, and against the field's own inverse.
Table consistency_table(AccuracyBench& bench, const LungData& lung);
/// The beating heart and the sliding organ.
Table made_table(AccuracyBench& bench);
/// The paper's method against ITK's Demons, per iteration.
Table rate_table(AccuracyBench& bench);
/// Everything that was found beside what is to be reached.
Table targets_table(const AccuracyBench& bench);

}  // namespace palpate::bench
