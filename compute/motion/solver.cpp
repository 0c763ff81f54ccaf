#include "compute/motion/solver.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/gtc/packing.hpp>

#include "compute/motion/activity.h"
#include "compute/motion/gauss.h"
#include "compute/motion/noise.h"
#include "compute/motion/repair.h"
#include "compute/volume/parallel.h"

namespace palpate {
namespace {

// iterations per submission; between submissions convergence and stop are checked
constexpr int kBatch = 5;
// steps of the field until it is measured again: a batch, and the choice of the window before it
constexpr int kStepsAhead = 2 * kBatch;
constexpr double kAnyReach = std::numeric_limits<double>::infinity();
constexpr double kAllIsNoise = 2.0;     // r^2 of normalised frames that share nothing
constexpr double kLeastCounted = 0.1;   // cells with a smaller share of counting voxels are ignored
constexpr float kMostlyCounted = 0.9F;  // the same, where noise is told of single cells
constexpr double kStable = 0.95;        // dual steps, of the longest ones that are stable
// SD of the window over the differences of two fields, to choose between them, in cells
constexpr double kChoiceSigma = 1.0;
constexpr float kChoiceWidth = 0.02F;  // rho: width of the transition between the two fields
// SD of the window over what the coarser level leaves, against noise, in cells
constexpr double kCoarserSigma = 1.0;
// Fits without a part of the cells: iterations and steps of the filter in each, and the SD of the
// window over what they gain, in cells. More of each changes nothing
// (docs/decisions/motion/second-order.md).
constexpr int kRefits = 2, kRefitFilterSteps = 1;
constexpr double kLeftOutSigma = 4.0;
constexpr int kDispatchesPerIteration = 24;  // without the filter's steps, up to four each

// cells whose values come to the host in less time than waiting for the device once more takes
constexpr size_t kFewCells = 64 * 64 * 64;
// cells from which noise is told: more would not change its first two digits
constexpr size_t kNoiseCells = 1 << 16;

double passed_s(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

/// Some cells of an image, evenly taken, of which noise is told.
template <typename Cell, typename Make>
std::vector<Cell> noise_cells(std::span<const uint64_t> texels, const Make& make) {
  // An odd stride, so that it is no multiple of an even row length.
  const size_t every = texels.size() / kNoiseCells | 1U;
  std::vector<Cell> cells;
  cells.reserve(texels.size() / every + 1);
  for (size_t c = 0; c < texels.size(); c += every)
    if (const std::optional<Cell> cell = make(glm::unpackHalf4x16(texels[c])))
      cells.push_back(*cell);
  return cells;
}

/// What noise leaves on a level, see noise_left(). Empty if there are too few cells.
std::optional<double> noise_of(std::span<const uint64_t> left) {
  return noise_left(noise_cells<CellLeft>(left, [](glm::vec4 e) -> std::optional<CellLeft> {
    if (e.z <= 0.5F) return std::nullopt;
    return CellLeft{e.w / e.z, e.y / e.z};
  }));
}

/// See cells_share_noise(); texels of shared_noise.comp.
bool share_noise(std::span<const uint64_t> noise) {
  return cells_share_noise(
      noise_cells<CellNoise>(noise, [](glm::vec4 e) -> std::optional<CellNoise> {
        if (e.w < kMostlyCounted) return std::nullopt;
        return CellNoise{e.y, e.x, e.z};
      }));
}

// Step of the projected dual ascent: 1 / (largest eigenvalue of D D^T), which is 4 per axis with
// unit slopes.
double dual_step(glm::dvec3 slope) {
  return 1.0 / (4.0 * glm::dot(slope, slope));
}

/// The same for second differences, see tv_second_dual.comp: 16 (sum of the squares)^2.
double second_dual_step(glm::dvec3 slope) {
  return 1.0 / (16.0 * std::pow(glm::dot(slope, slope), 2));
}

/// Factors on differences per axis, relative to the coarsest axis of the field: anisotropic cells
/// get isotropic smoothness. An axis of one cell has no differences and does not count.
glm::dvec3 slopes(const LevelPlan& level) {
  const glm::dvec3 has_neighbours(glm::greaterThan(level.cells, glm::ivec3(1)));
  const glm::dvec3 edges = level.cell_mm * has_neighbours;
  const double reference = std::max({edges.x, edges.y, edges.z});
  if (reference == 0.0) return glm::dvec3(1.0);
  return reference / level.cell_mm * has_neighbours;
}

/// Dispatches of the data term, at most.
int dispatches_of_equations(const MotionPlan& plan) {
  return plan.slabs > 1 ? plan.slabs * plan.slabs + SlabImages::most_dispatches(plan) : 1;
}

/// SD in cells of a window over the normal equations, SD in h.
glm::dvec3 window_sigma(const LevelPlan& level, double window) {
  return window * level.h_mm / level.cell_mm;
}

/// SD in cells of the Gaussian that widens the narrow window of a level that yields to the wide
/// one.
glm::dvec3 widening_sigma(const LevelPlan& level, double narrow) {
  const double wide = level.options.window;
  return window_sigma(level, std::sqrt(wide * wide - narrow * narrow));
}

}  // namespace

double cycle_step(int k, int n) {
  const double c = std::cos(std::numbers::pi * (2 * (n - 1 - k) + 1) / (4 * n + 2));
  return 1.0 / (2.0 * c * c);
}

double window_voxels(const LevelPlan& level, double window) {
  double voxels = 1.0;
  for (int a = 0; a < 3; ++a) {
    if (level.image_size[a] == 1) continue;
    const double cell_sd = level.cell_mm[a] / std::sqrt(12.0);
    const double sd = std::hypot(window * level.h_mm, cell_sd);
    voxels *= std::max(1.0, 2.0 * std::sqrt(std::numbers::pi) * sd / level.spacing_mm[a]);
  }
  return voxels;
}

PairSolver::PairSolver(std::shared_ptr<vulkan::Context> context,
                       std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan,
                       const Region& region)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      plan_(plan),
      download_(context_, plan.field.count() * sizeof(glm::vec4),
                vulkan::Buffer::Kind::kHostVisible),
      recorder_(context_, uint32_t(96 + 4 * dispatches_of_equations(plan))),
      batch_(context_, uint32_t(kBatch * (kDispatchesPerIteration + 4 * plan.options.filter_steps +
                                          dispatches_of_equations(plan)) +
                                2)) {
  for (const SearchPlan& search : plan_searches(plan_))
    starts_.push_back(std::make_unique<DiscreteStart>(context_, kernels_, plan_, search));
  if (has_sliding_step(plan_))
    sliding_ = std::make_unique<SlidingBorders>(context_, kernels_, plan_);
  for (const LevelRegion& level : region.levels) bricks_.push_back(level.bricks);
  size_t most_bricks = 1;
  for (const LevelPlan& level : plan_.levels)
    most_bricks = std::max(most_bricks, all_bricks(level.cells).size());
  // A level activates at most these before the host waits: the coarser level's bricks, those of
  // each search, those put back to rest, its own.
  for (size_t k = 0; k < starts_.size() + 3; ++k) {
    lists_.emplace_back(context_, most_bricks * sizeof(uint32_t),
                        vulkan::Buffer::Kind::kFilledByHost);
  }
  measures_ = vulkan::Buffer(context_, most_bricks * sizeof(BrickMeasure));
  counts_ =
      vulkan::Buffer(context_, most_bricks * sizeof(uint32_t), vulkan::Buffer::Kind::kHostVisible);
  read_measures_ = vulkan::Buffer(context_, most_bricks * sizeof(BrickMeasure),
                                  vulkan::Buffer::Kind::kHostVisible);
  const glm::ivec3 finest = plan_.levels[size_t(plan_.options.finest_level)].cells;
  deviation_ = vulkan::Buffer(
      context_, size_t(finest.x) * size_t(finest.y) * size_t(finest.z) * sizeof(uint64_t),
      vulkan::Buffer::Kind::kHostVisible);
  if (plan_.slabs > 1) slabs_ = std::make_unique<SlabImages>(context_, kernels_, plan_, region);
  constexpr VkFormat kFloat = VK_FORMAT_R32G32B32A32_SFLOAT;
  constexpr VkFormat kHalf = VK_FORMAT_R16G16B16A16_SFLOAT;
  for (size_t l = 0; l < plan_.levels.size(); ++l) {
    LevelImages& images = levels_.emplace_back();
    if (int(l) < plan_.options.finest_level) continue;
    const glm::ivec3 cells = plan_.levels[l].cells;
    for (vulkan::Image* image : {&images.field, &images.ahead, &images.composed, &images.primal}) {
      *image = vulkan::Image(context_, cells, kFloat);
      recorder_.prepare(*image);
    }
    for (vulkan::Image* image :
         {&images.seen, &images.flags, &images.equations[0], &images.equations[1],
          &images.equations[2], &images.smoothed[0], &images.smoothed[1], &images.smoothed[2],
          &images.dual[0], &images.dual[1], &images.dual[2]}) {
      *image = vulkan::Image(context_, cells, kHalf);
      recorder_.prepare(*image);
    }
    if (plan_.levels[l].options.second > 0.0) {
      for (int d = 0; d < 6; ++d)
        recorder_.prepare(images.second.emplace_back(context_, cells, kHalf));
    }
    if (!yields(plan_, l)) continue;
    for (vulkan::Image* image :
         {&images.wide[0], &images.wide[1], &images.wide[2], &images.coarser}) {
      *image = vulkan::Image(context_, cells, kHalf);
      recorder_.prepare(*image);
    }
    if (plan_.options.yield.choose_after <= 0) continue;
    const auto make = [&](vulkan::Image& image, VkFormat format) {
      image = vulkan::Image(context_, cells, format);
      recorder_.prepare(image);
    };
    make(images.start, kFloat);
    make(images.before, kFloat);
    for (vulkan::Image& image : images.whole) make(image, kHalf);
    for (vulkan::Image& image : images.gain) make(image, VK_FORMAT_R32G32_SFLOAT);
  }
  recorder_.run();
}

void PairSolver::activate(BrickList bricks) {
  list_ = (list_ + 1) % lists_.size();
  std::copy(bricks.begin(), bricks.end(), lists_[list_].as<uint32_t>().begin());
  active_ = std::move(bricks);
}

/// Begins to record a level: its field is that of the coarser level, or zero; the dual variables of
/// the filter are cleared.
void PairSolver::begin_level(size_t l) {
  LevelImages& images = levels_[l];
  const bool coarsest = l + 1 == plan_.levels.size();
  recorder_.restart();
  if (yields(plan_, l)) {
    activate(all_bricks(plan_.levels[l + 1].cells));
    record_coarser(recorder_, l);
  }
  record_clear_terms(l);
  if (yields(plan_, l))
    for (const vulkan::Image& wide : images.wide) kernels_->record_clear(recorder_, wide);
  if (coarsest) {
    for (const vulkan::Image* image : {&images.field, &images.ahead, &images.seen})
      kernels_->record_clear(recorder_, *image);
  } else {
    const LevelPlan& from = plan_.levels[l + 1];
    const glm::ivec3 voxels = from.cell * from.ratio;
    const vulkan::Image& field = levels_[l + 1].field;
    record_upsampled(recorder_, l, field, from.cells, voxels, images.field, images.ahead);
    record_upsampled(recorder_, l, field, from.cells, voxels, images.seen, images.primal);
  }
}

void PairSolver::record_clear_terms(size_t l) {
  const LevelImages& images = levels_[l];
  recorder_.begin_concurrent();
  for (const auto& three :
       {std::span(images.dual), std::span(images.equations), std::span(images.smoothed)}) {
    for (const vulkan::Image& image : three) kernels_->record_clear(recorder_, image);
  }
  for (const vulkan::Image& image : images.second) kernels_->record_clear(recorder_, image);
  recorder_.end_concurrent();
}

/// Interpolates a field on coarser cells, `from_cell` voxels of level l wide, to the cells of level
/// l.
void PairSolver::record_upsampled(vulkan::Recorder& recorder, size_t l, const vulkan::Image& from,
                                  glm::ivec3 from_cells, glm::ivec3 from_cell,
                                  const vulkan::Image& to, const vulkan::Image& to_as_well) {
  const LevelPlan& level = plan_.levels[l];
  // Maps a cell's index to an index in the other field; affine per axis.
  const glm::dvec3 scale = glm::dvec3(level.cell) / glm::dvec3(from_cell);
  recorder.dispatch(kernels_->upsample(), {{from, kernels_->linear()}, to, to_as_well},
                    shaders::UpsamplePush{wide(level.cells), wide(from_cells), glm::vec4(scale, 0),
                                          glm::vec4(0.5 * scale - 0.5, 0)},
                    {(level.cells.x + 63) / 64, level.cells.y, level.cells.z});
}

/// Copies what a level leaves to where left_on() reads it.
void PairSolver::record_left(vulkan::Recorder& recorder, size_t l) {
  // The buffer of the download is larger and not yet in use.
  assert(windowed(l)[2].count() * sizeof(uint64_t) <= download_.bytes());
  recorder.copy(windowed(l)[2], download_);
  left_level_ = l;
}

/// What a level leaves at its end; valid until that of another level is asked for.
PairSolver::Left PairSolver::left_on(size_t l) {
  if (left_level_ != l) {
    recorder_.restart();
    record_left(recorder_, l);
    recorder_.run();
  }
  return download_.as<uint64_t>().first(windowed(l)[2].count());
}

/// The cells of a level in which it leaves more unexplained than yield.noise times `noise`.
std::vector<glm::ivec3> PairSolver::unexplained(size_t l, Left left, double noise) const {
  constexpr double kCost = 20.0;  // elementary steps for a cell
  const glm::ivec3 n = plan_.levels[l].cells;
  const YieldOptions& yield = plan_.options.yield;
  const auto is_left = [&](uint64_t texel) {
    const glm::vec4 e = glm::unpackHalf4x16(texel);
    const double beyond = e.y - yield.noise * noise * std::max(0.0F, e.z - e.w);
    return e.z >= kLeastCounted &&
           beyond > plan_.options.search_above * (2.0 * e.w + yield.flat * e.z);
  };
  const size_t slice = size_t(n.x) * size_t(n.y);
  std::vector<std::vector<glm::ivec3>> of_slice(size_t(n.z));
  parallel_ranges(n.z, kCost * double(slice), [&](int begin, int end) {
    for (int z = begin; z < end; ++z) {
      const uint64_t* texel = &left[size_t(z) * slice];
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x, ++texel)
          if (is_left(*texel)) of_slice[size_t(z)].emplace_back(x, y, z);
    }
  });
  std::vector<glm::ivec3> cells;
  for (const std::vector<glm::ivec3>& some : of_slice)
    cells.insert(cells.end(), some.begin(), some.end());
  return cells;
}

/// Indices of the nodes of a search at and beside these cells of its level.
std::vector<uint32_t> PairSolver::nodes_at(const std::vector<glm::ivec3>& cells,
                                           const SearchPlan& search) const {
  const LevelPlan& level = plan_.levels[search.level];
  std::vector<bool> wanted(search.count());
  for (const glm::ivec3 cell : cells) {
    const glm::ivec3 begin = glm::max(cell * level.cell / search.cell - 1, glm::ivec3(0));
    const glm::ivec3 end = glm::min((cell + 1) * level.cell / search.cell + 1, search.nodes);
    for (int z = begin.z; z < end.z; ++z)
      for (int y = begin.y; y < end.y; ++y)
        for (int x = begin.x; x < end.x; ++x)
          wanted[size_t(x) +
                 size_t(search.nodes.x) * (size_t(y) + size_t(search.nodes.y) * size_t(z))] = true;
  }
  std::vector<uint32_t> nodes;
  for (size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i]) nodes.push_back(uint32_t(i));
  return nodes;
}

/// The bricks of level l that the mask leaves and that contain any of these cells of level l + 1.
BrickList PairSolver::bricks_at(const std::vector<glm::ivec3>& cells, size_t l) const {
  const LevelPlan& from = plan_.levels[l + 1];
  const LevelPlan& to = plan_.levels[l];
  const glm::ivec3 voxels = from.cell * from.ratio;
  const glm::ivec3 n = brick_count(to.cells);
  const auto at = [&](glm::ivec3 brick) {
    return size_t(brick.x) + size_t(n.x) * (size_t(brick.y) + size_t(n.y) * size_t(brick.z));
  };
  std::vector<bool> wanted(at(n - 1) + 1);
  for (const glm::ivec3 cell : cells) {
    const glm::ivec3 end = ((cell + 1) * voxels + to.cell - 1) / to.cell;
    for (const uint32_t brick : bricks_over(cell * voxels / to.cell, glm::min(end, to.cells)))
      wanted[at(unpacked(brick))] = true;
  }
  BrickList result;
  std::copy_if(bricks_[l].begin(), bricks_[l].end(), std::back_inserter(result),
               [&](uint32_t brick) { return wanted[at(unpacked(brick))]; });
  return result;
}

/// Records to take another field, which `record_other` writes to `primal` and `ahead`, in these
/// bricks where the frames then match better than with the present one. gain: what rho must fall by
/// for nothing and for all of it to be taken.
void PairSolver::choose(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                        BrickList bricks, glm::vec2 gain,
                        const std::function<void()>& record_other) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const glm::dvec3 sigma(kChoiceSigma);
  const int passes = gauss_passes(level.cells, sigma);
  // A field of one cell has nothing to choose.
  if (passes == 0 || bricks.empty()) return;
  activate(std::move(bricks));
  const vulkan::Sampler& nearest = kernels_->nearest();
  const auto left = [&](const vulkan::Image& first, const vulkan::Image& second) {
    record_equations(recorder_, l, fixed, moving, -1);
    record_gauss(recorder_, *kernels_, active_list(), brick_groups(active_), sigma,
                 {&i.equations[2]}, {&first}, {&second});
    return passes % 2 == 1 ? &first : &second;
  };
  const vulkan::Image* now = left(i.dual[0], i.dual[1]);
  record_other();
  const vulkan::Image* other = left(i.smoothed[0], i.smoothed[1]);
  recorder_.dispatch(
      kernels_->choose(),
      {active_list(),
       {*now, nearest},
       {*other, nearest},
       {i.field, nearest},
       {i.primal, nearest},
       i.field,
       i.ahead},
      shaders::ChoosePush{wide(level.cells), {gain, float(plan_.options.yield.flat), 0}},
      slice_groups(active_));
  // Outside these bricks nothing was chosen and `ahead` and `primal` contain the other field, which
  // their neighbours read: restore this level's field.
  if (active_.size() < all_bricks(level.cells).size())
    record_copy(recorder_, l, i.field, i.ahead, i.primal);
  record_clear_terms(l);
}

/// Searches for larger motion at these cells of level l + 1, and records to take it where the
/// frames then match better on level l than with the field interpolated from there.
double PairSolver::search(size_t l, DiscreteStart& start, const std::vector<glm::ivec3>& cells,
                          const FramePyramid& fixed, const FramePyramid& moving) {
  const SearchPlan& search = start.search();
  const std::vector<uint32_t> nodes = nodes_at(cells, search);
  const int labels = start.solve(fixed, moving, levels_[l + 1].field, nodes, costs_);
  if (labels == 0) return 0.0;
  choose(l, fixed, moving, bricks_[l], {-kChoiceWidth, kChoiceWidth}, [&] {
    record_upsampled(recorder_, l, start.field(), search.nodes,
                     search.cell * plan_.levels[search.level].ratio, levels_[l].primal,
                     levels_[l].ahead);
  });
  return double(nodes.size()) * labels;
}

/// Records to put back to rest what level l + 1 dragged along: where it left something unexplained,
/// and the frames match better without any motion than with the field.
void PairSolver::rest(size_t l, const std::vector<glm::ivec3>& cells, const FramePyramid& fixed,
                      const FramePyramid& moving) {
  choose(l, fixed, moving, bricks_at(cells, l), {0.0F, 2.0F * kChoiceWidth}, [&] {
    kernels_->record_clear(recorder_, levels_[l].primal);
    kernels_->record_clear(recorder_, levels_[l].ahead);
  });
}

/// Runs iterations of the level. The first one covers all bricks that the mask leaves and is
/// measured alone: it finds the bricks that do not move or show nothing. After that every batch
/// drops the bricks that have come to rest; the level ends when none is left.
bool PairSolver::iterate(size_t l, int until, const FramePyramid& fixed, const FramePyramid& moving,
                         const std::stop_token& stop, LevelReport& report,
                         const std::function<void(int)>& done) {
  const LevelPlan& level = plan_.levels[l];
  const int wanted = std::min(level.options.iterations, until);
  const bool prunes = plan_.options.converged > 0.0;
  const bool bounded = std::isfinite(moving.reach_mm());
  const bool in_slabs = l == 0 && slabs_;
  const auto all = double(all_bricks(level.cells).size());
  activate(bricks_[l]);
  double largest = 0.0;       // |u| so far, in h
  int batch_size = 0;         // iterations recorded for the active bricks
  bool batch_brings = false;  // what the level leaves, with them
  const bool brings = int(l) > plan_.options.finest_level;
  const bool brings_always = brings && windowed(l)[2].count() <= kFewCells;
  while (report.iterations < wanted && !stop.stop_requested() && !active_.empty()) {
    const int size =
        std::min(prunes && report.iterations == 0 ? 1 : kBatch, wanted - report.iterations);
    // The commands of a batch are recorded once and run again while the same bricks are active. The
    // last one also brings what the level leaves; where that is little, all do.
    const bool brings_now = brings_always || (brings && report.iterations + size == wanted);
    if (size != batch_size || brings_now != batch_brings) {
      batch_.restart();
      for (int k = 0; k < size; ++k) {
        // Odd and even voxels alternate, except in the first iteration, which decides what rests.
        const int colour = plan_.options.checkerboard && report.iterations > 0 ? k % 2 : -1;
        record_iteration(batch_, l, fixed, moving, colour);
      }
      if (prunes || bounded || in_slabs) record_measure(batch_, l);
      if (brings_now) record_left(batch_, l);
      batch_size = size;
      batch_brings = brings_now;
    }
    batch_.run();
    report.iterations += size;
    report.brick_iterations += size * double(active_.size());
    report.all_brick_iterations = report.iterations * all;
    done(report.iterations);

    // Whether the batch went too far, and which bricks have come to rest.
    const std::span<BrickMeasure> measures =
        read_measures_.as<BrickMeasure>().first(active_.size());
    if (bounded && std::any_of(measures.begin(), measures.end(), [&](const BrickMeasure& measure) {
          return double(measure.reach) * level.h_mm > moving.reach_mm();
        })) {
      return false;
    }
    // Which pairs of slabs the next batch needs; bricks at rest keep the field that they had.
    if (in_slabs) {
      for (const BrickMeasure& measure : measures)
        largest = std::max(largest, double(measure.reach));
      const double most = largest + kStepsAhead * plan_.options.largest_step;
      const double slices = std::ceil(most * level.h_mm / level.spacing_mm.z) + 1.0;
      if (slices != reach_) batch_size = 0;
      reach_ = slices;
    }
    if (!prunes || report.iterations == wanted) continue;
    const RestRule rule{plan_.options.converged * size,
                        plan_.options.normalise ? plan_.options.structure : 0.0};
    BrickList left = active_bricks(active_, measures, level.cells, rule);
    if (left.size() == active_.size()) continue;
    activate(std::move(left));
    batch_size = 0;
  }
  report.converged = active_.empty();
  report.all_brick_iterations = wanted * all;
  return true;
}

/// Records to copy a field of the level.
void PairSolver::record_copy(vulkan::Recorder& recorder, size_t l, const vulkan::Image& from,
                             const vulkan::Image& to, const vulkan::Image& to_as_well) {
  const LevelPlan& level = plan_.levels[l];
  recorder.dispatch(kernels_->upsample(), {{from, kernels_->nearest()}, to, to_as_well},
                    shaders::UpsamplePush{wide(level.cells), wide(level.cells),
                                          glm::vec4(1, 1, 1, 0), glm::vec4(0)},
                    {(level.cells.x + 63) / 64, level.cells.y, level.cells.z});
}

/// A fit that goes on from the field at which the choice began, with these equations and without
/// the images.
void PairSolver::record_refit(vulkan::Recorder& recorder, size_t l,
                              const vulkan::Image* equations) {
  const LevelPlan& level = plan_.levels[l];
  const LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const shaders::UpdatePush push{wide(level.cells),
                                 glm::vec4(level.cell_mm, 0),
                                 {std::pow(plan_.options.damping / level.h_mm, 2),
                                  plan_.options.largest_step * level.h_mm, 0, 0}};
  record_copy(recorder, l, i.start, i.field, i.ahead);
  for (int k = 0; k < kRefits; ++k) {
    recorder.dispatch(kernels_->refit(),
                      {active_list(),
                       {equations[0], nearest},
                       {equations[1], nearest},
                       {equations[2], nearest},
                       {i.ahead, nearest},
                       {i.start, nearest},
                       i.composed},
                      push, slice_groups(active_));
    record_filter(recorder, l, kRefitFilterSteps);
  }
}

/// An iteration that chooses, cell by cell, whether the narrow window is added to the wide one from
/// now on, by what each predicts of cells that it did not see. The iteration's equations are those
/// of all voxels. From their field the fit goes on without the images and without a part of the
/// cells, with each window, for two parts in turns. The errors at the cells left out decide,
/// smoothed over several of them. Where neighbouring cells share their noise, nothing is chosen.
void PairSolver::iterate_and_choose(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                                    LevelReport& report) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  activate(bricks_[l]);
  const glm::ivec3 groups = slice_groups(active_);

  // The equations, and what they say of the noise.
  batch_.restart();
  for (const vulkan::Image& image : i.whole) kernels_->record_clear(batch_, image);
  kernels_->record_clear(batch_, i.smoothed[0]);
  record_copy(batch_, l, i.ahead, i.start, i.start);
  record_copy(batch_, l, i.field, i.before, i.before);
  record_equations(batch_, l, fixed, moving, -1);
  record_left_out(l, i.equations, i.whole, -1);
  batch_.dispatch(kernels_->shared_noise(),
                  {active_list(),
                   {i.whole[0], nearest},
                   {i.whole[1], nearest},
                   {i.whole[2], nearest},
                   i.smoothed[0]},
                  shaders::SharedNoisePush{
                      wide(level.cells),
                      {float(level.cell.x) * float(level.cell.y) * float(level.cell.z), 0, 0, 0}},
                  groups);
  // The buffer of the download is larger and not in use.
  batch_.copy(i.smoothed[0], download_);
  left_level_.reset();
  batch_.run();

  batch_.restart();
  if (!share_noise(download_.as<uint64_t>().first(i.smoothed[0].count()))) {
    record_choice(l);
    window_chosen_ = true;
  }

  // The iteration goes on from these equations.
  record_copy(batch_, l, i.start, i.ahead, i.composed);
  record_copy(batch_, l, i.before, i.field, i.primal);
  record_left_out(l, i.whole, i.equations, -1);
  record_windows(batch_, l);
  record_step(batch_, l, -1);
  record_filter(batch_, l, plan_.options.filter_steps);
  batch_.run();
  ++report.iterations;
  report.brick_iterations += double(active_.size());
}

/// Copies equations without a part of the cells; -1: all of them.
void PairSolver::record_left_out(size_t l, const vulkan::Image* from, const vulkan::Image* to,
                                 int part) {
  const vulkan::Sampler& nearest = kernels_->nearest();
  batch_.dispatch(kernels_->leave_out(),
                  {active_list(),
                   {from[0], nearest},
                   {from[1], nearest},
                   {from[2], nearest},
                   to[0],
                   to[1],
                   to[2]},
                  shaders::LeaveOutPush{wide(plan_.levels[l].cells, part)}, slice_groups(active_));
}

/// Records the choice of the window, from the equations of all voxels at the field `start`.
void PairSolver::record_choice(size_t l) {
  const LevelPlan& level = plan_.levels[l];
  const YieldOptions& yield = plan_.options.yield;
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active_);

  // Fits without a part. The wide window is last, since its duals are those to go on with.
  for (const vulkan::Image& image : i.gain) kernels_->record_clear(batch_, image);
  const vulkan::Image *gain = &i.gain[0], *gain_to = &i.gain[1];
  for (int part = 0; part < 2; ++part) {
    record_left_out(l, i.whole, i.equations, part);
    record_windows(batch_, l);
    for (const bool is_narrow : {true, false}) {
      record_refit(batch_, l, is_narrow ? narrow(l) : windowed(l));
      batch_.dispatch(
          kernels_->left_out_error(),
          {active_list(),
           {i.whole[0], nearest},
           {i.whole[1], nearest},
           {i.whole[2], nearest},
           {i.field, nearest},
           {i.start, nearest},
           {*gain, nearest},
           *gain_to},
          shaders::LeftOutErrorPush{wide(level.cells, part), {is_narrow ? 1.0F : -1.0F, 0, 0, 0}},
          groups);
      std::swap(gain, gain_to);
    }
  }

  // The choice.
  if (record_gauss(batch_, *kernels_, active_list(), brick_groups(active_),
                   glm::dvec3(kLeftOutSigma), {gain}, {gain_to}))
    std::swap(gain, gain_to);
  batch_.dispatch(kernels_->window_share(),
                  {active_list(), {*gain, nearest}, {i.coarser, nearest}, i.coarser},
                  shaders::WindowSharePush{wide(level.cells),
                                           {float(yield.gain_low), float(yield.gain_high), 0, 0}},
                  groups);
}

void PairSolver::repair(size_t l, SolveReport& report) {
  LevelImages& images = levels_[l];
  repair_folds(recorder_, *kernels_, plan_.levels[l], plan_.options.min_determinant, 0,
               {images.field, images.primal, images.flags, active_list(), counts_},
               all_bricks(plan_.levels[l].cells), report);
}

/// Records to compute deviation and confidence: the field with its confidence goes into `primal`,
/// the deviation into the first dual image, which is not used any more.
void PairSolver::judge(size_t l) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  activate(all_bricks(level.cells));
  const double window = yields(plan_, l) ? plan_.options.yield.window : level.options.window;
  const double voxels = window_voxels(level, window);
  const glm::dvec3 noise =
      double(shaders::kNoiseOfGradient) / (level.spacing_mm * level.spacing_mm);
  recorder_.restart();
  const vulkan::Image* equations = narrow(l);
  const vulkan::Sampler& nearest = kernels_->nearest();
  recorder_.dispatch(
      kernels_->confidence(),
      {active_list(),
       {equations[0], nearest},
       {equations[1], nearest},
       {equations[2], nearest},
       {i.field, nearest},
       i.primal,
       i.dual[0]},
      shaders::ConfidencePush{wide(level.cells), glm::vec4(level.cell_mm, 1.0 / level.h_mm),
                              glm::vec4(noise, 1.0 / (voxels * level.h_mm * level.h_mm))},
      slice_groups(active_));
  recorder_.copy(i.dual[0], deviation_);
}

/// Records the beginning of a level, with the field of the coarser one. What that one does not
/// explain is searched for, and what it dragged along is put back to rest.
void PairSolver::take_over(size_t l, const FramePyramid& fixed, const FramePyramid& moving,
                           LevelReport& report) {
  const auto begin = std::chrono::steady_clock::now();
  const bool coarsest = l + 1 == plan_.levels.size();
  const Left left = coarsest ? Left() : left_on(l + 1);
  const std::optional<double> noise = noise_of(left);
  if (yields(plan_, l)) noise_ = noise.value_or(kAllIsNoise);
  begin_level(l);
  reach_ = kAnyReach;  // until the field is measured
  if (coarsest) return;
  // If the noise can not be measured it is taken as 0: an unnecessary search only costs time.
  const std::vector<glm::ivec3> cells = unexplained(l + 1, left, noise.value_or(0.0));
  for (const std::unique_ptr<DiscreteStart>& start : starts_) {
    if (l + 1 != start->search().level) continue;
    report.searched = search(l, *start, cells, fixed, moving);
    report.search_seconds = passed_s(begin);
  }
  rest(l, cells, fixed, moving);
}

std::optional<SolveReport> PairSolver::solve(const FramePyramid& fixed, const FramePyramid& moving,
                                             const std::stop_token& stop,
                                             const SolveProgress& progress) {
  // What was started reads the frames, and the caller may delete them after a stop or an error.
  struct Drain {
    vulkan::Recorder& recorder;
    ~Drain() { recorder.drain(); }
  } const drain_at_the_end{recorder_};
  const auto begin = std::chrono::steady_clock::now();
  SolveReport report;
  left_level_.reset();
  window_chosen_ = false;
  const auto finest = size_t(plan_.options.finest_level);
  const size_t levels = plan_.levels.size();
  // Work is counted in image voxels visited.
  const auto work = [&](size_t l) {
    const glm::dvec3 n(plan_.levels[l].image_size);
    return n.x * n.y * n.z * std::max(1, plan_.levels[l].options.iterations);
  };
  double all_work = 0.0, done_work = 0.0;
  for (size_t l = finest; l < levels; ++l) all_work += work(l);

  for (size_t l = levels; l-- > finest;) {
    if (stop.stop_requested()) return std::nullopt;
    const auto level_begin = std::chrono::steady_clock::now();
    LevelReport& level = report.levels.emplace_back();
    level.h_mm = plan_.levels[l].h_mm;
    take_over(l, fixed, moving, level);
    recorder_.start();
    // The iterations; they end where the motion leaves the part of the images that is there.
    const int iterations = plan_.levels[l].options.iterations;
    const auto go_on = [&](int until) {
      return iterate(l, until, fixed, moving, stop, level, [&](int done) {
        const double share = double(done) / std::max(1, iterations);
        if (progress) progress((done_work + work(l) * share) / all_work);
      });
    };
    const int before = plan_.options.yield.choose_after;
    // An iteration after the choice finds out whether the motion left the part that is there.
    const bool chooses = yields(plan_, l) && before > 0 && before + 1 < iterations;
    bool in_reach = true;
    if (chooses) {
      in_reach = go_on(before);
      if (in_reach && !stop.stop_requested()) iterate_and_choose(l, fixed, moving, level);
    }
    in_reach = in_reach && go_on(iterations);
    if (!in_reach) {
      report.out_of_reach = true;
      report.seconds = passed_s(begin);
      return report;
    }
    done_work += work(l);
    level.seconds = passed_s(level_begin);
  }
  if (stop.stop_requested()) return std::nullopt;

  // On the finest level: folds, confidence, and borders along which tissue slides.
  repair(finest, report);
  judge(finest);
  const vulkan::Image* result = &levels_[finest].primal;
  if (sliding_) {
    recorder_.run();
    if (!sliding_->solve(fixed, moving, *result, stop, report)) return std::nullopt;
    result = &sliding_->field();
    recorder_.restart();
  }
  recorder_.copy(*result, download_);
  recorder_.run();
  report.seconds = passed_s(begin);
  if (progress) progress(1.0);
  return report;
}

void PairSolver::download(Field& field, Confidence& confidence) {
  unpack_field(download_.as<glm::vec4>(), plan_, field, confidence);
  const auto finest = size_t(plan_.options.finest_level);
  Deviation& deviation = confidence.deviation;
  deviation.grid = coarsened(level_grid(plan_, finest), plan_.levels[finest].cell);
  const std::span<const uint64_t> texels = deviation_.as<uint64_t>().first(deviation.grid.count());
  deviation.mm.resize(texels.size());
  std::transform(texels.begin(), texels.end(), deviation.mm.begin(),
                 [](uint64_t texel) { return glm::vec2(glm::unpackHalf4x16(texel)); });
}

void unpack_field(std::span<const glm::vec4> device, const MotionPlan& plan, Field& field,
                  Confidence& confidence) {
  field.grid = plan.field;
  confidence.grid = plan.field;
  field.u_mm.resize(field.grid.count());
  confidence.values.resize(field.grid.count());
  const glm::mat3 lps_from_axes(plan.image.direction);
  const size_t slice = size_t(plan.field.size.x) * size_t(plan.field.size.y);
  parallel_ranges(plan.field.size.z, 20.0 * double(slice), [&](int begin, int end) {
    for (size_t i = size_t(begin) * slice; i < size_t(end) * slice; ++i) {
      field.u_mm[i] = lps_from_axes * glm::vec3(device[i]);
      confidence.values[i] = device[i].w;
    }
  });
}

/// The images that contain the equations under the first window: each smoothed axis swaps the two
/// sets.
const vulkan::Image* PairSolver::narrow(size_t l) const {
  const LevelPlan& level = plan_.levels[l];
  const double window = yields(plan_, l) ? plan_.options.yield.window : level.options.window;
  return gauss_swaps(level.cells, window_sigma(level, window)) ? levels_[l].smoothed
                                                               : levels_[l].equations;
}

/// The images that contain the equations under the level's own window, the second on a level that
/// yields.
const vulkan::Image* PairSolver::windowed(size_t l) const {
  if (!yields(plan_, l)) return narrow(l);
  const LevelPlan& level = plan_.levels[l];
  const LevelImages& i = levels_[l];
  const int passes = gauss_passes(level.cells, widening_sigma(level, plan_.options.yield.window));
  if (passes == 0) return narrow(l);
  return passes % 2 == 1 ? i.wide : narrow(l) == i.smoothed ? i.equations : i.smoothed;
}

/// What level l + 1 leaves unexplained, on the cells of level l. The dual variables of that level,
/// which has ended, serve as scratch space.
void PairSolver::record_coarser(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& from = plan_.levels[l + 1];
  const LevelPlan& to = plan_.levels[l];
  LevelImages& i = levels_[l + 1];
  const vulkan::Image& left = windowed(l + 1)[2];
  const glm::dvec3 sigma(kCoarserSigma);
  record_gauss(recorder, *kernels_, active_list(), brick_groups(active_), sigma, {&left},
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

void PairSolver::record_filter(vulkan::Recorder& recorder, size_t l, int steps) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active_);
  const glm::dvec3 slope = slopes(level);
  const bool has_second = !i.second.empty();
  // Both duals take a step from the same field. Steps are stable up to twice those above, so up to
  // one of them if both are taken.
  const double longest = kStable * (has_second ? 1.0 : 2.0);
  const auto push_of = [&](double weight, double step) {
    return shaders::TotalVariationPush{
        wide(level.cells),
        glm::vec4(slope, 0),
        {float(weight * level.h_mm), float(longest * step), float(plan_.options.huber_mm),
         float(plan_.options.momentum)}};
  };
  shaders::TotalVariationPush push, second_push;
  const auto with_second = [&](const vulkan::Image& read) {
    std::vector<vulkan::Binding> bindings{active_list(), {read, nearest}};
    for (const vulkan::Image& q : i.second) bindings.emplace_back(q, nearest);
    return bindings;
  };
  const auto primal = [&](bool last) {
    // In the last step `primal` keeps the field of the step before: bricks at rest are read there.
    const vulkan::Image& without = last ? i.composed : i.primal;
    if (has_second) {
      std::vector<vulkan::Binding> bindings = with_second(i.composed);
      bindings.emplace_back(without);
      recorder.dispatch(kernels_->tv_second_primal(), bindings, second_push, groups);
    }
    recorder.dispatch(kernels_->tv_primal(last),
                      {active_list(),
                       {has_second ? without : i.composed, nearest},
                       {i.dual[0], nearest},
                       {i.dual[1], nearest},
                       {i.dual[2], nearest},
                       {i.field, nearest},
                       last ? i.field : i.primal,
                       i.ahead},
                      push, groups);
  };

  // Steps of primal and dual in turn; the last primal step is the field.
  for (int step = 0; step < steps; ++step) {
    const double factor = cycle_step(step, steps);
    push = push_of(level.options.smoothness, factor * dual_step(slope));
    second_push = push_of(level.options.second, factor * second_dual_step(slope));
    primal(false);
    recorder.begin_concurrent();
    recorder.dispatch(kernels_->tv_dual(),
                      {active_list(),
                       {i.primal, nearest},
                       {i.dual[0], nearest},
                       {i.dual[1], nearest},
                       {i.dual[2], nearest},
                       i.dual[0],
                       i.dual[1],
                       i.dual[2]},
                      push, groups);
    if (has_second) {
      std::vector<vulkan::Binding> bindings = with_second(i.primal);
      bindings.insert(bindings.end(), i.second.begin(), i.second.end());
      recorder.dispatch(kernels_->tv_second_dual(), bindings, second_push, groups);
    }
    recorder.end_concurrent();
  }
  primal(true);
}

/// The data term. With slabs each dispatch adds the voxels whose own slice and whose partner's
/// slice the two slabs compute.
void PairSolver::record_equations(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                                  const FramePyramid& moving, int colour) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  constexpr int kFar = 1 << 20;
  const auto dispatch = [&](const vulkan::Image& f, const vulkan::Image& m,
                            const shaders::NormalEquationsPush& push) {
    recorder.dispatch(kernels_->normal_equations(level.cell),
                      {active_list(),
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

  // Where both images are on the device whole: one dispatch.
  const int nz = level.image_size.z;
  shaders::NormalEquationsPush push{
      wide(level.cells, colour), wide(level.image_size), wide(level.image_size),
      {nz, -kFar, kFar, 0},      {nz, 0, nz, 0},         glm::vec4(level.spacing_mm, 0)};
  if (l > 0 || !slabs_) {
    dispatch(fixed.level(l), moving.level(l), push);
    return;
  }

  // Otherwise the sums over pairs of slabs.
  bool adds = false;
  slabs_->record_pairs(
      recorder, fixed, moving, active_, reach_,
      [&](const vulkan::Image& f, const vulkan::Image& m, const Slab& of_f, const Slab& of_m) {
        push.fixed_size.w = of_f.first;
        push.fixed_slab = {of_f.depth, of_f.begin, of_f.end, 0};
        push.moving_size.w = of_m.first;
        push.moving_slab = {of_m.depth, of_m.begin == 0 ? -kFar : of_m.begin,
                            of_m.end == nz ? kFar : of_m.end, adds};
        dispatch(f, m, push);
        adds = true;
      });
}

void PairSolver::record_iteration(vulkan::Recorder& recorder, size_t l, const FramePyramid& fixed,
                                  const FramePyramid& moving, int colour) {
  record_equations(recorder, l, fixed, moving, colour);
  record_windows(recorder, l);
  record_step(recorder, l, colour);
  record_filter(recorder, l, plan_.options.filter_steps);
}

/// The windows over the equations: narrow() and windowed() are the images that they fill.
void PairSolver::record_windows(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& level = plan_.levels[l];
  const YieldOptions& yield = plan_.options.yield;
  LevelImages& i = levels_[l];
  using Images = std::vector<const vulkan::Image*>;
  const auto all = [](const vulkan::Image* images) {
    return Images{&images[0], &images[1], &images[2]};
  };
  const bool two = yields(plan_, l);
  record_gauss(recorder, *kernels_, active_list(), brick_groups(active_),
               window_sigma(level, two ? yield.window : level.options.window), all(i.equations),
               all(i.smoothed));
  if (!two) return;
  const vulkan::Image* n = narrow(l);
  record_gauss(recorder, *kernels_, active_list(), brick_groups(active_),
               widening_sigma(level, yield.window), all(n), all(i.wide),
               all(n == i.smoothed ? i.equations : i.smoothed));
}

/// The step from the equations under the windows.
void PairSolver::record_step(vulkan::Recorder& recorder, size_t l, int colour) {
  const LevelPlan& level = plan_.levels[l];
  const YieldOptions& yield = plan_.options.yield;
  LevelImages& i = levels_[l];
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 groups = slice_groups(active_);
  const vulkan::Image *n = narrow(l), *w = windowed(l);

  // One window: its equations alone give the step.
  const auto per_mm2 = [&](double alpha) { return float(std::pow(alpha / level.h_mm, 2)); };
  const auto largest_mm = float(plan_.options.largest_step * level.h_mm);
  if (!yields(plan_, l)) {
    recorder.dispatch(kernels_->update(),
                      {active_list(),
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

  // Two windows: the wide one's step, and from there the narrow one's, by the share that the
  // difference which is left asks for.
  const double voxels = window_voxels(level, yield.window) * (colour < 0 ? 1.0 : 0.5);
  recorder.dispatch(
      kernels_->update_two(),
      {active_list(),
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
           window_chosen_ ? 1.0F : 0.0F}},
      groups);
}

void PairSolver::record_measure(vulkan::Recorder& recorder, size_t l) {
  const LevelPlan& level = plan_.levels[l];
  LevelImages& i = levels_[l];
  const uint64_t bytes = active_.size() * sizeof(BrickMeasure);
  recorder.fill(measures_, 0, bytes);
  recorder.dispatch(kernels_->measure(),
                    {active_list(),
                     {i.field, kernels_->nearest()},
                     {i.seen, kernels_->nearest()},
                     i.seen,
                     {windowed(l)[2], kernels_->nearest()},
                     measures_},
                    shaders::MeasurePush{wide(level.cells), {float(1.0 / level.h_mm), 0, 0, 0}},
                    brick_groups(active_));
  recorder.copy(measures_, read_measures_, bytes);
}

}  // namespace palpate
