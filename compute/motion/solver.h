#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "compute/motion/bricks.h"
#include "compute/motion/discrete_start.h"
#include "compute/motion/pyramid.h"
#include "compute/motion/region.h"
#include "compute/motion/report.h"
#include "compute/motion/sliding_borders.h"

namespace palpate {

/// Called between submissions with the share of the work that is done, 0 to 1.
using SolveProgress = std::function<void(double)>;

/// Estimates fields on the device. Plan once, solve many pairs. One thread at a time. Throws
/// vulkan::Failure.
class FieldSolver {
 public:
  virtual ~FieldSolver() = default;

  /// Solves; the field then waits on the device for download(). Returns nothing if stopped. If
  /// something moves further than moving.reach_mm() it ends early and the report says so
  /// (out_of_reach): there is no field then.
  virtual std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                           const std::stop_token& stop,
                                           const SolveProgress& progress) = 0;

  /// The field of the last solve, on plan.field, in LPS mm, and how far to trust it.
  virtual void download(Field& field, Confidence& confidence) = 0;
};

/// palpate's own method: coarse to fine, each level an iteration of
///   data term (normal_equations) - Gaussian window, on the finest level two - Gauss-Newton step,
///   composed (update, update_two) - total variation (tv_*),
/// on the bricks that still need it, where a coarse level leaves something unexplained a search for
/// larger motion, and a repair after which nothing folds.
class PairSolver : public FieldSolver {
 public:
  PairSolver(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
             const MotionPlan& plan, const Region& region);

  std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                   const std::stop_token& stop,
                                   const SolveProgress& progress) override;
  void download(Field& field, Confidence& confidence) override;

 private:
  /// Images of one level, all of the size of its field.
  struct LevelImages {
    vulkan::Image field, ahead, composed, primal, seen, flags;
    vulkan::Image equations[3], smoothed[3], dual[3];
    // Only where the level yields: the equations under its wide window, and what the next coarser
    // level left of them.
    vulkan::Image wide[3], coarser;
  };
  /// What follows works on these bricks. The device must be done with the ones before.
  void activate(BrickList bricks);
  const vulkan::Image* narrow(size_t l) const;
  const vulkan::Image* windowed(size_t l) const;
  std::vector<glm::vec4> left_on(size_t l);
  void record_coarser(vulkan::Recorder& recorder, size_t l);
  void begin_level(size_t l);
  void record_upsampled(vulkan::Recorder& recorder, size_t l, const vulkan::Image& from,
                        glm::ivec3 from_cells, glm::ivec3 from_cell, const vulkan::Image& to,
                        const vulkan::Image& to_as_well);
  std::vector<uint32_t> unexplained(const SearchPlan& search);
  /// Returns the work that was done, nodes times labels.
  double search(size_t l, DiscreteStart& start, const FramePyramid& fixed,
                const FramePyramid& moving);
  void record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, int colour);
  void record_equations(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, int colour);
  void record_step(vulkan::Recorder& recorder, size_t l, int colour);
  void record_filter(vulkan::Recorder& recorder, size_t l);
  void record_measure(vulkan::Recorder& recorder, size_t l);
  /// False if something moved out of the moving frame's reach.
  bool iterate(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
               const std::stop_token& stop, LevelReport& report,
               const std::function<void(int)>& done);
  void repair(size_t l, SolveReport& report);
  void judge(size_t l);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  std::vector<BrickList> bricks_;  // per level: what the mask leaves
  std::vector<LevelImages> levels_;
  std::vector<std::unique_ptr<DiscreteStart>> starts_;
  DiscreteStart::Costs costs_;
  std::unique_ptr<SlidingBorders> sliding_;  // only if the plan has one
  BrickList active_;                         // the bricks in work
  vulkan::Buffer active_list_;               // the same on the device
  vulkan::Buffer measures_, read_measures_;  // BrickMeasure of each, on the device and here
  vulkan::Image fixed_slab_, moving_slab_;   // where slabs of the finest images visit the device
  double noise_ = 0.0;                       // what it leaves on the level above one that yields
  vulkan::Buffer counts_;                    // cells that fold, of each brick
  vulkan::Buffer download_;
  // Kept, since making and freeing what lists of commands need takes longer than running them on a
  // GPU: one for what runs once, one for iterations.
  vulkan::Recorder recorder_, batch_;
};

/// Voxels whose noise a window (SD in h) over a level's cells averages: a Gaussian of SD s averages
/// 2 sqrt(pi) s samples of white noise.
double window_voxels(const LevelPlan& level, double window);

/// The field that a device image holds (u in mm along the image axes, w the confidence) in LPS.
void unpack_field(std::span<const glm::vec4> device, const MotionPlan& plan, Field& field,
                  Confidence& confidence);

}  // namespace palpate
