#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "compute/motion/bricks.h"
#include "compute/motion/discrete_start.h"
#include "compute/motion/pyramid.h"
#include "compute/motion/region.h"
#include "compute/motion/report.h"
#include "compute/motion/slab_images.h"
#include "compute/motion/sliding_borders.h"

namespace palpate {

/// Called between submissions with the share of the work that is done, 0 to 1.
using SolveProgress = std::function<void(double)>;

/// Estimates fields on the device. Planned once, solves many pairs. One thread at a time. Throws
/// vulkan::Failure.
class FieldSolver {
 public:
  virtual ~FieldSolver() = default;

  /// Solves a pair; the field then stays on the device for download(). Empty if stopped. If
  /// something moves further than moving.reach_mm() it ends early, without a field, and the report
  /// has out_of_reach set.
  virtual std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                           const std::stop_token& stop,
                                           const SolveProgress& progress) = 0;

  /// The field of the last solve, on plan.field, LPS mm, with its confidence, whose deviation is on
  /// the cells of the finest level.
  virtual void download(Field& field, Confidence& confidence) = 0;
};

/// palpate's own method, coarse to fine. Each level iterates
///   data term (normal_equations) - Gaussian window, on the finest level two - Gauss-Newton step,
///   composed (update, update_two) - total variation (tv_*),
/// on the bricks that still need it. Where a coarser level leaves an unexplained difference, larger
/// motion is searched for, and what it dragged along is put back to rest. At the end folds are
/// repaired.
class PairSolver : public FieldSolver {
 public:
  PairSolver(std::shared_ptr<vulkan::Context> context, std::shared_ptr<MotionKernels> kernels,
             const MotionPlan& plan, const Region& region);

  std::optional<SolveReport> solve(const FramePyramid& fixed, const FramePyramid& moving,
                                   const std::stop_token& stop,
                                   const SolveProgress& progress) override;
  void download(Field& field, Confidence& confidence) override;

 private:
  /// What a level leaves at its end: (-, r^2, w, q) of each cell as fp16, see
  /// normal_equations.comp.
  using Left = std::span<const uint64_t>;
  /// Images of one level, all of the size of its field.
  struct LevelImages {
    vulkan::Image field, ahead, composed, primal, seen, flags;
    vulkan::Image equations[3], smoothed[3], dual[3];
    // Dual of the second differences, six images; empty if the level does not filter them.
    std::vector<vulkan::Image> second;
    // Only if the level yields: the equations under its wide window, and what the next coarser
    // level left of them.
    vulkan::Image wide[3], coarser;
    // Only if its window is chosen: the field at that time with and without its momentum, the
    // equations, and what the narrow window gains.
    vulkan::Image start, before, whole[3], gain[2];
  };
  /// Makes `bricks` the active ones for what follows.
  void activate(BrickList bricks);
  vulkan::Buffer& active_list() { return lists_[list_]; }
  const vulkan::Image* narrow(size_t l) const;
  const vulkan::Image* windowed(size_t l) const;
  void record_left(vulkan::Recorder& recorder, size_t l);
  Left left_on(size_t l);
  void record_coarser(vulkan::Recorder& recorder, size_t l);
  /// Records to clear the images of the filter, of the data term and of its windows.
  void record_clear_terms(size_t l);
  void begin_level(size_t l);
  void take_over(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                 LevelReport& report);
  void record_upsampled(vulkan::Recorder& recorder, size_t l, const vulkan::Image& from,
                        glm::ivec3 from_cells, glm::ivec3 from_cell, const vulkan::Image& to,
                        const vulkan::Image& to_as_well);
  std::vector<glm::ivec3> unexplained(size_t l, Left left, double noise) const;
  std::vector<uint32_t> nodes_at(const std::vector<glm::ivec3>& cells,
                                 const SearchPlan& search) const;
  BrickList bricks_at(const std::vector<glm::ivec3>& cells, size_t l) const;
  void choose(size_t l, const FramePyramid& fixed, const FramePyramid& moving, BrickList bricks,
              glm::vec2 gain, const std::function<void()>& record_other);
  /// Returns the work that was done, in nodes times labels.
  double search(size_t l, DiscreteStart& start, const std::vector<glm::ivec3>& cells,
                const FramePyramid& fixed, const FramePyramid& moving);
  void rest(size_t l, const std::vector<glm::ivec3>& cells, const FramePyramid& fixed,
            const FramePyramid& moving);
  void record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, int colour);
  void record_equations(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                        const FramePyramid& moving, int colour);
  void record_windows(vulkan::Recorder& recorder, size_t l);
  void record_step(vulkan::Recorder& recorder, size_t l, int colour);
  void record_filter(vulkan::Recorder& recorder, size_t l, int steps);
  void record_measure(vulkan::Recorder& recorder, size_t l);
  /// Goes on up to `until` iterations of the level in all. False if something moved further than
  /// moving.reach_mm().
  bool iterate(size_t l, int until, const FramePyramid& fixed, const FramePyramid& moving,
               const std::stop_token& stop, LevelReport& report,
               const std::function<void(int)>& done);
  void record_copy(vulkan::Recorder& recorder, size_t l, const vulkan::Image& from,
                   const vulkan::Image& to, const vulkan::Image& to_as_well);
  void record_refit(vulkan::Recorder& recorder, size_t l, const vulkan::Image* equations);
  void record_left_out(size_t l, const vulkan::Image* from, const vulkan::Image* to, int part);
  void record_choice(size_t l);
  void iterate_and_choose(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                          LevelReport& report);
  void repair(size_t l, SolveReport& report);
  void judge(size_t l);

  std::shared_ptr<vulkan::Context> context_;
  std::shared_ptr<MotionKernels> kernels_;
  const MotionPlan plan_;
  std::vector<BrickList> bricks_;  // per level: those that the mask leaves
  std::vector<LevelImages> levels_;
  std::vector<std::unique_ptr<DiscreteStart>> starts_;
  DiscreteStart::Costs costs_;
  std::unique_ptr<SlidingBorders> sliding_;  // null if the plan does not contain it
  BrickList active_;                         // the bricks in work
  // The same on the device, and lists that were active before: work that still runs reads them.
  std::vector<vulkan::Buffer> lists_;
  size_t list_ = 0;
  vulkan::Buffer measures_, read_measures_;  // BrickMeasure of each, on the device and here
  std::unique_ptr<SlabImages> slabs_;        // null if the finest images are on the device whole
  // Upper limit on the distance of corresponding voxels along k, in slices of the finest level.
  double reach_ = 0.0;
  double noise_ = 0.0;                // r^2 that noise leaves on the level above one that yields
  bool window_chosen_ = false;        // on the level that yields, in this solve
  std::optional<size_t> left_level_;  // whose unexplained difference is in download_
  vulkan::Buffer counts_;             // number of folded cells of each brick
  vulkan::Buffer download_, deviation_;
  // Reused, since creating command buffers and their pools takes longer than running them on a GPU.
  // One for work that runs once, one for iterations. The first is started without waiting where the
  // second follows: on a GPU waiting takes as long as 20 steps.
  vulkan::Recorder recorder_, batch_;
};

/// Step number k of n of a cycle of dual steps, in the longest one that is stable alone. Longer and
/// shorter steps together are stable and lead further than n equal ones: n (n + 1) / 3 instead of n
/// (fast explicit diffusion; Weickert et al. 2016, "Cyclic schemes for PDE-based image analysis").
/// The longest is the first one, so that the others damp what it amplifies.
double cycle_step(int k, int n);

/// Number of voxels whose noise a window (SD in h) over a level's cells averages: a Gaussian of SD
/// s averages 2 sqrt(pi) s samples of white noise.
double window_voxels(const LevelPlan& level, double window);

/// Converts the texels of a device image (u in mm along the image axes, w the confidence) to LPS.
void unpack_field(std::span<const glm::vec4> device, const MotionPlan& plan, Field& field,
                  Confidence& confidence);

}  // namespace palpate
