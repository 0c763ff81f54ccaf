#include <algorithm>
#include <cmath>

#include "compute/motion/activity.h"
#include "compute/motion/gauss.h"
#include "compute/motion/solver.h"

/// What one iteration of PairSolver is made of, as commands for the device.
namespace palpate {
namespace {

// Step of the projected dual ascent: 1 / (largest eigenvalue of D D^T), which is 4 per axis with
// unit slopes.
double dual_step(glm::dvec3 slope) {
  return 1.0 / (4.0 * glm::dot(slope, slope));
}

/// Differences per mm, made relative to the coarsest axis of the field: anisotropic cells get
/// isotropic smoothness. Along an axis of one cell there are none, and its edge says nothing.
glm::dvec3 slopes(const LevelPlan& level) {
  const glm::dvec3 has_neighbours(glm::greaterThan(level.cells, glm::ivec3(1)));
  const glm::dvec3 edges = level.cell_mm * has_neighbours;
  const double reference = std::max({edges.x, edges.y, edges.z});
  if (reference == 0.0) return glm::dvec3(1.0);
  return reference / level.cell_mm * has_neighbours;
}

/// SD in cells of a window over the normal equations, SD in h.
glm::dvec3 window_sigma(const LevelPlan& level, double window) {
  return window * level.h_mm / level.cell_mm;
}

/// SD in cells of what makes the narrow window of a level that yields the wide one.
glm::dvec3 widening_sigma(const LevelPlan& level, double narrow) {
  const double wide = level.options.window;
  return window_sigma(level, std::sqrt(wide * wide - narrow * narrow));
}

constexpr double kCoarserSigma = 1.0;  // cells: over what the coarser level leaves, against noise

glm::ivec4 wide(glm::ivec3 v, int w = 0) {
  return {v, w};
}

}  // namespace

/// Where the equations are under the first window: each axis that needs smoothing swaps the two
/// sets of images.
const vulkan::Image* PairSolver::narrow(size_t l) const {
  const LevelPlan& level = plan_.levels[l];
  const double window = yields(plan_, l) ? plan_.options.yield.window : level.options.window;
  return gauss_swaps(level.cells, window_sigma(level, window)) ? levels_[l].smoothed
                                                               : levels_[l].equations;
}

/// Where they are under the level's own window, which on a level that yields is the second.
const vulkan::Image* PairSolver::windowed(size_t l) const {
  if (!yields(plan_, l)) return narrow(l);
  const LevelPlan& level = plan_.levels[l];
  const LevelImages& i = levels_[l];
  const int passes = gauss_passes(level.cells, widening_sigma(level, plan_.options.yield.window));
  if (passes == 0) return narrow(l);
  return passes % 2 == 1 ? i.wide : narrow(l) == i.smoothed ? i.equations : i.smoothed;
}

/// What level l + 1 leaves unexplained, on the cells of level l. The dual of that level, which has
/// ended, is the scratch space.
void PairSolver::record_coarser(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& from = plan_.levels[l + 1];
  const LevelPlan& to = plan_.levels[l];
  LevelImages& i = levels_[l + 1];
  const vulkan::Image& left = windowed(l + 1)[2];
  const glm::dvec3 sigma(kCoarserSigma);
  record_gauss(recorder, *kernels_, active_list_, brick_groups(active_), sigma, {&left},
               {&i.dual[0]}, {&i.dual[1]});
  const int passes = gauss_passes(from.cells, sigma);
  const vulkan::Image& smooth = passes == 0 ? left : passes % 2 == 1 ? i.dual[0] : i.dual[1];
  const glm::dvec3 scale = glm::dvec3(to.cell) / glm::dvec3(from.ratio) / glm::dvec3(from.cell);
  const shaders::UpsamplePush push{wide(to.cells), wide(from.cells), glm::vec4(scale, 0),
                                   glm::vec4(0.5 * scale - 0.5, 0)};
  recorder.dispatch(kernels_->upsample(),
                    {{smooth, kernels_->linear()}, levels_[l].coarser, levels_[l].wide[0]}, push,
                    {(to.cells.x + 63) / 64, to.cells.y, to.cells.z});
}

void PairSolver::record_filter(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active_);
  const glm::dvec3 slope = slopes(level);
  const shaders::TotalVariationPush push{
      wide(level.cells),
      glm::vec4(slope, 0),
      {float(level.options.smoothness * level.h_mm), float(dual_step(slope)),
       float(plan_.options.huber_mm), float(plan_.options.momentum)}};
  const auto primal = [&](bool last) {
    recorder.dispatch(kernels_->tv_primal(last),
                      {active_list_,
                       {i.composed, nearest},
                       {i.dual[0], nearest},
                       {i.dual[1], nearest},
                       {i.dual[2], nearest},
                       {i.field, nearest},
                       last ? i.field : i.primal,
                       i.ahead},
                      push, groups);
  };
  for (int step = 0; step < plan_.options.filter_steps; ++step) {
    primal(false);
    recorder.dispatch(kernels_->tv_dual(),
                      {active_list_,
                       {i.primal, nearest},
                       {i.dual[0], nearest},
                       {i.dual[1], nearest},
                       {i.dual[2], nearest},
                       i.dual[0],
                       i.dual[1],
                       i.dual[2]},
                      push, groups);
  }
  primal(true);
}

/// The data term. Images cut into slabs visit the device pair by pair of slabs; each dispatch adds
/// the voxels whose own and whose partner's slice the two answer for.
void PairSolver::record_equations(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                                  const FramePyramid& moving, int colour) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  constexpr int kFar = 1 << 20;
  const auto dispatch = [&](const vulkan::Image& f, const vulkan::Image& m,
                            const shaders::NormalEquationsPush& push) {
    recorder.dispatch(kernels_->normal_equations(level.cell),
                      {active_list_,
                       {f, nearest},
                       {m, kernels_->linear()},
                       {i.ahead, nearest},
                       i.equations[0],
                       i.equations[1],
                       i.equations[2],
                       {i.equations[0], nearest},
                       {i.equations[1], nearest},
                       {i.equations[2], nearest}},
                      push, slice_groups(active_));
  };
  const int nz = level.image_size.z;
  shaders::NormalEquationsPush push{
      wide(level.cells, colour), wide(level.image_size), wide(level.image_size),
      {nz, -kFar, kFar, 0},      {nz, 0, nz, 0},         glm::vec4(level.spacing_mm, 0)};
  if (l > 0 || plan_.slabs == 1) {
    dispatch(fixed.level(l), moving.level(l), push);
    return;
  }
  const std::vector<Slab> slabs = slabs_of(plan_);
  for (size_t a = 0; a < slabs.size(); ++a) {
    recorder.copy(fixed.slab(a), fixed_slab_);
    push.fixed_size.w = slabs[a].first;
    push.fixed_slab = {slabs[a].depth, slabs[a].begin, slabs[a].end, 0};
    for (size_t b = 0; b < slabs.size(); ++b) {
      recorder.copy(moving.slab(b), moving_slab_);
      push.moving_size.w = slabs[b].first;
      push.moving_slab = {slabs[b].depth, b == 0 ? -kFar : slabs[b].begin,
                          b + 1 == slabs.size() ? kFar : slabs[b].end, a + b > 0};
      dispatch(fixed_slab_, moving_slab_, push);
    }
  }
}

void PairSolver::record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                                  const FramePyramid& moving, int colour) {
  record_equations(recorder, l, fixed, moving, colour);
  record_step(recorder, l, colour);
  record_filter(recorder, l);
}

/// The windows over the equations, and the step from them.
void PairSolver::record_step(vulkan::Recorder& recorder, size_t l, int colour) {
  const LevelPlan& level = plan_.levels[l];
  const YieldOptions& yield = plan_.options.yield;
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active_);
  using Images = std::vector<const vulkan::Image*>;
  const auto all = [](const vulkan::Image* images) {
    return Images{&images[0], &images[1], &images[2]};
  };
  const bool two = yields(plan_, l);
  record_gauss(recorder, *kernels_, active_list_, brick_groups(active_),
               window_sigma(level, two ? yield.window : level.options.window), all(i.equations),
               all(i.smoothed));
  const vulkan::Image* n = narrow(l);
  if (two) {
    record_gauss(recorder, *kernels_, active_list_, brick_groups(active_),
                 widening_sigma(level, yield.window), all(n), all(i.wide),
                 all(n == i.smoothed ? i.equations : i.smoothed));
  }
  const vulkan::Image* w = windowed(l);

  const auto per_mm2 = [&](double alpha) { return float(std::pow(alpha / level.h_mm, 2)); };
  const auto largest_mm = float(plan_.options.largest_step * level.h_mm);
  if (!two) {
    recorder.dispatch(kernels_->update(),
                      {active_list_,
                       {w[0], nearest},
                       {w[1], nearest},
                       {w[2], nearest},
                       {i.ahead, kernels_->linear()},
                       i.composed},
                      shaders::UpdatePush{wide(level.cells),
                                          glm::vec4(level.cell_mm, 0),
                                          {per_mm2(plan_.options.damping), largest_mm, 0, 0}},
                      groups);
    return;
  }
  const double voxels = window_voxels(level, yield.window) * (colour < 0 ? 1.0 : 0.5);
  recorder.dispatch(
      kernels_->update_two(),
      {active_list_,
       {w[0], nearest},
       {w[1], nearest},
       {w[2], nearest},
       {n[0], nearest},
       {n[1], nearest},
       {n[2], nearest},
       {i.ahead, kernels_->linear()},
       {i.coarser, nearest},
       i.composed,
       {i.ahead, nearest}},
      shaders::UpdateTwoPush{
          wide(level.cells),
          glm::vec4(level.cell_mm, 0),
          {per_mm2(plan_.options.damping), per_mm2(yield.damping), largest_mm, 0},
          {float(yield.low), float(yield.high), float(yield.noise * noise_), float(yield.flat)},
          {float(yield.smoothness / level.options.smoothness), float(yield.evidence), float(voxels),
           0}},
      groups);
}

void PairSolver::record_look(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const uint64_t bytes = active_.size() * sizeof(BrickLook);
  recorder.fill(looks_, 0, bytes);
  recorder.dispatch(kernels_->measure(),
                    {active_list_,
                     {i.field, kernels_->nearest()},
                     {i.seen, kernels_->nearest()},
                     i.seen,
                     {windowed(l)[2], kernels_->nearest()},
                     looks_},
                    shaders::MeasurePush{wide(level.cells), {float(1.0 / level.h_mm), 0, 0, 0}},
                    brick_groups(active_));
  recorder.copy(looks_, read_looks_, bytes);
}

}  // namespace palpate
