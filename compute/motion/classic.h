#pragma once

#include "compute/motion/solver.h"

namespace palpate {

/// The registration of the paper, exactly equation (34): one vector per voxel, Thirion's force with
/// the gradient of the fixed image, a Gaussian over the field after every iteration, coarse to fine
/// in steps of two. Every voxel is computed in every iteration and folds are not repaired: it is
/// the baseline for comparisons, not the recommended method. Confidence is 1 everywhere, since the
/// method estimates none. One thread at a time. Throws vulkan::Failure.
class ClassicSolver : public FieldSolver {
 public:
  ClassicSolver(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
                const MotionPlan& plan);

  std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                   const std::stop_token& stop,
                                   const SolveProgress& progress) override;
  void download(Field& field, Confidence& confidence) override;

 private:
  struct ClassicLevelImages {
    vulkan::Image field, other;
  };
  void begin_level(size_t l);
  void record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, const BrickList& bricks,
                        const vulkan::Buffer& list);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  std::vector<ClassicLevelImages> levels_;
  vulkan::Buffer download_;
  vulkan::Recorder recorder_;
};

}  // namespace palpate
