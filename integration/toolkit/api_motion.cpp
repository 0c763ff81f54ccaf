// Motion between frames in the memory of a program.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stop_token>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/sequence_quality.h"
#include "integration/files/raster/raster.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/sequence_motion_file.h"
#include "integration/toolkit/motion_content.h"
#include "integration/toolkit/options.h"

namespace palpate::toolkit {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// The estimator whose callback is running on this thread; null: none.
thread_local const void* estimator_calling_back = nullptr;

/// The worse of two measurements, compared by one of their numbers.
template <class Measured, class Number>
void keep_worse(std::optional<Measured>& worst, const std::optional<Measured>& one,
                Number badness) {
  if (one && (!worst || badness(*one) > badness(*worst))) worst = one;
}

}  // namespace

/// The content of a PalEstimator.
class EstimatorContent {
 public:
  EstimatorContent(std::shared_ptr<ContextContent> context, const Grid& grid,
                   const PalEstimatorInfo& info, EstimatorOptions options)
      : context_(std::move(context)),
        grid_(grid),
        flags_(info.flags),
        options_(std::move(options)),
        on_progress_(info.on_progress),
        user_(info.user) {}

  /// Starts the work that can begin before all frames are there.
  Status begin() {
    if (!(flags_ & PAL_ESTIMATOR_PAIRWISE)) return Nothing{};
    auto opened = open_pairwise();
    if (!opened) return opened.error();
    pairwise_ = std::move(*opened);
    return Nothing{};
  }

  Status push(PalSampleType type, const void* samples, double time_s) {
    auto frame = volume_of(grid_, type, samples);
    if (!frame) return frame.error();
    const std::lock_guard lock(pushing_);
    if (finished_) return Error{ErrorKind::kBadInput, "The estimator was finished already"};
    const double last_s = times_s_.empty() ? -1.0 : times_s_.back();
    if (!std::isfinite(time_s) || (time_s >= 0.0 && !times_s_.empty() && time_s <= last_s))
      return Error{ErrorKind::kBadInput, "The times of frames must rise"};
    if (times_s_.empty()) first_ = Clock::now();
    const size_t k = times_s_.size();
    if (pairwise_)
      if (const Status pushed = pairwise_->push(k, *frame); !pushed) return pushed;
    times_s_.push_back(time_s < 0.0 ? last_s + 1.0 : time_s);
    pushed_ = times_s_.size();
    if (keeps_frames()) frames_.push_back(std::move(*frame));
    return Nothing{};
  }

  Result<std::shared_ptr<MotionContent>> finish() {
    {
      const std::lock_guard lock(pushing_);
      if (finished_) return Error{ErrorKind::kBadInput, "The estimator was finished already"};
      finished_ = true;
    }
    if (times_s_.size() < 2) {
      // If the device failed, a missing frame is not the program's error.
      const Status ended = pairwise_ ? pairwise_->finish() : Status(Nothing{});
      if (!ended) return ended.error();
      return Error{ErrorKind::kBadInput, "Motion is between frames: push at least two"};
    }
    auto motion = std::make_shared<MotionContent>();
    motion->grid = grid_;
    motion->frames = times_s_.size();
    motion->begin_s = times_s_.front();
    for (double& time_s : times_s_) time_s -= motion->begin_s;
    motion->times = {times_s_, options_.cyclic ? cycle_of(times_s_) : 0.0, 0};
    const bool is_whole = !pairwise_ && times_s_.size() > 2;
    if (const Status found = is_whole ? find_whole(*motion) : find_pairs(*motion); !found)
      return stop_.stop_requested() ? stopped() : found.error();
    if (stop_.stop_requested()) return stopped();
    is_found_ = true;
    return motion;
  }

  void fill(PalProgress& progress) const {
    progress.frames_pushed = uint32_t(pushed_);
    progress.steps_found = uint32_t(steps_found_);
    progress.is_finished = is_found_;
    progress.share = is_found_ ? 1.0 : share_.load();
  }

  void cancel() {
    stop_.request_stop();
    const std::lock_guard lock(opening_);
    if (pairwise_) pairwise_->cancel();
  }

 private:
  Error stopped() const {
    const std::lock_guard lock(telling_);
    if (thrown_)
      return {ErrorKind::kCancelled,
              std::string("The estimation was stopped: ") + thrown_.sentence()};
    return {ErrorKind::kCancelled, "The estimation was stopped as asked"};
  }
  bool judges() const { return !(flags_ & PAL_ESTIMATOR_NO_VERDICT); }
  bool keeps_frames() const { return judges() || !pairwise_; }

  void tell(const std::string& doing, double share) {
    share_ = share;
    if (!on_progress_) return;
    const void* const before = std::exchange(estimator_calling_back, this);
    const Thrown thrown =
        call_host("on_progress", [&] { on_progress_(user_, doing.c_str(), share); });
    estimator_calling_back = before;
    if (!thrown) return;
    {
      const std::lock_guard lock(telling_);
      if (!thrown_) thrown_ = thrown;
    }
    cancel();
  }

  Result<std::unique_ptr<SequenceEstimator>> open_pairwise() {
    EstimatorOptions options = options_;
    options.backward = judges();
    return SequenceEstimator::open(
        context_->device, grid_, options,
        [this](PairMotion pair) {
          pairs_.push_back(std::move(pair));
          ++steps_found_;
        },
        [this](size_t fixed, size_t moving, double share) {
          // More frames may follow: the share refers to those pushed so far.
          const double pairs = double(std::max<size_t>(pushed_, 2)) - 1.0 + options_.cyclic;
          tell(fmt::format("frame {} to {}", fixed, moving),
               std::min(1.0, (double(pairs_.size()) + share) / pairs));
        });
  }

  /// The fields from each frame to the next.
  Status find_pairs(MotionContent& motion) {
    if (!pairwise_) {
      auto opened = open_pairwise();
      if (!opened) return opened.error();
      {
        const std::lock_guard lock(opening_);
        pairwise_ = std::move(*opened);
      }
      if (stop_.stop_requested()) return stopped();
      for (size_t k = 0; k < frames_.size(); ++k)
        if (const Status pushed = pairwise_->push(k, frames_[k]); !pushed) return pushed;
    }
    if (const Status done = pairwise_->finish(); !done) return done;
    motion.seconds = std::chrono::duration<double>(Clock::now() - first_).count();
    return judge_pairs(motion);
  }

  /// Moves the pairs into the motion, with their verdict where one is asked for.
  Status judge_pairs(MotionContent& motion) {
    Verdict whole;
    const Mask* const mask = options_.mask ? &*options_.mask : nullptr;
    std::optional<CyclePoints> everywhere, where_structure;
    if (options_.cyclic) everywhere.emplace(grid_, mask);
    std::optional<FrameOrderMeter> order;
    bool all_show = true;
    std::vector<float> lengths;
    for (PairMotion& pair : pairs_) {
      const bool is_first = motion.steps.empty(),
                 is_last = motion.steps.size() + 1 == pairs_.size();
      const Field field = resampled(pair.field, grid_);
      for (const glm::vec3& u : field.u_mm) lengths.push_back(glm::length(u));
      std::optional<Evidence> evidence;
      if (judges()) {
        const Volume &fixed = frames_[pair.fixed_frame], &moving = frames_[pair.moving_frame];
        Mask structure;
        auto found = examined(fixed, moving, field, pair.backward ? &*pair.backward : nullptr,
                              &pair.confidence, mask, &structure);
        if (!found) return found.error();
        evidence = std::move(*found);
        if (is_first) order.emplace(grid_, &structure, grid_.finest_mm());
        order->follow(field);
        all_show = all_show && shows_structure(*evidence);
        if (everywhere && is_first && evidence->match->clear > 0)
          where_structure.emplace(grid_, &structure);
      }
      for (auto* points : {&everywhere, &where_structure})
        if (*points) (*points)->follow(field);
      if (everywhere && is_last)
        motion.drift = (where_structure ? *where_structure : *everywhere).drift();
      if (evidence) {
        evidence->drift = motion.drift;
        note(motion, *evidence);
        const Verdict of_pair = judged(*evidence);
        if (pairs_.size() == 1)
          whole = of_pair;
        else
          add(whole, of_pair, fmt::format("Frame {} to {}", pair.fixed_frame, pair.moving_frame));
      }
      motion.steps.push_back(std::move(pair.field));
      motion.confidence.push_back(std::move(pair.confidence));
    }
    motion.motion_mm = spread_of(lengths);
    if (judges()) {
      Verdict first;
      if (order && all_show) add(first, judged(order->found(options_.cyclic), ""), "Sequence");
      whole.trust = std::max(whole.trust, first.trust);
      whole.reasons.insert(whole.reasons.begin(), first.reasons.begin(), first.reasons.end());
      conclude(motion, whole);
    }
    return Nothing{};
  }

  /// One motion for all frames.
  Status find_whole(MotionContent& motion) {
    SequenceMotionOptions options;
    options.estimator = options_;
    SequenceReport report;
    auto found = estimate_sequence_motion(
        context_->device, grid_, times_s_,
        [this](size_t k) -> Result<Volume> { return frames_[k]; }, options,
        [this](const PairMotion&) { ++steps_found_; },
        [this](const std::string& doing, double share) { tell(doing, share); }, stop_.get_token(),
        &report);
    if (!found) return found.error();
    motion.seconds = std::chrono::duration<double>(Clock::now() - first_).count();
    motion.confidence = report.confidence;
    motion.times = found->basis;
    motion.whole = std::move(*found);
    const Mask* const mask = options_.mask ? &*options_.mask : nullptr;
    if (judges()) {
      auto evidence = examined(*motion.whole, frames_, motion.confidence, mask, {});
      if (!evidence) return evidence.error();
      if (motion.whole->basis.cycle_s > 0.0)
        evidence->drift = motion.drift = drift_of(*motion.whole, grid_, mask);
      for (const FrameEvidence& frame : evidence->frames) note(motion, frame.evidence);
      conclude(motion, judged(*evidence));
    }
    std::vector<float> lengths;
    for (size_t k = 0; k < motion.frames; ++k)
      for (const glm::vec3& u : motion.whole->at_frame(k).u_mm) lengths.push_back(glm::length(u));
    motion.motion_mm = spread_of(lengths);
    return Nothing{};
  }

  static void note(MotionContent& motion, const Evidence& evidence) {
    keep_worse(motion.folds, evidence.folds, [](const Folds& folds) { return -folds.min_det; });
    keep_worse(motion.match, evidence.match,
               [](const Match& match) { return match.motion_left_voxels; });
    keep_worse(motion.within_95_mm, evidence.within_95_mm, [](double radius) { return radius; });
  }

  static void conclude(MotionContent& motion, Verdict verdict) {
    for (const std::string& reason : verdict.reasons)
      motion.reasons += (motion.reasons.empty() ? "" : "\n") + reason;
    motion.verdict = std::move(verdict);
  }

  std::shared_ptr<ContextContent> context_;
  Grid grid_;
  uint32_t flags_;
  EstimatorOptions options_;
  void (*on_progress_)(void* user, const char* doing, double share);
  void* user_;
  std::stop_source stop_;
  std::mutex pushing_;
  std::atomic<size_t> pushed_{0}, steps_found_{0};
  std::atomic<double> share_{0.0};
  std::atomic<bool> is_found_{false};
  mutable std::mutex telling_;  ///< guards thrown_
  Thrown thrown_;               ///< the first exception from on_progress
  std::vector<Volume> frames_;
  std::vector<double> times_s_;
  bool finished_ = false;
  Clock::time_point first_{};
  std::vector<PairMotion> pairs_;  ///< used by the estimator's thread until it has finished
  std::mutex opening_;             ///< guards the pointer below against cancel()
  std::unique_ptr<SequenceEstimator> pairwise_;
};

Result<SequenceMotion> whole_of(const MotionContent& motion) {
  if (motion.whole) return *motion.whole;
  auto whole = motion_of_steps(motion.steps, motion.times, frame_nearest_the_mean(motion.steps));
  if (whole) whole->frames_grid = motion.grid;
  return whole;
}

namespace {

PalResult open_estimator(PalContext* context, const PalEstimatorInfo* given,
                         PalEstimator** estimator) {
  const Use use(of(context));
  if (!use) return refused_handle("context");
  if (!estimator) return failed(PAL_BAD_INPUT, {"The argument that takes the estimator is NULL"});
  PalEstimatorInfo info;
  if (const PalResult read =
          taken(given, offsetof(PalEstimatorInfo, preset), "PalEstimatorInfo", info);
      read != PAL_OK)
    return read;
  if (!use->device)
    return failed(PAL_NO_DEVICE,
                  {"The context has no device that computes, so no motion is found"});
  constexpr uint32_t kFlags =
      PAL_ESTIMATOR_PAIRWISE | PAL_ESTIMATOR_CYCLIC | PAL_ESTIMATOR_NO_VERDICT;
  for (const Status& checked :
       {check_flags("PalEstimatorInfo", info.flags, kFlags),
        check_field("iterations", double(info.iterations), files::kIterations)})
    if (!checked) return failed(checked.error());
  const auto grid = grid_of(info.grid);
  if (!grid) return failed(grid.error());
  EstimatorOptions options;
  const auto preset = motion_preset(info.preset ? info.preset : "balanced");
  if (!preset)
    return failed(PAL_BAD_INPUT,
                  {"There is no such preset: choose fast, balanced, best or classic"});
  options.motion = *preset;
  if (info.iterations > 0)
    for (LevelOptions& level : options.motion.levels) level.iterations = int(info.iterations);
  options.cyclic = (info.flags & PAL_ESTIMATOR_CYCLIC) != 0;
  if (info.mask) {
    const auto bytes = volume_of(*grid, PAL_UINT8, info.mask);
    if (!bytes) return failed(bytes.error());
    options.mask = Mask{*grid, {bytes->values.begin(), bytes->values.end()}};
    if (std::none_of(options.mask->values.begin(), options.mask->values.end(),
                     [](uint8_t value) { return value != 0; }))
      return failed(PAL_BAD_INPUT, {"The mask marks no sample at all"});
  }
  auto content = std::make_shared<EstimatorContent>(use.shared(), *grid, info, std::move(options));
  if (const Status begun = content->begin(); !begun) return failed(begun.error());
  *estimator = reinterpret_cast<PalEstimator*>(Handle<EstimatorContent>::make(std::move(content)));
  return PAL_OK;
}

PalMotion* handle_of(std::shared_ptr<MotionContent> content) {
  return reinterpret_cast<PalMotion*>(Handle<MotionContent>::make(std::move(content)));
}

void fill(PalMotionSummary& summary, const MotionContent& motion) {
  summary.frame_count = uint32_t(motion.frames);
  summary.step_count = uint32_t(motion.step_count());
  summary.is_whole = motion.whole.has_value();
  summary.reference_frame = motion.whole ? uint32_t(motion.whole->reference) : 0;
  summary.harmonics = motion.whole ? uint32_t(motion.whole->basis.harmonics) : 0;
  summary.cycle_s = motion.times.cycle_s;
  fill_grid(summary.grid, motion.grid);
  summary.trust = PAL_TRUST_UNKNOWN;
  summary.trust_word = "";
  if (motion.verdict) {
    summary.trust = PalTrust(int(motion.verdict->trust) + 1);
    summary.trust_word = word(motion.verdict->trust);
  }
  summary.reasons = motion.reasons.c_str();
  summary.seconds = motion.seconds;
  summary.motion_mean_mm = motion.motion_mm.mean;
  summary.motion_max_mm = motion.motion_mm.max;
  summary.folded_voxels = motion.folds ? double(motion.folds->folded) : kNotMeasured;
  summary.least_determinant = motion.folds ? motion.folds->min_det : kNotMeasured;
  summary.correlation_before = motion.match ? motion.match->correlation_before : kNotMeasured;
  summary.correlation_after = motion.match ? motion.match->correlation_after : kNotMeasured;
  summary.motion_left_voxels = motion.match ? motion.match->motion_left_voxels : kNotMeasured;
  summary.drift_mean_mm = motion.drift ? motion.drift->mm.mean : kNotMeasured;
  summary.within_95_mm = motion.within_95_mm.value_or(kNotMeasured);
}
static_assert(int(Trust::kOk) + 1 == PAL_TRUST_OK &&
              int(Trust::kSuspect) + 1 == PAL_TRUST_SUSPECT &&
              int(Trust::kFailed) + 1 == PAL_TRUST_FAILED);

/// The grid on which the program wants the field.
Result<Grid> grid_for(const PalFieldInfo& info, const MotionContent& motion) {
  return info.grid ? grid_of(*info.grid) : Result<Grid>(motion.grid);
}

Result<Field> field_for(const PalFieldInfo& info, const MotionContent& motion) {
  const auto grid = grid_for(info, motion);
  if (!grid) return grid.error();
  Field field;
  if (info.flags & PAL_FIELD_TO_TIME) {
    if (!motion.whole)
      return Error{ErrorKind::kBadInput,
                   "Only one motion for all frames has a field to any time: ask for a step"};
    if (!std::isfinite(info.time_s))
      return Error{ErrorKind::kBadInput, "The time of a field is not finite"};
    field = motion.whole->at(info.time_s - motion.begin_s);
  } else {
    if (info.step >= motion.step_count())
      return Error{ErrorKind::kBadInput, fmt::format("There is no step {}: the motion has {}",
                                                     info.step, motion.step_count())};
    field =
        motion.whole ? consecutive_field(*motion.whole, info.step, *grid) : motion.steps[info.step];
  }
  if (info.flags & PAL_FIELD_INVERSE) return inverse_of(field, *grid).w;
  return resampled(field, *grid);
}

/// Runs `work` with a motion and the program's request.
template <class Work>
PalResult with(const PalMotion* motion, const PalFieldInfo* given, const Work& work) noexcept {
  return guarded([&] {
    const Use use(of(motion));
    if (!use) return refused_handle("motion");
    PalFieldInfo info;
    if (const PalResult read = taken(given, offsetof(PalFieldInfo, time_s), "PalFieldInfo", info);
        read != PAL_OK)
      return read;
    if (const Status flags =
            check_flags("PalFieldInfo", info.flags, PAL_FIELD_TO_TIME | PAL_FIELD_INVERSE);
        !flags)
      return failed(flags.error());
    return work(*use, info);
  });
}

}  // namespace
}  // namespace palpate::toolkit

using namespace palpate::toolkit;
using palpate::Status;

PalResult pal_estimator_open(PalContext* context, const PalEstimatorInfo* info,
                             PalEstimator** estimator) {
  return guarded([&] { return open_estimator(context, info, estimator); });
}

PalResult pal_estimator_push(PalEstimator* estimator, PalSampleType type, const void* samples,
                             double time_s) {
  return guarded([&] {
    const Use use(of(estimator));
    if (!use) return refused_handle("estimator");
    const Status pushed = use->push(type, samples, time_s);
    return pushed ? PAL_OK : failed(pushed.error());
  });
}

PalResult pal_estimator_finish(PalEstimator* estimator, PalMotion** motion) {
  return guarded([&] {
    const Use use(of(estimator));
    if (!use) return refused_handle("estimator");
    if (!motion) return failed(PAL_BAD_INPUT, {"The argument that takes the motion is NULL"});
    if (estimator_calling_back == &*use)
      return failed(PAL_BAD_INPUT, {"An estimator can not be finished from its own callback"});
    auto found = use->finish();
    if (!found) return failed(found.error());
    *motion = handle_of(std::move(*found));
    return PAL_OK;
  });
}

PalResult pal_estimator_poll(const PalEstimator* estimator, PalProgress* progress) {
  return guarded([&] {
    const Use use(of(estimator));
    if (!use) return refused_handle("estimator");
    PalProgress known;
    if (const PalResult read = taken(progress, offsetof(PalProgress, share), "PalProgress", known);
        read != PAL_OK)
      return read;
    use->fill(known);
    std::memcpy(progress, &known, progress->size);
    return PAL_OK;
  });
}

PalResult pal_estimator_cancel(PalEstimator* estimator) {
  return guarded([&] {
    const Use use(of(estimator));
    if (!use) return refused_handle("estimator");
    use->cancel();
    return PAL_OK;
  });
}

PalResult pal_estimator_close(PalEstimator** estimator) {
  return guarded([&] {
    if (!estimator) return PAL_OK;
    {
      const Use use(of(seen_in(estimator)));
      if (use && estimator_calling_back == &*use)
        return failed(PAL_BAD_INPUT,
                      {"An estimator can not be closed from its own callback: cancel it there"});
      if (use) use->cancel();
    }
    closed(of(taken_out_of(estimator)));
    return PAL_OK;
  });
}

PalResult pal_motion_close(PalMotion** motion) {
  return guarded([&] {
    closed(of(taken_out_of(motion)));
    return PAL_OK;
  });
}

PalResult pal_motion_open(PalContext* context, const char* path, PalMotion** motion) {
  return guarded([&] {
    const Use use(of(context));
    if (!use) return refused_handle("context");
    if (!path || !motion)
      return failed(PAL_BAD_INPUT, {"The path, or the place for the motion, is missing"});
    auto read = palpate::files::read_sequence_motion(path);
    if (!read) return failed(read.error());
    auto content = std::make_shared<MotionContent>();
    content->is_from_file = true;
    content->grid = read->frames_grid.value_or(read->terms.front().grid);
    content->frames = read->frames();
    content->times = read->basis;
    content->whole = std::move(*read);
    std::vector<float> lengths;
    for (size_t k = 0; k < content->frames; ++k)
      for (const glm::vec3& u : content->whole->at_frame(k).u_mm) lengths.push_back(glm::length(u));
    content->motion_mm = palpate::spread_of(lengths);
    *motion = handle_of(std::move(content));
    return PAL_OK;
  });
}

PalResult pal_motion_summary(const PalMotion* motion, PalMotionSummary* summary) {
  return guarded([&] {
    const Use use(of(motion));
    if (!use) return refused_handle("motion");
    PalMotionSummary known;
    if (const PalResult read =
            taken(summary, offsetof(PalMotionSummary, cycle_s), "PalMotionSummary", known);
        read != PAL_OK)
      return read;
    fill(known, *use);
    std::memcpy(summary, &known, summary->size);
    return PAL_OK;
  });
}

PalResult pal_motion_field(const PalMotion* motion, const PalFieldInfo* info, float* xyz_mm) {
  return with(motion, info, [&](const MotionContent& of_motion, const PalFieldInfo& wanted) {
    if (!xyz_mm) return failed(PAL_BAD_INPUT, {"The argument that takes the field is NULL"});
    const auto field = field_for(wanted, of_motion);
    if (!field) return failed(field.error());
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
    std::memcpy(xyz_mm, field->u_mm.data(), field->u_mm.size() * sizeof(glm::vec3));
    palpate::files::reverse_j(field->grid, xyz_mm, 3);
    return PAL_OK;
  });
}

PalResult pal_motion_confidence(const PalMotion* motion, const PalFieldInfo* info, float* values) {
  return with(motion, info, [&](const MotionContent& of_motion, const PalFieldInfo& wanted) {
    if (!values) return failed(PAL_BAD_INPUT, {"The argument that takes the confidence is NULL"});
    if (wanted.step >= of_motion.confidence.size())
      return failed(PAL_BAD_INPUT, {"There is no confidence of such a step"});
    const auto grid = grid_for(wanted, of_motion);
    if (!grid) return failed(grid.error());
    const palpate::Confidence& known = of_motion.confidence[wanted.step];
    palpate::Volume on_grid = resampled(palpate::Volume{known.grid, known.values}, *grid);
    palpate::files::reverse_j(*grid, on_grid.values.data(), 1);
    std::copy(on_grid.values.begin(), on_grid.values.end(), values);
    return PAL_OK;
  });
}

PalResult pal_motion_deviation(const PalMotion* motion, const PalFieldInfo* info,
                               float* along_across_mm) {
  return with(motion, info, [&](const MotionContent& of_motion, const PalFieldInfo& wanted) {
    if (!along_across_mm)
      return failed(PAL_BAD_INPUT, {"The argument that takes the deviation is NULL"});
    if (wanted.step >= of_motion.confidence.size() ||
        of_motion.confidence[wanted.step].deviation.mm.empty())
      return failed(PAL_BAD_INPUT, {"There is no deviation of such a step"});
    const auto grid = grid_for(wanted, of_motion);
    if (!grid) return failed(grid.error());
    const palpate::Deviation on_grid =
        resampled(of_motion.confidence[wanted.step].deviation, *grid);
    static_assert(sizeof(glm::vec2) == 2 * sizeof(float));
    std::memcpy(along_across_mm, on_grid.mm.data(), on_grid.mm.size() * sizeof(glm::vec2));
    palpate::files::reverse_j(*grid, along_across_mm, 2);
    return PAL_OK;
  });
}

PalResult pal_motion_warp(const PalMotion* motion, const PalFieldInfo* info, PalSampleType type,
                          const void* samples, float* warped) {
  return with(motion, info, [&](const MotionContent& of_motion, const PalFieldInfo& wanted) {
    if (!warped) return failed(PAL_BAD_INPUT, {"The argument that takes the warped frame is NULL"});
    const auto grid = of_motion.is_from_file ? grid_for(wanted, of_motion)
                                             : palpate::Result<palpate::Grid>(of_motion.grid);
    if (!grid) return failed(grid.error());
    const auto frame = volume_of(*grid, type, samples);
    if (!frame) return failed(frame.error());
    const auto field = field_for(wanted, of_motion);
    if (!field) return failed(field.error());
    palpate::Volume carried = palpate::warped(*frame, *field, field->grid);
    palpate::files::reverse_j(field->grid, carried.values.data(), 1);
    std::copy(carried.values.begin(), carried.values.end(), warped);
    return PAL_OK;
  });
}

PalResult pal_motion_save(const PalMotion* motion, const PalFieldInfo* info, const char* path) {
  if (!path) return failed(PAL_BAD_INPUT, {"The path is missing"});
  if (info)
    return with(motion, info, [&](const MotionContent& of_motion, const PalFieldInfo& wanted) {
      const auto field = field_for(wanted, of_motion);
      if (!field) return failed(field.error());
      const Status written = palpate::files::write_field(*field, path);
      return written ? PAL_OK : failed(written.error());
    });
  return guarded([&] {
    const Use use(of(motion));
    if (!use) return refused_handle("motion");
    const auto whole = whole_of(*use);
    if (!whole) return failed(whole.error());
    const Status written = palpate::files::write_sequence_motion(*whole, path);
    return written ? PAL_OK : failed(written.error());
  });
}
