#include "module/session/live_motion.h"

#include <algorithm>
#include <chrono>

#include "compute/volume/memory.h"
#include "compute/vulkan/caught.h"
#include "module/haptics/servo/monotonic.h"
#include "module/haptics/servo/real_time.h"
#include "module/scene/make_volume.h"

namespace palpate {
LiveMotion::LiveMotion(const LoadedScene& scene, const LiveMotionOptions& options,
                       LiveMotionListener listener)
    : options_(options), listener_(std::move(listener)) {
  for (const MissingMotion& missing : scene.missing) {
    const VolumeSpec& spec = scene.spec.volumes[missing.volume];
    // Computed data change in value, so their own values are right.
    const bool whole = spec.source.empty() && spec.values != CarriedValues::kOwn;
    const auto& volume = missing.own ? missing.own : scene.data[missing.volume];
    needs_whole_ |= missing.own != nullptr;
    jobs_.push_back(
        {missing, spec.cyclic, whole, spec.values.value_or(CarriedValues::kReference), volume});
    steps_ += size_t(scene.data[missing.volume]->times.steps());
  }
  if (jobs_.empty() || !options_.open_context) {
    done_ = true;
    return;
  }
  worker_ = std::jthread([this](std::stop_token stop) { run(stop); });
}

LiveMotion::~LiveMotion() {
  cancel();
}

void LiveMotion::cancel() {
  worker_.request_stop();
  if (worker_.joinable()) worker_.join();
}

void LiveMotion::wait() {
  if (worker_.joinable()) worker_.join();
}

bool LiveMotion::finds_whole() const {
  return std::any_of(jobs_.begin(), jobs_.end(), [](const Job& job) { return job.whole; });
}

LiveMotion::Progress LiveMotion::progress() const {
  Progress now{steps_, known_, moves_after_s_, seconds_, -1.0};
  const double share = share_, elapsed_s = 1e-9 * double(monotonic_ns() - start_ns_);
  // Earlier than this the time left can not be estimated.
  if (!done_ && start_ns_ > 0 && share > 0.02 && elapsed_s > 0.5)
    now.left_s = elapsed_s * (1.0 - share) / share;
  return now;
}

std::string LiveMotion::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void LiveMotion::run(std::stop_token stop) {
  give_way(BackgroundWork::kFirstMotion);
  const auto start = std::chrono::steady_clock::now();
  const Status status = caught([&]() -> Status {
    for (Job& job : jobs_) {
      if (const Status done = estimate(job, stop); !done) return done.error();
      // The scene may contain one frame only: release the others.
      job.missing = {};
      job.volume.reset();
    }
    return Nothing{};
  });
  if (!status)
    note_trouble(status);
  else
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  done_ = true;
  if (stop.stop_requested()) return;
  note_trouble(caught([&]() -> Status {
    listener_.on_change(*this);
    return Nothing{};
  }));
}

/// Work that takes long gives way to a loop that has no priority. A driver's threads keep the
/// niceness with which they were started, so the device is opened again.
Result<std::shared_ptr<vulkan::Context>> LiveMotion::gives_way(
    std::shared_ptr<vulkan::Context> context) {
  if (options_.loop_has_priority) return context;
  give_way(BackgroundWork::kEstimation);
  return context->is_cpu() ? options_.open_context() : context;
}

/// Keeps the first error.
void LiveMotion::note_trouble(const Status& status) {
  const std::lock_guard lock(mutex_);
  if (!status && trouble_.empty()) trouble_ = status.error().message;
}

Status LiveMotion::estimate(const Job& job, std::stop_token stop) {
  auto frames = job.missing.open();
  if (!frames) return frames.error();
  auto context = options_.open_context();
  if (!context) return context.error();
  const auto preset = motion_preset(options_.preset);
  if (!preset) return Error{ErrorKind::kBadInput, "There is no preset '" + options_.preset + "'"};
  EstimatorOptions options;
  options.motion = *preset;
  options.cyclic = job.cyclic;
  start_ns_ = monotonic_ns();
  // Each frame is read more than once, so all must fit in memory.
  const double bytes = double(frames->count) * double(frames->grid.count()) * sizeof(float);
  const Status fits =
      frames->in_memory ? Nothing{} : check_fits_memory("One motion for the whole sequence", bytes);
  if (job.whole && fits) return whole(job, *frames, *context, options, stop);
  if (job.missing.own && !fits) return fits;
  context = gives_way(std::move(*context));
  if (!context) return context.error();
  const Status done = step_by_step(job, *frames, *context, options, stop);
  return done && job.whole && !stop.stop_requested() ? fits : done;
}

Status LiveMotion::take_pair(const Job& job, const PairMotion& pair) {
  Status taken = Nothing{};
  if (!job.missing.own && coarse_ == 0)
    taken = listener_.on_step(job.missing.volume, pair.fixed_frame,
                              MotionMap::of(pair.field, &pair.confidence));
  if (known_ + 1 == steps_ && coarse_ == 0)
    moves_after_s_ = 1e-9 * double(monotonic_ns() - start_ns_);
  ++known_;
  listener_.on_change(*this);
  return taken;
}

/// Estimates the fields of consecutive frames only.
Status LiveMotion::step_by_step(const Job& job, Frames& frames,
                                const std::shared_ptr<vulkan::Context>& context,
                                const EstimatorOptions& options, std::stop_token stop) {
  Status taken = Nothing{};
  EstimatorOptions of_steps = options;
  of_steps.motion = on_solved_cells(of_steps.motion);
  auto estimator = SequenceEstimator::open(
      context, frames.grid, of_steps,
      [&](PairMotion pair) {
        if (taken) taken = take_pair(job, pair);
      },
      [&](size_t, size_t, double share) { share_ = (double(known_) + share) / double(steps_); });
  if (!estimator) return estimator.error();
  const std::stop_callback on_stop(stop, [&] { (*estimator)->cancel(); });
  for (size_t k = 0; k < frames.count && !stop.stop_requested(); ++k) {
    auto frame = frames.read(k);
    if (!frame) {
      (*estimator)->cancel();
      return frame.error();
    }
    if (!(*estimator)->push(k, *frame)) break;
  }
  const Status finished = (*estimator)->finish();
  if (stop.stop_requested()) return Nothing{};
  return taken ? finished : taken;
}

/// A coarse motion of the whole sequence, handed over at once. False if there is none that can be
/// felt: then the volume waits for the careful one.
Result<bool> LiveMotion::coarse(const Job& job, const Grid& grid, const FrameReader& read,
                                const std::shared_ptr<vulkan::Context>& context,
                                std::stop_token stop) {
  const auto motion = estimate_coarse_motion(
      context, grid, job.volume->times.times_s, read, job.cyclic, job.felt_frame(),
      [&](const std::string&, double share) { share_ = share; }, stop);
  share_ = 0.0;
  if (!motion || stop.stop_requested()) return false;
  auto volume = carried(*job.volume, *motion, job.values);
  if (!volume || volume->whole->may_fold()) return false;
  const Status taken = listener_.on_whole(job.missing.volume,
                                          std::make_shared<const MovingVolume>(std::move(*volume)));
  if (!taken) return taken.error();
  if (++coarse_ == jobs_.size()) moves_after_s_ = 1e-9 * double(monotonic_ns() - start_ns_);
  start_ns_ = monotonic_ns();  // of what is left
  listener_.on_change(*this);
  return true;
}

/// Estimates a coarse motion first, then the pairs, and then one motion for the whole sequence.
Status LiveMotion::whole(const Job& job, Frames& frames, std::shared_ptr<vulkan::Context> context,
                         const EstimatorOptions& options, std::stop_token stop) {
  std::vector<Volume> kept;
  for (size_t k = 0; !frames.in_memory && k < frames.count && !stop.stop_requested(); ++k) {
    auto frame = frames.read(k);
    if (!frame) return frame.error();
    kept.push_back(std::move(*frame));
  }
  const FrameReader again = [&kept](size_t k) -> Result<Volume> { return kept[k]; };
  const FrameReader& read = frames.in_memory ? frames.read : again;
  if (stop.stop_requested()) return Nothing{};
  const auto has_coarse = coarse(job, frames.grid, read, context, stop);
  if (!has_coarse) return has_coarse.error();
  if (stop.stop_requested()) return Nothing{};
  auto opened = gives_way(std::move(context));
  if (!opened) return opened.error();
  context = std::move(*opened);
  Status taken = Nothing{};
  SequenceMotionOptions of_sequence;
  of_sequence.estimator = options;
  SequenceReport report;
  auto motion = estimate_sequence_motion(
      context, frames.grid, job.volume->times.times_s, read, of_sequence,
      [&](PairMotion pair) {
        if (taken) taken = take_pair(job, pair);
      },
      [&](const std::string&, double share) { share_ = share; }, stop, &report);
  if (stop.stop_requested()) return Nothing{};
  if (!taken) return taken;
  if (!motion) return motion.error();
  for (const std::string& note : report.notes) listener_.on_note(note);
  // Described from the frame that is felt, so that the hand stays on its material.
  if (*has_coarse && job.values == CarriedValues::kReference) {
    SequenceMotion from_felt = *motion;
    from_felt.reference = job.felt_frame();
    from_felt = told_from_reference(from_felt);
    if (auto volume = carried(*job.volume, from_felt, job.values);
        volume && !volume->whole->may_fold())
      return listener_.on_whole(job.missing.volume,
                                std::make_shared<const MovingVolume>(std::move(*volume)));
  }
  auto volume = carried(*job.volume, *motion, job.values);
  if (!volume) return volume.error();
  return listener_.on_whole(job.missing.volume,
                            std::make_shared<const MovingVolume>(std::move(*volume)));
}

}  // namespace palpate
