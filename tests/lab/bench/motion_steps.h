#pragma once

#include <functional>
#include <string>
#include <vector>

#include "compute/motion/bricks.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace palpate::bench {

/// One step of the engine on one level, ready to be recorded alone.
struct Step {
  std::string name;
  /// The minimum for one call.
  double bytes = 0.0;
  double calls = 0.0;  ///< in one estimation of a pair
  int dispatches = 1;
  std::function<void(vulkan::Recorder&)> record;
};

/// The images of one level, as PyramidBuilder and PairSolver have them, and the steps that work on
/// them. One thread. Throws vulkan::Failure.
class LevelSteps {
 public:
  /// `report`: of the level; null if the solver did not work on it.
  LevelSteps(const std::shared_ptr<vulkan::Context>& context, WarmPair& pair, size_t level,
             const LevelReport* report);

  const std::vector<Step>& steps() const { return steps_; }

 private:
  void add_pyramid();
  void add_data_term(double all, double half);
  void add_window(double calls);
  void add_update(double calls);
  void add_filter(double calls);
  void add_measure(double calls);

  WarmPair& pair_;
  const size_t l_;
  const LevelPlan level_;
  double voxels_ = 0.0, cells_ = 0.0, moment_cells_ = 0.0;
  vulkan::Image raw_, finer_, normalised_, packed_, moments_[2], no_mask_;
  vulkan::Image field_, ahead_, composed_, primal_, seen_, equations_[3], smoothed_[3], dual_[3],
      second_[6];
  BrickList bricks_, moment_bricks_;
  vulkan::Buffer list_, moment_list_, measures_, staging_;
  std::vector<Step> steps_;
};

}  // namespace palpate::bench
