#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "compute/motion/bricks.h"
#include "compute/motion/pyramid.h"

namespace palpate {

/// What one level cost and why it ended.
struct LevelReport {
  double h_mm = 0.0;
  int iterations = 0;
  bool converged = false;
  double seconds = 0.0;
  size_t bricks = 0;  ///< of the field that were computed
  size_t all_bricks = 0;
};

struct SolveReport {
  std::vector<LevelReport> levels;  ///< coarsest first
  int repaired = 0;                 ///< rounds of fold repair
  size_t folded_cells = 0;          ///< left after repair: 0 unless the repair failed
};

/// Called between submissions with the share of the work that is done, 0 to 1.
using SolveProgress = std::function<void(double)>;

/// Estimates the field of one pair on the device: coarse to fine, each level an iteration of
///   data term (normal_equations) - Gaussian window - Gauss-Newton step, composed (update) - total
///   variation (tv_*).
/// Plan once, solve many pairs. One thread at a time. Throws vulkan::Failure.
class PairSolver {
 public:
  PairSolver(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
             const MotionPlan& plan);

  /// Solves; the field then waits on the device for download(). Returns nothing if stopped.
  std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                   const std::stop_token& stop, const SolveProgress& progress);

  /// The field of the last solve, on plan.field, in LPS mm.
  Field download();

 private:
  /// Images of one level, all of the size of its field.
  struct LevelImages {
    vulkan::Image field, ahead, composed, primal, seen, flags;
    vulkan::Image equations[3], smoothed[3], dual[3];
  };
  struct Active {
    BrickList bricks;
    vulkan::Buffer list;
  };

  void begin_level(size_t l);
  void record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, const Active& active);
  void record_filter(vulkan::Recorder& recorder, size_t l, const Active& active);
  void iterate(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
               const Active& active, const std::stop_token& stop, LevelReport& report,
               const std::function<void(int)>& done);
  void repair(size_t l, SolveReport& report);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  std::vector<LevelImages> levels_;
  vulkan::Buffer counter_;
  vulkan::Buffer download_;
};

}  // namespace palpate
