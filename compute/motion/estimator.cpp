#include "compute/motion/estimator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "compute/motion/classic.h"
#include "compute/motion/solver.h"
#include "compute/volume/memory.h"
#include "compute/vulkan/caught.h"
#include "compute/vulkan/tried.h"

namespace palpate {
namespace {

/// Effort of the backward field: iterations on its finest level and on the coarser ones, and the
/// work of its discrete start. It only has to tell right fields from wrong ones: it misses right
/// ones by 1 voxel and wrong ones by 3 or more. With 8, 12 and 1e7 it comes no nearer on real pairs
/// (docs/decisions).
constexpr int kBackwardIterations = 3;
constexpr int kBackwardCoarseIterations = 6;
constexpr double kBackwardSearchWork = 2e6;
// (2 * 19 + 1)^3 labels are the most that one dispatch can count
constexpr int kMostSearchReach = 19;
constexpr size_t kWaiting = 2;  // frames that wait for the worker before push() blocks

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string text(glm::ivec3 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

/// The plan of the backward field: least effort, on the same pyramid without its finest level,
/// which takes most of the time.
MotionPlan plan_backward(const MotionPlan& plan) {
  MotionOptions options = without_sliding_step(*motion_preset("fast"));
  options.normalise = plan.options.normalise;
  options.coarse_levels = plan.options.coarse_levels;
  const int coarsest = int(plan.levels.size()) - 1;
  options.finest_level = std::min(coarsest, std::max(1, plan.options.finest_level));
  options.search_work = kBackwardSearchWork;
  for (LevelOptions& level : options.levels) level.iterations = kBackwardCoarseIterations;
  options.levels[std::min(size_t(options.finest_level), options.levels.size() - 1)].iterations =
      kBackwardIterations;
  return plan_motion(plan.image, options);
}

struct WaitingFrame {
  size_t index = 0;
  HalfVolume values;
};

struct DeviceFrame {
  size_t index = 0;
  double prepare_seconds = 0.0;
  std::unique_ptr<FramePyramid> pyramid;
  HalfVolume values;  // only if it was not prepared as a whole and may have to be
};

class Worker final : public SequenceEstimator {
 public:
  Worker(std::shared_ptr<vulkan::Context> context, const Grid& grid, EstimatorOptions options,
         OnMotion on_motion, OnProgress on_progress)
      : context_(std::move(context)),
        options_(std::move(options)),
        plan_(plan_motion(grid, options_.motion, options_.cyclic)),
        backward_plan_(options_.backward ? std::optional(plan_backward(plan_)) : std::nullopt),
        fits_(fit()),
        on_motion_(std::move(on_motion)),
        on_progress_(std::move(on_progress)) {}

  /// Allocates everything and starts the worker. Throws vulkan::Failure.
  void start() {
    auto kernels = std::make_shared<MotionKernels>(context_);
    region_ = region(plan_);
    builder_ = std::make_unique<PyramidBuilder>(context_, kernels, plan_, region_);
    if (options_.motion.method == MotionMethod::kClassic) {
      solver_ = std::make_unique<ClassicSolver>(context_, kernels, plan_);
    } else {
      solver_ = std::make_unique<PairSolver>(context_, kernels, plan_, region_);
    }
    if (backward_plan_) {
      backward_ =
          std::make_unique<PairSolver>(context_, kernels, *backward_plan_, region(*backward_plan_));
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }

  ~Worker() override {
    cancel();
    if (thread_.joinable()) thread_.join();
  }

  bool fits() const { return fits_; }
  const MotionPlan& plan() const override { return plan_; }
  MemoryEstimate memory() const override {
    return {plan_.device_bytes + backward_bytes(), context_->memory_budget_bytes(),
            int(slabs_of(plan_).size()), backward_plan_.has_value(), has_sliding_step(plan_)};
  }

  Status push(size_t frame_index, const Volume& frame) override {
    if (frame.grid.size != plan_.image.size || !same_geometry(frame.grid, plan_.image)) {
      return Error{ErrorKind::kBadInput,
                   "Frame " + std::to_string(frame_index) + " (" + text(frame.grid.size) +
                       " voxels) is not on the grid of the sequence (" + text(plan_.image.size) +
                       "): resample it, so that all frames share size, spacing and direction."};
    }
    // One scale and one noise floor for all frames, from the first, so that differences between
    // frames are kept.
    std::call_once(scale_once_, [&] { scale_ = frame_scale(frame, plan_.options.noise); });
    HalfVolume values = scaled_halves(frame, scale_.intensity, take_spare());

    std::unique_lock lock(mutex_);
    if (last_pushed_ && frame_index <= *last_pushed_) {
      return Error{ErrorKind::kBadInput, "Frame " + std::to_string(frame_index) +
                                             " came after frame " + std::to_string(*last_pushed_) +
                                             ": frames must be pushed in rising order."};
    }
    if (options_.backlog == 0) {
      changed_.wait(lock, [&] { return waiting_.size() < kWaiting || ended_ || stopped_; });
    }
    if (error_) return *error_;
    if (ended_ || stopped_) {
      return Error{ErrorKind::kCancelled, "The estimation has ended and takes no more frames."};
    }
    last_pushed_ = frame_index;
    waiting_.push_back({frame_index, std::move(values)});
    if (options_.backlog > 0 && waiting_.size() > options_.backlog) {
      spare_.push_back(std::move(waiting_.front().values));
      waiting_.pop_front();
      ++dropped_;
    }
    changed_.notify_all();
    return Nothing{};
  }

  Status finish() override {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      spare_.clear();
      changed_.notify_all();
    }
    {
      // Two threads may call finish(): the second waits for the first.
      const std::lock_guard joining(join_mutex_);
      if (thread_.joinable()) thread_.join();
    }
    const std::lock_guard lock(mutex_);
    if (error_) return *error_;
    if (stopped_) return Error{ErrorKind::kCancelled, "The estimation was cancelled."};
    return Nothing{};
  }

  void cancel() override {
    {
      const std::lock_guard lock(mutex_);
      if (!done_) stopped_ = true;
      changed_.notify_all();
    }
    stop_.request_stop();
  }

  size_t dropped() const override {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  /// Memory of a frame that has been prepared, for the next one.
  HalfVolume take_spare() {
    const std::lock_guard lock(mutex_);
    if (spare_.empty()) return {};
    HalfVolume spare = std::move(spare_.back());
    spare_.pop_back();
    return spare;
  }

  void give_spare(HalfVolume values) {
    const std::lock_guard lock(mutex_);
    if (!ended_) spare_.push_back(std::move(values));
  }

  uint64_t backward_bytes() const { return backward_plan_ ? solver_bytes(*backward_plan_) : 0; }

  /// The backward field is left out if it does not fit, or would cost the step for sliding borders
  /// or more slabs.
  bool fit() {
    const MemoryBudget budget = budget_of(*context_);
    const bool fits = fit_into(plan_, budget);
    MotionPlan less = plan_;
    MemoryBudget rest = budget;
    rest.device_bytes -= std::min(budget.device_bytes, backward_bytes());
    rest.both_bytes -= std::min(budget.both_bytes, backward_bytes());
    if (!fit_into(less, rest) || less.slabs > plan_.slabs ||
        has_sliding_step(less) != has_sliding_step(plan_))
      backward_plan_.reset();
    return fits;
  }

  Region region(const MotionPlan& plan) const {
    return options_.mask ? region_of(plan, *options_.mask) : whole_region(plan);
  }

  void run(const std::stop_token&) {
    const Status worked = caught([&]() -> Status {
      work();
      return Nothing{};
    });
    const std::lock_guard lock(mutex_);
    if (!worked) error_ = worked.error();
    done_ = true;
    ended_ = true;
    waiting_.clear();
    spare_.clear();
    changed_.notify_all();
  }

  std::optional<WaitingFrame> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_.empty() || ended_ || stopped_; });
    if (stopped_ || waiting_.empty()) return std::nullopt;
    WaitingFrame frame = std::move(waiting_.front());
    waiting_.pop_front();
    changed_.notify_all();
    return frame;
  }

  DeviceFrame prepare(WaitingFrame frame, std::unique_ptr<FramePyramid> reuse) {
    const auto start = Clock::now();
    DeviceFrame result;
    result.index = frame.index;
    result.pyramid = reuse ? std::move(reuse) : std::make_unique<FramePyramid>(context_, plan_);
    builder_->build(frame.values, scale_.noise, *result.pyramid);
    if (std::isfinite(region_.reach_mm)) {
      result.values = std::move(frame.values);
    } else {
      give_spare(std::move(frame.values));
    }
    result.prepare_seconds = seconds_since(start);
    return result;
  }

  /// Motion is larger than the region expects: from now on frames are prepared whole, also this
  /// one, the moving frame of the pair. (The fixed frame is read only in the bricks that the mask
  /// leaves.)
  void widen(DeviceFrame& frame) {
    const auto start = Clock::now();
    if (std::isfinite(region_.reach_mm)) {
      region_ = with_whole_images(plan_, std::move(region_));
      builder_->set_region(region_);
    }
    if (!std::isfinite(frame.pyramid->reach_mm())) return;
    builder_->build(frame.values, scale_.noise, *frame.pyramid);
    frame.values = {};
    frame.prepare_seconds += seconds_since(start);
  }

  void work() {
    std::optional<DeviceFrame> first, before;
    std::unique_ptr<FramePyramid> spare;
    while (auto frame = next()) {
      DeviceFrame now = prepare(*std::move(frame), std::move(spare));
      // A cycle needs its first frame again at the end; any other frame is no longer needed after
      // it was the fixed one.
      if (before) {
        if (!solve(*before, now)) return;
        if (options_.from_first) {
          spare = std::move(now.pyramid);
          continue;
        }
        if (first || !options_.cyclic) {
          spare = std::move(before->pyramid);
        } else {
          first = std::move(before);
        }
      }
      before = std::move(now);
    }
    if (options_.cyclic && !options_.from_first && first && before && !stop_.stop_requested())
      solve(*before, *first);
  }

  /// False if stopped.
  bool solve(const DeviceFrame& fixed, DeviceFrame& moving) {
    const auto solve_once = [&] {
      return solver_->solve(*fixed.pyramid, *moving.pyramid, stop_.get_token(), [&](double share) {
        if (on_progress_) on_progress_(fixed.index, moving.index, share);
      });
    };
    auto report = solve_once();
    if (report && report->out_of_reach) {
      const double in_vain = report->seconds;
      widen(moving);
      report = solve_once();
      if (report) report->seconds += in_vain;
    }
    if (!report) return false;
    PairMotion motion;
    motion.fixed_frame = fixed.index;
    motion.moving_frame = moving.index;
    motion.report = *report;
    motion.report.prepare_seconds = moving.prepare_seconds;
    solver_->download(motion.field, motion.confidence);
    if (backward_ && !solve_backward(fixed, moving, motion)) return false;
    if (stop_.stop_requested()) return false;
    on_motion_(std::move(motion));
    return true;
  }

  /// False if stopped. Without a backward field if the fixed frame was not prepared as far as
  /// things move.
  bool solve_backward(const DeviceFrame& fixed, const DeviceFrame& moving, PairMotion& motion) {
    const auto report = backward_->solve(*moving.pyramid, *fixed.pyramid, stop_.get_token(), {});
    if (!report) return false;
    motion.report.backward_seconds = report->seconds;
    if (report->out_of_reach) return true;
    Confidence unused;
    backward_->download(motion.backward.emplace(), unused);
    return true;
  }

  const std::shared_ptr<vulkan::Context> context_;
  const EstimatorOptions options_;
  MotionPlan plan_;
  std::optional<MotionPlan> backward_plan_;
  const bool fits_;
  const OnMotion on_motion_;
  const OnProgress on_progress_;
  Region region_;
  std::unique_ptr<PyramidBuilder> builder_;
  std::unique_ptr<FieldSolver> solver_;
  std::unique_ptr<FieldSolver> backward_;  // only if asked for

  std::once_flag scale_once_;
  FrameScale scale_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<WaitingFrame> waiting_;
  std::vector<HalfVolume> spare_;  // memory for frames to come
  std::optional<size_t> last_pushed_;
  std::optional<Error> error_;
  bool ended_ = false;    // no more frames will come
  bool stopped_ = false;  // cancelled
  bool done_ = false;     // the worker has returned
  size_t dropped_ = 0;

  std::stop_source stop_;
  std::mutex join_mutex_;
  std::jthread thread_;  // last: joined before what it uses goes
};

std::string check_options(const EstimatorOptions& options, const Grid& grid) {
  const MotionOptions& o = options.motion;
  const int narrow = (grid.size.x < 4) + (grid.size.y < 4) + (grid.size.z < 4);
  if (narrow > 1 || glm::any(glm::lessThan(grid.size, glm::ivec3(1)))) {
    return "A volume of " + text(grid.size) +
           " voxels is too small to follow motion in: at least 4 along two axes are needed.";
  }
  if (o.levels.empty())
    return "The motion options name no level: take a preset (fast, balanced, best, classic).";
  if (o.finest_level < 0 ||
      o.finest_level >=
          int(plan_motion(grid, MotionOptions{.levels = o.levels, .coarse_levels = o.coarse_levels})
                  .levels.size())) {
    return "The finest level asked for does not exist in a volume of " + text(grid.size) +
           " voxels: 0 is the image's own.";
  }
  // NaN is out of every range here.
  for (const LevelOptions& level : o.levels) {
    if (!(level.iterations >= 0 && level.cell >= 1 && level.cell <= 8 && level.window >= 0.0 &&
          level.smoothness > 0.0)) {
      return "A level of the motion options is out of range: iterations >= 0, cell 1 to 8, window "
             ">= 0, smoothness > 0.";
    }
  }
  const YieldOptions& y = o.yield;
  if (!(y.window >= 0.0 && y.low >= 0.0 && y.high > y.low && y.damping > 0.0 &&
        y.smoothness > 0.0 && y.evidence > 0.0 && y.noise >= 0.0 && y.flat >= 0.0)) {
    return "The yield of the motion options is out of range: window, low, noise and flat >= 0, "
           "high above low, damping, smoothness and evidence > 0.";
  }
  const SlidingOptions& s = o.sliding;
  if (!(s.cell >= 0 && s.cell <= 8 && s.cubic >= 0.0 && s.cubic <= 1.0 && s.limit > 0.0 &&
        s.share >= 0.0 && s.noise >= 0.0 && s.apart >= 0.0 && s.slope >= 0.0)) {
    return "The sliding borders of the motion options are out of range: cell 0 to 8, cubic 0 to 1, "
           "share, noise, apart and slope >= 0, limit > 0.";
  }
  if (!(o.search_mm >= 0.0 && std::isfinite(o.search_mm) && o.search_above >= 0.0 &&
        o.search_reach >= 0.0 && o.search_reach <= kMostSearchReach && o.search_work >= 0.0)) {
    return "The search for large motion is out of range: search_mm, search_above and search_work "
           ">= 0, search_reach 0 to " +
           std::to_string(kMostSearchReach) + ".";
  }
  if (options.mask && !same_geometry(options.mask->grid, grid)) {
    return "The mask (" + text(options.mask->grid.size) +
           " voxels) is not on the grid of the frames (" + text(grid.size) +
           " voxels): draw it on one of the frames.";
  }
  return {};
}

std::string megabytes(uint64_t bytes) {
  return std::to_string((bytes + (1U << 20) - 1) >> 20) + " MiB";
}

}  // namespace

MemoryBudget budget_of(const vulkan::Context& context) {
  MemoryBudget budget{context.memory_budget_bytes(), context.largest_image_bytes()};
  const uint64_t own = context.is_cpu() ? memory_for_cpu_work() : 0;
  if (own > 0) budget.both_bytes = own;
  return budget;
}

Result<std::unique_ptr<SequenceEstimator>> SequenceEstimator::open(
    std::shared_ptr<vulkan::Context> context, const Grid& grid, EstimatorOptions options,
    OnMotion on_motion, OnProgress on_progress) {
  if (const std::string wrong = check_options(options, grid); !wrong.empty()) {
    return Error{ErrorKind::kBadInput, wrong};
  }
  const MemoryBudget budget = budget_of(*context);
  auto worker = std::make_unique<Worker>(std::move(context), grid, std::move(options),
                                         std::move(on_motion), std::move(on_progress));
  if (!worker->fits()) {
    const MotionPlan& plan = worker->plan();
    const std::string takes = "The motion of frames of " + text(grid.size) + " voxels takes ";
    const std::string advice = ": crop or mask the volume, or choose another Vulkan device.";
    if (plan.largest_image_bytes > budget.largest_image_bytes) {
      return Error{ErrorKind::kOutOfMemory, takes + "an image of " +
                                                megabytes(plan.largest_image_bytes) +
                                                " and the device makes none over " +
                                                megabytes(budget.largest_image_bytes) + advice};
    }
    // Where the device alone has room, what slabs keep on the host is too much.
    const bool is_both = plan.device_bytes <= budget.device_bytes;
    return Error{ErrorKind::kOutOfMemory,
                 takes + megabytes(plan.device_bytes + (is_both ? plan.host_bytes : 0)) +
                     (is_both ? " of memory" : " of device memory") + " and there are " +
                     megabytes(is_both ? budget.both_bytes : budget.device_bytes) + advice};
  }
  if (const Status started = vulkan::tried([&] { worker->start(); }); !started)
    return started.error();
  return std::unique_ptr<SequenceEstimator>(std::move(worker));
}

Result<PairMotion> estimate_motion(const std::shared_ptr<vulkan::Context>& context,
                                   const Volume& fixed, const Volume& moving,
                                   const EstimatorOptions& options, std::stop_token stop,
                                   const std::function<void(double)>& progress) {
  std::optional<PairMotion> found;
  EstimatorOptions pair = options;
  pair.cyclic = false;
  pair.backlog = 0;
  auto estimator = SequenceEstimator::open(
      context, fixed.grid, pair, [&](PairMotion motion) { found = std::move(motion); },
      [&](size_t, size_t, double share) {
        if (progress) progress(share);
      });
  if (!estimator) return estimator.error();
  const std::stop_callback cancel(stop, [&] { (*estimator)->cancel(); });
  if (Status pushed = (*estimator)->push(0, fixed); !pushed) return pushed.error();
  const bool same = same_geometry(fixed.grid, moving.grid);
  if (Status pushed = (*estimator)->push(1, same ? moving : resampled(moving, fixed.grid));
      !pushed) {
    return pushed.error();
  }
  if (Status done = (*estimator)->finish(); !done) return done.error();
  return std::move(*found);
}

}  // namespace palpate
