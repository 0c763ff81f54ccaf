#pragma once

#include <memory>
#include <string>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "compute/vulkan/context.h"
#include "tests/lab/bench/tools.h"

namespace palpate::bench {

/// What all cases share. Cases verify first, then time; they throw Mismatch if the answer is wrong
/// and vulkan::Failure if the device fails.
struct Bench {
  std::shared_ptr<vulkan::Context> context;
  int runs = 5;        ///< timed runs, of which the median counts
  bool quick = false;  ///< small grids: to see that everything works
};

/// Error and time of every preset on the beating heart and on the sliding organ.
Table phantom_table(const Bench& bench);

/// What it saves that bricks rest which do not move or show nothing.
Table resting_table(const Bench& bench);

/// The paper's method, every voxel computed: voxel-iterations per second on one level.
Table classic_table(const Bench& bench);

/// Sequences through SequenceEstimator: frames in host memory in, fields in host memory out.
Table sequence_table(const Bench& bench);

/// A pair of 512 x 512 x 400 and a sequence of ten such frames, where they fit the device.
Table large_table(const Bench& bench);

/// Of a field against truth inside a mask; throws Mismatch if it is not better than no motion at
/// all (`better` false: not asked).
struct Score {
  double mean_voxels = 0.0;
  double p95_voxels = 0.0;
};
Score score(const Field& field, const Field& truth, const Mask& mask, const std::string& what,
            bool better = true);

/// "128 x 128 x 128".
std::string size_text(const Grid& grid);

}  // namespace palpate::bench
