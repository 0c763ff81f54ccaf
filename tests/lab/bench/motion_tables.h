#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "compute/vulkan/context.h"
#include "tests/lab/bench/ct_data.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/motion_contender.h"

namespace palpate::bench {

/// Options and results that all tables of motion share. Tables verify first, then time; they throw
/// Mismatch if the result is wrong, and vulkan::Failure if the device fails.
struct MotionBench {
  std::shared_ptr<vulkan::Context> context;
  int runs = 3;  ///< timed runs, of which the median counts
  /// Small grids: a test that the benchmark works.
  bool quick = false;
  /// The other methods to measure; new objects in each call. May return none.
  std::function<std::vector<std::unique_ptr<PairMethod>>()> peers;
  /// Seconds of one iteration of ITK's plain Demons on size^3 voxels, Gauss of one voxel.
  std::function<Result<double>(int size)> demons_iteration_s;
  /// found[measure][preset, or "peer"], for the table of targets; measures are named there.
  std::map<std::string, std::map<std::string, double>> found;
};

/// Error and time of every preset and peer on the beating heart and on the sliding organ.
Table phantom_table(MotionBench& bench);

/// What is saved because bricks without motion or without structure are left out.
Table resting_table(const MotionBench& bench);

/// The paper's method, every voxel computed: voxel-iterations per second on one level, and the same
/// of ITK's Demons.
Table classic_table(MotionBench& bench);

/// Sequences through SequenceEstimator: frames in host memory in, fields in host memory out.
Table sequence_table(const MotionBench& bench);

/// A pair of 512 x 512 x 400 and a sequence of ten such frames, where they fit the device.
Table large_table(const MotionBench& bench);

/// The real chest CT, the whole breath: error and time of every preset and peer.
Table breath_table(MotionBench& bench, const CtData& ct);
/// Two steps of its breathing sequence.
std::vector<Table> step_tables(MotionBench& bench, const CtData& ct);
/// The whole breath with another contrast in the moving frame.
Table gain_table(MotionBench& bench, const CtData& ct);
/// All pairs of the cycle: target registration error, and the drift of the whole cycle.
Table cycle_table(MotionBench& bench, const CtData& ct);
/// Forward against backward, and against the field's own inverse.
Table consistency_table(MotionBench& bench, const CtData& ct);

/// The results of the earlier tables, with the targets.
Table targets_table(const MotionBench& bench);

/// Of a field compared with the truth inside a mask. Throws Mismatch if it is not better than no
/// motion (`better` false: not checked).
struct Score {
  double mean_voxels = 0.0;
  double p95_voxels = 0.0;
};
Score score(const Field& field, const Field& truth, const Mask& mask, const std::string& what,
            bool better = true);

/// "128 x 128 x 128".
std::string size_text(const Grid& grid);

}  // namespace palpate::bench
