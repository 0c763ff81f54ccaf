#include "module/session/live_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/monotonic.h"
#include "module/haptics/servo/real_time.h"
#include "module/scene/make_volume.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;

constexpr auto kTooLong = 60s;  // longest estimation of a pair
// share of the way between two frames within which the target counts as reached
constexpr double kThere = 0.02;
constexpr double kMostHistory_bytes = 512e6;  // for frames that may turn out to be a cycle
constexpr auto kSilence = 2s;                 // without a frame this long a note is sent
// share of the cycle's contrast: a larger difference is no frame of the cycle
constexpr double kUnlike = 0.5;
// share of the cycle's contrast within which two matches count as equal
constexpr double kAsLike = 0.15;
constexpr double kOutOfStep = 0.2;  // share of the cycle
constexpr double kPace = 2.0, kMostPace = 0.5;

}  // namespace

Sequence LiveSequence::standing(const Volume& first) {
  Sequence sequence;
  sequence.name = "live frames";
  for (size_t s = 0; s < kSlots; ++s) {
    sequence.frames.push_back(first);
    sequence.times_s.push_back(double(s) * kSlot_s);
  }
  sequence.times_known = true;
  return sequence;
}

void LiveSequence::prepare(LoadedScene& scene, size_t volume) {
  std::erase_if(scene.missing,
                [&](const MissingMotion& missing) { return missing.volume == volume; });
  MovingVolume ring = *scene.data[volume];
  for (auto& frame : ring.frames) frame = ring.frames.front();
  ring.motions = {
      {"data", std::vector<std::shared_ptr<const MotionMap>>(size_t(ring.times.steps()))}};
  scene.data[volume] = std::make_shared<const MovingVolume>(std::move(ring));
  scene.spec.volumes[volume].rate = 0.0;
}

LiveSequence::LiveSequence(Session& session, size_t volume, const Volume& first,
                           LiveSequenceOptions options)
    : session_(session),
      index_(volume),
      grid_(first.grid),
      options_(std::move(options)),
      ring_(*session.scene()->volumes[volume].data),
      felt_(first) {
  watch_ = std::make_unique<Background>(5ms, [this] { watch(); });
  worker_ = std::jthread([this](std::stop_token stop) { run(stop); });
}

LiveSequence::~LiveSequence() {
  stop_cycle_.request_stop();
  worker_.request_stop();
  if (worker_.joinable()) worker_.join();
  watch_.reset();
}

/// An exception of the listener is dropped: there is nowhere to report it.
void LiveSequence::say(const std::string& sentence) const {
  if (!options_.on_note) return;
  (void)caught([&]() -> Status {
    options_.on_note(sentence);
    return Nothing{};
  });
}

LiveNumbers LiveSequence::numbers() const {
  const std::lock_guard lock(mutex_);
  LiveNumbers now = numbers_;
  now.delay_median_s = 1e-9 * double(delays_.quantile_ns(0.5));
  now.delay_p95_s = 1e-9 * double(delays_.quantile_ns(0.95));
  now.delay_most_s = 1e-9 * double(delays_.most_ns());
  return now;
}

void LiveSequence::push(const Volume& frame, int64_t arrived_ns) {
  const Status taken = caught([&]() -> Status {
    take(frame, arrived_ns);
    return Nothing{};
  });
  if (!taken) say("A frame could not be taken: " + taken.error().message);
}

void LiveSequence::take(const Volume& frame, int64_t arrived_ns) {
  RingFrame taken{{}, arrived_ns};
  if (same_geometry(frame.grid, grid_)) {
    taken.volume = frame;
    taken.volume.grid = grid_;
  } else if (has_centre_inside(grid_, frame.grid)) {
    taken.volume = resampled(frame, grid_);
  }
  bool first_elsewhere = false;
  {
    const std::lock_guard lock(mutex_);
    ++numbers_.received;
    if (taken.volume.values.empty()) first_elsewhere = ++numbers_.elsewhere == 1;
  }
  if (first_elsewhere)
    say("A frame lies elsewhere in space than the first one, and was left out: such frames are not "
        "felt.");
  if (taken.volume.values.empty()) return;
  if (options_.keep_cycles && searching_) look_for_cycle(taken.volume, arrived_ns);
  const std::lock_guard lock(mutex_);
  if (newest_ && numbers_.cycle_s == 0.0) ++numbers_.newer_came;
  newest_ = std::move(taken);
  changed_.notify_all();
}

/// On push()'s thread: the latest frames are kept, and become a cycle if they repeat.
void LiveSequence::look_for_cycle(const Volume& frame, int64_t arrived_ns) {
  history_.push_back({frame, arrived_ns});
  const double bytes = double(frame.values.size()) * sizeof(float);
  const size_t most =
      std::clamp<size_t>(size_t(kMostHistory_bytes / bytes), 1, size_t(Repetition::kMostFrames));
  while (history_.size() > most) history_.pop_front();
  const std::optional<int> period = repetition_.add(frame);
  if (!period || size_t(*period) + 1 > history_.size()) return;
  // One frame more, at which the cycle closes.
  const std::vector<RingFrame> frames(history_.end() - *period - 1, history_.end());
  searching_ = false;
  const std::lock_guard lock(mutex_);
  cycle_ = std::async(std::launch::async, [this, frames, means = repetition_.last(*period + 1),
                                           contrast = repetition_.contrast()] {
    give_way(BackgroundWork::kEstimation);
    return caught([&] { return find_cycle(frames, means, contrast); });
  });
  changed_.notify_all();
  history_.clear();
  repetition_.clear();
}

Result<LiveSequence::Cycle> LiveSequence::find_cycle(std::vector<RingFrame> frames,
                                                     std::vector<std::vector<float>> means,
                                                     double contrast) {
  // The frames of one cycle, without the first of the next; their times are evenly spaced.
  Cycle cycle;
  cycle.contrast = contrast;
  cycle.cycle_s = 1e-9 * double(frames.back().arrived_ns - frames.front().arrived_ns);
  frames.pop_back();
  means.pop_back();
  cycle.means = std::move(means);
  Sequence sequence;
  sequence.name = "live cycle";
  sequence.times_known = true;
  const double step_s = cycle.cycle_s / double(frames.size());
  // Evenly spaced: the jitter of the network is not that of the source.
  for (size_t k = 0; k < frames.size(); ++k) {
    sequence.times_s.push_back(double(k) * step_s);
    sequence.frames.push_back(std::move(frames[k].volume));
  }

  // One motion for all of them, and the volume that it carries.
  const auto motion = motion_of(sequence.times_s, sequence.frames, {}, stop_cycle_.get_token());
  if (!motion) return motion.error();
  cycle.times_s = sequence.times_s;
  cycle.frames = sequence.frames;
  cycle.reference = motion->reference;
  VolumeSpec spec;
  spec.name = ring_.name;
  VolumeData data;
  data.frames = std::move(sequence);
  const auto own = build(spec, std::move(data));
  if (!own) return own.error();
  auto carried_volume = carried(*own, *motion);
  if (!carried_volume) return carried_volume.error();
  cycle.volume = std::make_shared<const MovingVolume>(std::move(*carried_volume));
  return cycle;
}

Result<SequenceMotion> LiveSequence::motion_of(const std::vector<double>& times_s,
                                               const std::vector<Volume>& frames,
                                               SequenceMotionOptions options,
                                               std::stop_token stop) {
  const auto context = options_.open_context();
  if (!context) return context.error();
  const auto preset = motion_preset(options_.preset);
  if (!preset) return Error{ErrorKind::kBadInput, "There is no preset '" + options_.preset + "'"};
  options.estimator.motion = *preset;
  options.estimator.cyclic = true;
  return estimate_sequence_motion(
      *context, grid_, times_s, [&](size_t k) -> Result<Volume> { return frames[k]; }, options, {},
      {}, stop);
}

/// Takes a frame of a further cycle. When there is one of each, the motion is estimated again from
/// the means of all cycles, on another thread. The values that are felt stay the same: only the
/// motion changes.
void LiveSequence::take_further(Cycle& cycle, Further& further, size_t frame, Volume volume,
                                std::stop_token stop) {
  // A motion from more cycles is being estimated, or is there: the loop gets it.
  if (further.motion.valid()) {
    if (further.motion.wait_for(0s) != std::future_status::ready) return;
    const Result<SequenceMotion> motion = further.motion.get();
    if (!motion || motion->basis.cycle_s == 0.0) return;  // the present motion stays
    MovingVolume better = *cycle.volume;
    better.whole = SequenceMap::of(*motion);
    if (better.whole->may_fold() && !cycle.volume->whole->may_fold()) return;
    cycle.volume = std::make_shared<const MovingVolume>(std::move(better));
    hand_over(cycle.volume, stop);
    const std::lock_guard lock(mutex_);
    numbers_.cycles = further.cycles;
    return;
  }
  if (further.cycles >= kMostCycles) return;
  further.frames.resize(cycle.frames.size());
  further.frames[frame] = std::move(volume);
  for (const Volume& of : further.frames)
    if (of.values.empty()) return;

  // There is one of each frame: into the means, and a motion from these.
  ++further.cycles;
  for (size_t k = 0; k < cycle.frames.size(); ++k)
    for (size_t v = 0; v < cycle.frames[k].values.size(); ++v)
      cycle.frames[k].values[v] +=
          (further.frames[k].values[v] - cycle.frames[k].values[v]) / float(further.cycles);
  further.frames.clear();
  SequenceMotionOptions options;
  options.reference = cycle.reference;
  further.motion =
      std::async(std::launch::async, [this, options, &cycle, end = further.stop.get_token()] {
        // No other thread uses its times and frames until this has ended.
        give_way(BackgroundWork::kEstimation);
        return caught([&] { return motion_of(cycle.times_s, cycle.frames, options, end); });
      });
}

void LiveSequence::watch() {
  SceneSnapshot snapshot;
  if (!session_.newest(SnapshotReader::kLive, snapshot)) return;
  if (int(index_) >= snapshot.volume_count) return;
  const std::lock_guard lock(mutex_);

  // How far the loop has got towards the newest frame.
  time_s_ = snapshot.volumes[index_].time_s;
  if (target_arrived_ns_ == 0) return;
  const double length_s = double(kSlots) * kSlot_s;
  double left_s = std::abs(target_s_ - time_s_);
  left_s = std::min(left_s, length_s - left_s);
  if (left_s > kThere * kSlot_s) return;
  ++numbers_.felt;
  delays_.add(monotonic_ns() - target_arrived_ns_);
  target_arrived_ns_ = 0;
  changed_.notify_all();
}

void LiveSequence::run(std::stop_token stop) {
  give_way(BackgroundWork::kEstimation);
  while (!stop.stop_requested()) {
    const Status done = caught([&]() -> Status {
      const auto context = options_.open_context();
      return context ? follow(*context, stop) : Status(context.error());
    });
    if (done || stop.stop_requested()) continue;
    say("The motion of the live frames can not be estimated, so what is felt stands still; it is "
        "tried again: " +
        done.error().message);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, 2s, [] { return false; });
  }
}

/// Waits for the newest frame; false if stopped, or (or_cycle) if a cycle was found. Without frames
/// nothing moves.
bool LiveSequence::wait_for_frame(RingFrame& frame, std::stop_token stop, bool or_cycle) {
  const auto since = std::chrono::steady_clock::now();
  bool silent = false;
  std::unique_lock lock(mutex_);
  const auto cycle_is_ready = [&] {
    return or_cycle && cycle_.valid() &&
           cycle_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  while (!stop.stop_requested() && !cycle_is_ready()) {
    if (newest_) {
      frame = std::move(*newest_);
      newest_.reset();
      return true;
    }
    changed_.wait_for(lock, stop, 100ms, [&] { return newest_.has_value(); });
    if (silent || newest_ || std::chrono::steady_clock::now() - since < kSilence) continue;
    silent = true;
    lock.unlock();
    session_.send({ControlEvent::Kind::kRate, int(index_), 0.0});
    say("No frame has come for 2 s: what is felt stands still until the next one.");
    lock.lock();
  }
  return false;
}

/// The motion of the pair that is estimated; none after a stop, or if it takes too long.
std::optional<PairMotion> LiveSequence::wait_for_pair(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, kTooLong, [&] { return pair_.has_value(); });
  std::optional<PairMotion> pair = std::move(pair_);
  pair_.reset();
  return pair;
}

/// Follows frame after frame until a cycle is found; then plays the cycle until the frames no
/// longer repeat.
Status LiveSequence::follow(const std::shared_ptr<vulkan::Context>& context, std::stop_token stop) {
  const auto preset = motion_preset(options_.preset);
  if (!preset) return Error{ErrorKind::kBadInput, "There is no preset '" + options_.preset + "'"};
  EstimatorOptions options;
  options.motion = without_sliding_step(*preset);
  auto estimator = SequenceEstimator::open(context, grid_, options, [this](PairMotion pair) {
    const std::lock_guard lock(mutex_);
    pair_ = std::move(pair);
    changed_.notify_all();
  });
  if (!estimator) return estimator.error();
  size_t pushed = 0;
  RingFrame frame;

  // Frame after frame; the first motion begins at the present frame.
  if (const Status begun = (*estimator)->push(pushed++, felt_); !begun) return begun;
  while (wait_for_frame(frame, stop, true)) {
    if (const Status taken = (*estimator)->push(pushed++, frame.volume); !taken) return taken;
    const std::optional<PairMotion> pair = wait_for_pair(stop);
    if (stop.stop_requested()) break;
    if (!pair) {
      (*estimator)->cancel();
      const Status why = (*estimator)->finish();
      return why || why.error().kind == ErrorKind::kCancelled
                 ? Status(Error{ErrorKind::kDeviceFailed, "the motion of a pair took too long"})
                 : why;
    }
    move_to(std::move(frame.volume), frame.arrived_ns, *pair, stop);
  }
  if (stop.stop_requested()) return Nothing{};

  // The frames repeat: the cycle plays until they no longer do.
  std::future<Result<Cycle>> found;
  {
    const std::lock_guard lock(mutex_);
    found = std::move(cycle_);
  }
  Result<Cycle> cycle = found.get();
  if (!cycle) {
    say("The frames repeat, but one motion for them could not be found, so each is followed: " +
        cycle.error().message);
    return Nothing{};  // searching_ stays false: it would fail again
  }
  const Status kept = caught([&]() -> Status {
    keep(*cycle, stop);
    return Nothing{};
  });
  if (!kept) {
    // The next motion begins from the ring, so the present frame must be in it.
    stand_at(cycle->frames[size_t(cycle->reference)], stop);
    const std::lock_guard lock(mutex_);
    numbers_.cycle_s = 0.0;
    numbers_.cycles = 0;
    return kept;
  }
  searching_ = true;
  return Nothing{};
}

/// Hands a volume to the loop and waits until what is sent next acts on it.
void LiveSequence::hand_over(std::shared_ptr<const MovingVolume> volume, std::stop_token stop) {
  if (const Status taken = session_.take_volume(index_, std::move(volume)); !taken)
    return say("A live frame could not be felt: " + taken.error().message);
  while (!session_.has_handed_over() && !stop.stop_requested()) std::this_thread::sleep_for(2ms);
}

void LiveSequence::move_to(Volume frame, int64_t arrived_ns, const PairMotion& pair,
                           std::stop_token stop) {
  auto map = MotionMap::of(pair.field, &pair.confidence);
  auto data = sampled_scalar(frame);
  {
    // The volume is still moving towards the frame before.
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return target_arrived_ns_ == 0; });
  }
  if (stop.stop_requested()) return;
  const size_t next = (slot_ + 1) % kSlots;
  ring_.frames[next] = std::move(data);
  ring_.motions[0].steps[slot_] = std::move(map);
  ring_.motions[0].steps[next] = nullptr;
  slot_ = next;
  felt_ = std::move(frame);
  hand_over(std::make_shared<const MovingVolume>(ring_), stop);
  {
    const std::lock_guard lock(mutex_);
    target_s_ = double(next) * kSlot_s;
    target_arrived_ns_ = arrived_ns;
  }
  session_.send({ControlEvent::Kind::kScrub, int(index_), double(next) * kSlot_s});
}

/// Fills all slots of the ring with one frame, replacing their contents.
void LiveSequence::stand_at(const Volume& frame, std::stop_token stop) {
  const auto data = sampled_scalar(frame);
  for (auto& of : ring_.frames) of = data;
  for (auto& step : ring_.motions[0].steps) step = nullptr;
  slot_ = 0;
  felt_ = frame;
  session_.send({ControlEvent::Kind::kRate, int(index_), 0.0});
  hand_over(std::make_shared<const MovingVolume>(ring_), stop);
  session_.send({ControlEvent::Kind::kScrub, int(index_), 0.0});
}

/// The loop gets the cycle, once it has reached the last frame.
void LiveSequence::begin_cycle(const Cycle& cycle, std::stop_token stop) {
  {
    // A caller that waits for the last frame would otherwise wait for ever.
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return target_arrived_ns_ == 0; });
    numbers_.cycle_s = cycle.cycle_s;
    numbers_.cycles = 1;
  }

  hand_over(cycle.volume, stop);
  say(fmt::format(
      "The frames repeat every {:.2f} s: {} of them are kept, with one motion, and keep "
      "the pace of those that come.",
      cycle.cycle_s, cycle.means.size()));
}

/// Plays the cycle at the pace of the frames that still arrive.
void LiveSequence::keep(Cycle& cycle, std::stop_token stop) {
  begin_cycle(cycle, stop);
  const int frames = int(cycle.means.size());
  const double step_s = cycle.cycle_s / frames;
  RingFrame frame;
  Further further;
  bool begun = false;
  int odd = 0, last_frame = 0;
  int64_t last_ns = 0;
  while (wait_for_frame(frame, stop, false)) {
    double now_s = 0.0;
    {
      const std::lock_guard lock(mutex_);
      ++numbers_.kept;
      now_s = time_s_;
    }
    // A motion to and fro shows the same twice in a cycle: the last match decides which it is.
    const double since_s = 1e-9 * double(frame.arrived_ns - last_ns);
    const Repetition::NearestFrame match =
        begun ? Repetition::nearest(frame.volume, cycle.means, last_frame + since_s / step_s,
                                    kAsLike * cycle.contrast)
              : Repetition::nearest(frame.volume, cycle.means);
    last_frame = match.frame;
    last_ns = frame.arrived_ns;

    // The pace: the first frame sets the time, further ones correct the rate.
    const double wanted_s = double(match.frame) * step_s;
    if (!begun) {
      session_.send({ControlEvent::Kind::kScrub, int(index_), wanted_s});
      session_.send({ControlEvent::Kind::kRate, int(index_), 1.0});
      begun = true;
      continue;
    }
    const double cycles = (wanted_s - now_s) / cycle.cycle_s;
    const double behind = cycles - std::round(cycles);  // in cycles
    const double rate = 1.0 + std::clamp(kPace * behind, -kMostPace, kMostPace);
    session_.send({ControlEvent::Kind::kRate, int(index_), rate});

    // Frames that are like none, or come out of step, end the cycle once there are enough of them.
    const bool strange = match.distance > kUnlike * cycle.contrast || std::abs(behind) > kOutOfStep;
    odd = std::max(0, odd + (strange ? 1 : -1));
    if (!strange) take_further(cycle, further, size_t(match.frame), std::move(frame.volume), stop);
    if (odd <= frames / 2 + 2) continue;
    say("The frames no longer repeat: each is followed again.");
    stand_at(frame.volume, stop);
    break;
  }
  const std::lock_guard lock(mutex_);
  numbers_.cycle_s = 0.0;
  numbers_.cycles = 0;
}

}  // namespace palpate
