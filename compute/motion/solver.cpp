#include "compute/motion/solver.h"

#include <algorithm>
#include <chrono>

#include "compute/motion/gauss.h"

namespace palpate {
namespace {

constexpr int kBatch =
    5;  // iterations per submission: also how often convergence and stop are looked at
constexpr int kMaxRepairs = 200;  // smoothing rounds; a few are enough on any data seen
constexpr int kDispatchesPerIteration = 32;
// Step of the projected dual ascent: 1 / (largest eigenvalue of D D^T), which is 4 per axis with
// unit slopes.
double dual_step(glm::dvec3 slope) {
  return 1.0 / (4.0 * glm::dot(slope, slope));
}

/// Differences per mm, made relative to the coarsest axis of the field: anisotropic cells get
/// isotropic smoothness.
glm::dvec3 slopes(const LevelPlan& level) {
  const double reference = std::max({level.cell_mm.x, level.cell_mm.y, level.cell_mm.z});
  return reference / level.cell_mm;
}

glm::ivec4 wide(glm::ivec3 v, int w = 0) {
  return {v, w};
}

}  // namespace

PairSolver::PairSolver(std::shared_ptr<vulkan::Context> context,
                       std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      plan_(plan),
      counter_(context_, 4 * sizeof(uint32_t), vulkan::Buffer::Kind::kHostVisible),
      download_(context_, plan.field.count() * sizeof(glm::vec4),
                vulkan::Buffer::Kind::kHostVisible) {
  constexpr VkFormat kFloat = VK_FORMAT_R32G32B32A32_SFLOAT;
  constexpr VkFormat kHalf = VK_FORMAT_R16G16B16A16_SFLOAT;
  vulkan::Recorder recorder(context_);
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    LevelImages& images = levels_.emplace_back();
    if (int(l) < plan_.options.finest_level) continue;
    const glm::ivec3 cells = plan_.levels[l].cells;
    for (vulkan::Image* image : {&images.field, &images.ahead, &images.composed, &images.primal}) {
      *image = vulkan::Image(context_, cells, kFloat);
      recorder.prepare(*image);
    }
    for (vulkan::Image* image :
         {&images.seen, &images.flags, &images.equations[0], &images.equations[1],
          &images.equations[2], &images.smoothed[0], &images.smoothed[1], &images.smoothed[2],
          &images.dual[0], &images.dual[1], &images.dual[2]}) {
      *image = vulkan::Image(context_, cells, kHalf);
      recorder.prepare(*image);
    }
  }
  recorder.run();
}

/// The field of the level above (or zero) becomes the start of this one; the filter's memory is
/// cleared.
void PairSolver::begin_level(size_t l) {
  LevelImages& images = levels_[l];
  vulkan::Recorder recorder(context_);
  for (const vulkan::Image& dual : images.dual) recorder.clear(dual);
  recorder.clear(images.seen);
  if (l + 1 == plan_.levels.size()) {
    recorder.clear(images.field);
    recorder.clear(images.ahead);
  } else {
    const LevelPlan& to = plan_.levels[l];
    const LevelPlan& from = plan_.levels[l + 1];
    // Cell centre in fine voxels, in coarse voxels, in coarse cells: all are affine per axis.
    const glm::dvec3 to_cell(to.cell), from_cell(from.cell), ratio(from.ratio);
    const glm::dvec3 scale = to_cell / ratio / from_cell;
    const glm::dvec3 at_zero = (0.5 * to_cell / ratio) / from_cell - 0.5;
    recorder.dispatch(kernels_->upsample(),
                      {{levels_[l + 1].field, kernels_->linear()}, images.field, images.ahead},
                      shaders::UpsamplePush{wide(to.cells), wide(from.cells), glm::vec4(scale, 0),
                                            glm::vec4(at_zero, 0)},
                      {(to.cells.x + 63) / 64, to.cells.y, to.cells.z});
  }
  recorder.run();
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

void PairSolver::record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                                  const FramePyramid& moving, const Active& active) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active.bricks);
  const int slices = level.image_size.z;
  constexpr int kFar = 1 << 20;
  recorder.dispatch(kernels_->normal_equations(level.cell),
                    {active.list,
                     {fixed.level(l), nearest},
                     {moving.level(l), kernels_->linear()},
                     {i.ahead, nearest},
                     i.equations[0],
                     i.equations[1],
                     i.equations[2],
                     {i.equations[0], nearest},
                     {i.equations[1], nearest},
                     {i.equations[2], nearest}},
                    shaders::NormalEquationsPush{wide(level.cells),
                                                 wide(level.image_size),
                                                 wide(level.image_size),
                                                 {slices, -kFar, kFar, 0},
                                                 {slices, 0, slices, 0},
                                                 glm::vec4(level.spacing_mm, 0)},
                    groups);

  const glm::dvec3 sigma = level.options.window * level.h_mm / level.cell_mm;
  const bool swapped = record_gauss(recorder, *kernels_, active.list, brick_groups(active.bricks),
                                    sigma, {&i.equations[0], &i.equations[1], &i.equations[2]},
                                    {&i.smoothed[0], &i.smoothed[1], &i.smoothed[2]});
  const vulkan::Image* smoothed = swapped ? i.smoothed : i.equations;

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

void PairSolver::iterate(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                         const Active& active, const std::stop_token& stop, LevelReport& report,
                         const std::function<void(int)>& done) {
  const LevelPlan& level = plan_.levels[l];
  const int wanted = level.options.iterations;
  const int batch = std::min(kBatch, wanted);
  if (batch == 0 || active.bricks.empty()) return;
  LevelImages& images = levels_[l];

  vulkan::Recorder some(context_, uint32_t(batch * kDispatchesPerIteration + 2));
  for (int k = 0; k < batch; ++k) record_iteration(some, l, fixed, moving, active);
  some.fill(counter_, 0);
  some.dispatch(kernels_->measure(),
                {active.list,
                 {images.field, kernels_->nearest()},
                 {images.seen, kernels_->nearest()},
                 images.seen,
                 counter_},
                shaders::MeasurePush{wide(level.cells), {float(1.0 / level.h_mm), 0, 0, 0}},
                brick_groups(active.bricks));
  const double cells = double(level.cells.x) * level.cells.y * level.cells.z *
                       double(active.bricks.size()) / double(all_bricks(level.cells).size());
  while (report.iterations < wanted && !stop.stop_requested()) {
    some.run();
    report.iterations += batch;
    done(report.iterations);
    const double moved = double(counter_.as<uint32_t>()[0]) / 4096.0 / cells / batch;
    // The first look compares with nothing, so it can not end a level.
    if (report.iterations > batch && moved < plan_.options.converged) {
      report.converged = true;
      break;
    }
  }
}

void PairSolver::repair(size_t l, SolveReport& report) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& images = levels_[l];
  Active all{all_bricks(level.cells), {}};
  all.list = upload_bricks(context_, all.bricks);
  const glm::ivec3 groups = slice_groups(all.bricks);
  for (int round = 0; round < kMaxRepairs; ++round) {
    vulkan::Recorder look(context_);
    look.fill(counter_, 0);
    look.dispatch(kernels_->folds(),
                  {all.list, {images.field, kernels_->linear()}, images.flags, counter_},
                  shaders::FoldsPush{wide(level.cells), wide(level.cell), wide(level.image_size),
                                     glm::vec4(level.spacing_mm, plan_.options.min_determinant)},
                  groups);
    look.run();
    report.folded_cells = counter_.as<uint32_t>()[0];
    if (report.folded_cells == 0) return;
    ++report.repaired;
    vulkan::Recorder mend(context_);
    mend.dispatch(kernels_->blend(),
                  {all.list,
                   {images.flags, kernels_->nearest()},
                   {images.field, kernels_->nearest()},
                   images.primal},
                  shaders::BlendPush{wide(level.cells)}, groups);
    mend.run();
    std::swap(images.field, images.primal);
  }
}

std::optional<SolveReport> PairSolver::solve(const FramePyramid& fixed, const FramePyramid& moving,
                                             const std::stop_token& stop,
                                             const SolveProgress& progress) {
  SolveReport report;
  // Work is counted in image voxels visited.
  const auto voxels = [&](size_t l) { return glm::dvec3(plan_.levels[l].image_size); };
  const auto work = [&](size_t l) { return voxels(l).x * voxels(l).y * voxels(l).z; };
  double all_work = 0.0, done_work = 0.0;
  const auto finest = size_t(plan_.options.finest_level);
  for (size_t l = finest; l < plan_.levels.size(); ++l)
    all_work += work(l) * plan_.levels[l].options.iterations;

  for (size_t l = plan_.levels.size(); l-- > finest;) {
    if (stop.stop_requested()) return std::nullopt;
    const auto start = std::chrono::steady_clock::now();
    LevelReport& level = report.levels.emplace_back();
    level.h_mm = plan_.levels[l].h_mm;
    begin_level(l);
    Active active{all_bricks(plan_.levels[l].cells), {}};
    level.all_bricks = active.bricks.size();
    level.bricks = active.bricks.size();
    active.list = upload_bricks(context_, active.bricks);
    iterate(l, fixed, moving, active, stop, level, [&](int iterations) {
      if (progress) progress(std::min(1.0, (done_work + work(l) * iterations) / all_work));
    });
    done_work += work(l) * plan_.levels[l].options.iterations;
    level.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  if (stop.stop_requested()) return std::nullopt;
  repair(finest, report);
  if (progress) progress(1.0);
  return report;
}

Field PairSolver::download() {
  vulkan::Recorder recorder(context_);
  recorder.copy(levels_[size_t(plan_.options.finest_level)].field, download_);
  recorder.run();
  Field field;
  field.grid = plan_.field;
  field.u_mm.resize(field.grid.count());
  const glm::mat3 lps_from_axes(plan_.image.direction);
  const std::span<glm::vec4> axes = download_.as<glm::vec4>();
  for (size_t i = 0; i < field.u_mm.size(); ++i) field.u_mm[i] = lps_from_axes * glm::vec3(axes[i]);
  return field;
}

}  // namespace palpate
