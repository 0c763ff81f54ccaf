#pragma once

#include <map>
#include <memory>
#include <stop_token>

#include "compute/motion/pyramid.h"
#include "compute/motion/report.h"

namespace palpate {

/// The last step of a pair: the field on the result's finer cells, and there the borders at which
/// material slides. The levels leave a ramp some cells wide across such a border, since their
/// windows and their local normalisation hold both sides. Here each cell beside an edge of the
/// field may take over the motion of a cell further along an axis, if the intensities themselves
/// then fit better by more than noise explains; only bricks in which they do not fit yet and
/// something moves otherwise nearby are worked on. One thread at a time. Throws vulkan::Failure.
class SlidingBorders {
 public:
  SlidingBorders(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan);

  /// `solved`: u (mm along the image axes) and confidence on the finest level's cells, without
  /// folds. Waits. The result, without folds as well, is field(). False, and no result, if stopped.
  bool solve(const FramePyramid& fixed, const FramePyramid& moving, const vulkan::Image& solved,
             const std::stop_token& stop, SolveReport& report);

  /// u and confidence on plan.field.
  const vulkan::Image& field() const { return field_; }

 private:
  using Candidates = std::map<uint32_t, uint32_t>;  // bits, of bricks
  struct SteepCandidates {
    Candidates candidates;
    BrickList steep;
  };
  const vulkan::Image& record_means(const FramePyramid& fixed, const FramePyramid& moving,
                                    const vulkan::Image& solved);
  void record_cost(int first, const FramePyramid& fixed, const FramePyramid& moving,
                   const vulkan::Image& means, const BrickList& near);
  const vulkan::Image& record_smooth(const BrickList& bricks);
  SteepCandidates begin(const vulkan::Image& solved);
  Candidates find_work(const BrickList& bricks, const FramePyramid& fixed,
                       const vulkan::Image& costs);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const SlidingOptions options_;
  const double min_determinant_;
  const LevelPlan level_, fine_;
  const glm::ivec3 step_;      // cells from candidate to candidate
  const glm::vec4 different_;  // what makes two motions lie across a border
  const BrickList coarse_bricks_;
  vulkan::Buffer coarse_list_;
  vulkan::Buffer list_, near_list_;  // bricks in work, and these with what lies around them
  vulkan::Buffer work_;              // what was found in each
  vulkan::Image field_, other_;      // u and confidence
  vulkan::Image costs_, smoothed_;   // of four candidates
  vulkan::Image chosen_;             // what a candidate must stay below, and which does
  vulkan::Image means_[2];
  vulkan::Recorder recorder_;
};

}  // namespace palpate
