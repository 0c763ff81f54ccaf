#pragma once

#include <map>
#include <memory>
#include <stop_token>

#include "compute/motion/pyramid.h"
#include "compute/motion/report.h"

namespace palpate {

/// The last step of a pair: the field on the cells of the result, finer ones or those that were
/// solved, with borders at which material slides. On the levels such a border becomes a ramp some
/// cells wide, since windows and local normalisation mix both sides. Here each cell beside an edge
/// of the field may take over the motion of a cell further along an axis, if the intensities then
/// match better by more than noise explains. Only bricks are processed in which they do not match
/// yet and the motion nearby differs. One thread at a time. Throws vulkan::Failure.
class SlidingBorders {
 public:
  SlidingBorders(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                 const MotionPlan& plan);

  /// `solved`: u (mm along the image axes) and confidence on the finest level's cells, without
  /// folds. Waits. The result, also without folds, is field(). False, without a result, if stopped.
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
  void choose(int first, const BrickList& bricks, const FramePyramid& fixed,
              const FramePyramid& moving, const vulkan::Image& means);
  void record_take(const BrickList& bricks);
  BrickList read_around(const BrickList& bricks) const;
  static BrickList with(const Candidates& all, uint32_t candidates);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const SlidingOptions options_;
  const double min_determinant_;
  const LevelPlan level_, fine_;
  const glm::ivec3 step_;      // cells between candidates
  const glm::vec4 different_;  // when two motions count as on two sides of a border
  const bool alone_;           // costs are not summed over neighbours: cells are large enough
  const BrickList coarse_bricks_;
  vulkan::Buffer coarse_list_;
  vulkan::Buffer list_, near_list_;  // bricks in work, and these with their neighbourhood
  vulkan::Buffer work_;              // the result for each brick
  vulkan::Image field_, other_;      // u and confidence
  vulkan::Image costs_, smoothed_;   // of four candidates
  vulkan::Image chosen_;  // cost that a candidate must stay below, and the candidate that does
  vulkan::Image means_[2];
  vulkan::Recorder recorder_;
};

}  // namespace palpate
