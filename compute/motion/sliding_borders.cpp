#include "compute/motion/sliding_borders.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "compute/motion/gauss.h"
#include "compute/motion/intensity.h"
#include "compute/motion/repair.h"

namespace palpate {
namespace {

// h: SD of the window over which the gain between the frames is fitted
constexpr double kGainSigma = 12.0;
// h: SD of the Gaussian over the costs, each of which is the mean over one cell
constexpr double kCostSigma = 1.4;
constexpr double kAlone = 0.5;    // cells: below this SD of the Gaussian each cell is judged alone
constexpr double kStep = 4.0;     // h: distance between candidates
constexpr int kRoundsAlong = 40;  // rounds of repair that keep sliding borders
// |slope|^2 of the solved field along an axis, below which the finer field can not fold. Slopes a,
// b, c along the axes with |a|^2 + |b|^2 + |c|^2 < 1 keep the determinant positive. A quarter
// before and after a coarse sample the cubic is at most 1.375 times as steep as the steepest coarse
// difference that it reads. Along each of the other two axes the absolute values of its weights
// sum to at most 1.1875.
constexpr float kCubicSteeper = 1.375F * 1.1875F * 1.1875F;
constexpr float kMayFold = 0.9F / (3.0F * kCubicSteeper * kCubicSteeper);
constexpr int kCandidates = 6 * shaders::kSlidingSteps;

glm::dvec3 cost_sigma(const LevelPlan& level) {
  return kCostSigma * level.h_mm / level.cell_mm;
}

void list(const BrickList& bricks, vulkan::Buffer& buffer) {
  std::copy(bricks.begin(), bricks.end(), buffer.as<uint32_t>().begin());
}

}  // namespace

SlidingBorders::SlidingBorders(std::shared_ptr<vulkan::Context> context,
                               std::shared_ptr<MotionKernels> kernels, const MotionPlan& plan)
    : context_(std::move(context)),
      kernels_(std::move(kernels)),
      options_(plan.options.sliding),
      min_determinant_(plan.options.min_determinant),
      level_(plan.levels[0]),
      fine_(result_level(plan)),
      step_(glm::max(glm::ivec3(glm::round(kStep * fine_.h_mm / fine_.cell_mm)), glm::ivec3(1))),
      different_(options_.apart * fine_.h_mm, options_.slope, 0, 0),
      alone_(glm::all(glm::lessThan(cost_sigma(fine_), glm::dvec3(kAlone)))),
      coarse_bricks_(all_bricks(level_.cells)),
      coarse_list_(upload_bricks(context_, coarse_bricks_)),
      list_(upload_bricks(context_, all_bricks(fine_.cells))),
      near_list_(upload_bricks(context_, all_bricks(fine_.cells))),
      work_(context_, all_bricks(fine_.cells).size() * 2 * sizeof(uint32_t),
            vulkan::Buffer::Kind::kHostVisible),
      recorder_(context_) {
  for (vulkan::Image* image : {&field_, &other_}) {
    *image = vulkan::Image(context_, fine_.cells, VK_FORMAT_R32G32B32A32_SFLOAT);
    recorder_.prepare(*image);
  }
  for (vulkan::Image* image : {&costs_, &smoothed_, &chosen_}) {
    *image = vulkan::Image(context_, fine_.cells, VK_FORMAT_R16G16B16A16_SFLOAT);
    recorder_.prepare(*image);
  }
  for (vulkan::Image& image : means_) {
    image = vulkan::Image(context_, level_.cells, VK_FORMAT_R32G32B32A32_SFLOAT);
    recorder_.prepare(image);
  }
  recorder_.run();
}

/// Local moments of both frames, on the solved cells, from which the gain between them follows.
const vulkan::Image& SlidingBorders::record_means(const FramePyramid& fixed,
                                                  const FramePyramid& moving,
                                                  const vulkan::Image& solved) {
  const vulkan::Sampler& linear = kernels_->linear();
  const vulkan::Sampler& nearest = kernels_->nearest();
  recorder_.dispatch(
      kernels_->sliding_moments(),
      {coarse_list_,
       {fixed.raw(), nearest},
       {moving.raw(), linear},
       {solved, linear},
       {fixed.level(0), nearest},
       means_[0]},
      shaders::SlidingMomentsPush{wide(level_.cells), wide(level_.cell), wide(level_.image_size),
                                  glm::vec4(level_.spacing_mm, 0)},
      slice_groups(coarse_bricks_));
  const glm::dvec3 sigma = kGainSigma * level_.h_mm / level_.cell_mm;
  const bool swapped =
      record_gauss(recorder_, *kernels_, coarse_list_, brick_groups(coarse_bricks_), sigma,
                   {&means_[0]}, {&means_[1]});
  return means_[swapped ? 1 : 0];
}

void SlidingBorders::record_cost(int first, const FramePyramid& fixed, const FramePyramid& moving,
                                 const vulkan::Image& means, const BrickList& near) {
  const vulkan::Sampler& linear = kernels_->linear();
  const vulkan::Sampler& nearest = kernels_->nearest();
  const double floor = fixed.noise();
  const double limit = options_.limit;
  recorder_.dispatch(kernels_->sliding_cost(first < 0, alone_),
                     {near_list_,
                      {fixed.raw(), nearest},
                      {moving.raw(), linear},
                      {field_, nearest},
                      {means, linear},
                      {fixed.level(0), nearest},
                      costs_},
                     shaders::SlidingCostPush{wide(fine_.cells),
                                              wide(fine_.cell),
                                              wide(fine_.image_size),
                                              glm::vec4(fine_.spacing_mm, 1.0 / (limit * limit)),
                                              wide(level_.cells * level_.cell),
                                              wide(step_, first),
                                              {float(floor * floor), 0, 0, 0},
                                              different_},
                     slice_groups(near));
}

/// Sums costs_ over the neighbourhood of each cell of near_list_, unless cells are judged alone;
/// returns the image with the result.
const vulkan::Image& SlidingBorders::record_smooth(const BrickList& bricks) {
  if (alone_) return costs_;
  const bool swapped = record_gauss(recorder_, *kernels_, near_list_, brick_groups(bricks),
                                    cost_sigma(fine_), {&costs_}, {&smoothed_});
  return swapped ? smoothed_ : costs_;
}

/// Interpolates the field onto the finer cells. Returns per brick the candidates (bits) that lie
/// across a border in the solved field, and the bricks in which it is so steep that its
/// interpolation may fold.
SlidingBorders::SteepCandidates SlidingBorders::begin(const vulkan::Image& solved) {
  const vulkan::Sampler& nearest = kernels_->nearest();
  const glm::ivec3 ratio = level_.cell / fine_.cell;
  const glm::dvec3 scale = 1.0 / glm::dvec3(ratio);
  const glm::ivec3 bricks = brick_count(fine_.cells);
  recorder_.restart();
  const vulkan::Kernel& upsample =
      fine_.cell == level_.cell ? kernels_->upsample() : kernels_->upsample_cubic();
  recorder_.dispatch(
      upsample, {{solved, nearest}, field_, other_},
      shaders::UpsamplePush{wide(fine_.cells), wide(level_.cells), glm::vec4(scale, options_.cubic),
                            glm::vec4(0.5 * scale - 0.5, 0)},
      {(fine_.cells.x + 63) / 64, fine_.cells.y, fine_.cells.z});
  recorder_.fill(work_, 0);
  recorder_.dispatch(kernels_->sliding_find(), {coarse_list_, {solved, nearest}, work_},
                     shaders::SlidingFindPush{wide(level_.cells), wide(ratio), wide(bricks),
                                              wide(glm::max(step_ / ratio, glm::ivec3(1))),
                                              glm::vec4(level_.cell_mm, 0), different_},
                     slice_groups(coarse_bricks_));
  recorder_.run();
  SteepCandidates found;
  const BrickList all = all_bricks(fine_.cells);
  const auto work = work_.as<uint32_t>();
  for (size_t i = 0; i < all.size(); ++i) {
    if (work[2 * i]) found.candidates[all[i]] = work[2 * i];
    if (fine_.cell != level_.cell && std::bit_cast<float>(work[2 * i + 1]) > kMayFold)
      found.steep.push_back(all[i]);
  }
  return found;
}

/// Of these bricks, those in which the intensities do not match, with the candidates that may
/// improve it.
SlidingBorders::Candidates SlidingBorders::find_work(const BrickList& bricks,
                                                     const FramePyramid& fixed,
                                                     const vulkan::Image& costs) {
  const double sd = fixed.noise() / kNoiseFloor / options_.limit;
  const double noise = 2.0 * sd * sd;  // cost of a difference that is noise of two frames
  list(bricks, list_);
  recorder_.fill(work_, 0);
  recorder_.dispatch(
      kernels_->sliding_work(),
      {list_, {costs, kernels_->nearest()}, {field_, kernels_->nearest()}, chosen_, work_},
      shaders::SlidingWorkPush{
          wide(fine_.cells),
          wide(step_),
          {float(options_.share), float(options_.noise * noise), float(noise), 0},
          glm::vec4(fine_.cell_mm, 0),
          different_},
      slice_groups(bricks));
  recorder_.run();
  Candidates wanted;
  const auto work = work_.as<uint32_t>();
  for (size_t i = 0; i < bricks.size(); ++i)
    if (work[i]) wanted[bricks[i]] = work[i];
  return wanted;
}

/// Of four candidates, the best one of each cell in these bricks, if it is better than what was
/// chosen before. Costs are smoothed, so they are also computed in the neighbouring bricks.
void SlidingBorders::choose(int first, const BrickList& bricks, const FramePyramid& fixed,
                            const FramePyramid& moving, const vulkan::Image& means) {
  const vulkan::Sampler& nearest = kernels_->nearest();
  const BrickList near = read_around(bricks);
  list(near, near_list_);
  list(bricks, list_);
  recorder_.restart();
  record_cost(first, fixed, moving, means, near);
  const vulkan::Image& costs = record_smooth(near);
  recorder_.dispatch(kernels_->sliding_choose(),
                     {list_, {costs, nearest}, {chosen_, nearest}, chosen_, {field_, nearest}},
                     shaders::SlidingChoosePush{wide(fine_.cells, first), wide(step_),
                                                glm::vec4(fine_.cell_mm, 0), different_},
                     slice_groups(bricks));
  recorder_.run();
}

/// The field with what was chosen in these bricks.
void SlidingBorders::record_take(const BrickList& bricks) {
  const vulkan::Sampler& nearest = kernels_->nearest();
  list(bricks, list_);
  recorder_.dispatch(
      kernels_->sliding_take(), {list_, {chosen_, nearest}, {field_, nearest}, other_},
      shaders::SlidingTakePush{wide(fine_.cells), wide(step_)}, slice_groups(bricks));
  std::swap(field_, other_);
}

/// The bricks whose costs are summed in these.
BrickList SlidingBorders::read_around(const BrickList& bricks) const {
  return alone_ ? bricks : with_neighbours(bricks, fine_.cells);
}

/// The bricks of which any of these candidates (bits) may be better.
BrickList SlidingBorders::with(const Candidates& all, uint32_t candidates) {
  BrickList result;
  for (const auto& [brick, bits] : all)
    if (bits & candidates) result.push_back(brick);
  return result;
}

bool SlidingBorders::solve(const FramePyramid& fixed, const FramePyramid& moving,
                           const vulkan::Image& solved, const std::stop_token& stop,
                           SolveReport& report) {
  // 1. The field on finer cells, and the bricks in which motions nearby differ.
  const SteepCandidates found = begin(solved);
  const BrickList bordering = with(found.candidates, ~0U);

  // 2. Of these, bricks in which the intensities do not match.
  Candidates wanted;
  const vulkan::Image* means = nullptr;
  if (!bordering.empty()) {
    const BrickList near = read_around(bordering);
    list(near, near_list_);
    recorder_.restart();
    means = &record_means(fixed, moving, solved);
    record_cost(-1, fixed, moving, *means, near);
    wanted = find_work(bordering, fixed, record_smooth(near));
  }
  report.sliding_bricks = double(wanted.size()) / double(all_bricks(fine_.cells).size());

  // 3. The best candidate of each cell in these bricks.
  for (int first = 0; first < kCandidates; first += 4) {
    const BrickList bricks = with(wanted, 0xFU << first);
    if (bricks.empty()) continue;
    if (stop.stop_requested()) return false;
    choose(first, bricks, fixed, moving, *means);
  }
  const BrickList changed = with(wanted, ~0U);
  recorder_.restart();
  if (!changed.empty()) record_take(changed);
  kernels_->record_clear(recorder_, costs_);  // from here on it holds the flags of folds
  recorder_.run();

  // 4. Repair folds, of the candidates and of the interpolation.
  BrickList may_fold = changed;
  may_fold.insert(may_fold.end(), found.steep.begin(), found.steep.end());
  repair_folds(recorder_, *kernels_, fine_, min_determinant_, kRoundsAlong,
               {field_, other_, costs_, list_, work_}, with_neighbours(may_fold, fine_.cells),
               report);
  return true;
}

}  // namespace palpate
