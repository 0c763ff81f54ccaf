#include <algorithm>

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

/// SD of the window over the normal equations, in cells.
glm::dvec3 window_sigma(const LevelPlan& level) {
  return level.options.window * level.h_mm / level.cell_mm;
}

glm::ivec4 wide(glm::ivec3 v, int w = 0) {
  return {v, w};
}

}  // namespace

/// Where the smoothed equations are: each axis that needs smoothing swaps the two sets of images.
const vulkan::Image* PairSolver::windowed(size_t l) const {
  const LevelPlan& level = plan_.levels[l];
  return gauss_swaps(level.cells, window_sigma(level)) ? levels_[l].smoothed : levels_[l].equations;
}

void PairSolver::record_filter(vulkan::Recorder& recorder, size_t l, const Active& active) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active.bricks);
  const glm::dvec3 slope = slopes(level);
  const shaders::TotalVariationPush push{
      wide(level.cells),
      glm::vec4(slope, 0),
      {float(level.options.smoothness * level.h_mm), float(dual_step(slope)),
       float(plan_.options.huber_mm), float(plan_.options.momentum)}};
  const auto primal = [&](bool last) {
    recorder.dispatch(kernels_->tv_primal(last),
                      {active.list,
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
                      {active.list,
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
                                  const FramePyramid& moving, const Active& active, int colour) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  constexpr int kFar = 1 << 20;
  const auto dispatch = [&](const vulkan::Image& f, const vulkan::Image& m,
                            const shaders::NormalEquationsPush& push) {
    recorder.dispatch(kernels_->normal_equations(level.cell),
                      {active.list,
                       {f, nearest},
                       {m, kernels_->linear()},
                       {i.ahead, nearest},
                       i.equations[0],
                       i.equations[1],
                       i.equations[2],
                       {i.equations[0], nearest},
                       {i.equations[1], nearest},
                       {i.equations[2], nearest}},
                      push, slice_groups(active.bricks));
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
                                  const FramePyramid& moving, const Active& active, int colour) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active.bricks);
  record_equations(recorder, l, fixed, moving, active, colour);

  const glm::dvec3 sigma = level.options.window * level.h_mm / level.cell_mm;
  record_gauss(recorder, *kernels_, active.list, brick_groups(active.bricks), sigma,
               {&i.equations[0], &i.equations[1], &i.equations[2]},
               {&i.smoothed[0], &i.smoothed[1], &i.smoothed[2]});
  const vulkan::Image* smoothed = windowed(l);

  const double damping = plan_.options.damping / level.h_mm;
  recorder.dispatch(kernels_->update(),
                    {active.list,
                     {smoothed[0], nearest},
                     {smoothed[1], nearest},
                     {smoothed[2], nearest},
                     {i.ahead, kernels_->linear()},
                     i.composed},
                    shaders::UpdatePush{wide(level.cells),
                                        glm::vec4(level.cell_mm, 0),
                                        {float(damping * damping),
                                         float(plan_.options.largest_step * level.h_mm), 0, 0}},
                    groups);
  record_filter(recorder, l, active);
}

void PairSolver::record_look(vulkan::Recorder& recorder, size_t l, const Active& active) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  recorder.fill(active.looks, 0);
  recorder.dispatch(kernels_->measure(),
                    {active.list,
                     {i.field, kernels_->nearest()},
                     {i.seen, kernels_->nearest()},
                     i.seen,
                     {windowed(l)[2], kernels_->nearest()},
                     active.looks},
                    shaders::MeasurePush{wide(level.cells), {float(1.0 / level.h_mm), 0, 0, 0}},
                    brick_groups(active.bricks));
}

}  // namespace palpate
