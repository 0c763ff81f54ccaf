#include "module/session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "compute/vulkan/caught.h"
#include "module/haptics/servo/monotonic.h"
#include "module/scene/drive.h"

namespace palpate {
namespace {

constexpr std::chrono::milliseconds kPosePause{16};  // as often as a display needs poses

}  // namespace

Session::Session(const SessionOptions& options, const DeviceInfo& device)
    : options_(options), ticker_(options.haptics, device) {
  ticker_.take_buttons(options.tube_buttons);
}

Result<std::unique_ptr<Session>> Session::start(const LoadedScene& scene, ForceDevice& device,
                                                SessionOptions options) {
  auto session = std::unique_ptr<Session>(new Session(options, device.info()));
  if (const Status begun = session->begin(scene); !begun) return begun.error();
  auto servo = Servo::start(device, session->ticker_, options.servo, options.clock);
  if (!servo) return servo.error();
  session->servo_ = std::move(*servo);
  session->begin_motion(scene);
  return session;
}

Result<std::unique_ptr<Session>> Session::start_in_host(const LoadedScene& scene,
                                                        const DeviceInfo& device,
                                                        SessionOptions options) {
  auto session = std::unique_ptr<Session>(new Session(options, device));
  if (const Status begun = session->begin(scene); !begun) return begun.error();
  session->host_ = std::make_unique<HostLoop>(session->ticker_, device, options.servo.loop,
                                              options.servo.listeners);
  session->begin_motion(scene);
  return session;
}

/// Assembles the scene for the first tick.
Status Session::begin(const LoadedScene& at_start) {
  SceneSpec spec = at_start.spec;
  std::vector<std::shared_ptr<const MovingVolume>> data = at_start.data;
  for (const VolumeSpec& volume : spec.volumes) {
    rates_.push_back(volume.rate);
    moved_.push_back(driven(volume.drive, volume.transform, 0.0));
  }
  // Steps of a motion that is still missing exist from the start, with zero motion.
  for (const MissingMotion& missing : at_start.missing) {
    missing_.push_back(missing.volume);
    spec.volumes[missing.volume].rate = 0.0;
    // A volume that waits for one motion for all frames has no steps.
    if (missing.own) continue;
    MovingVolume volume = *data[missing.volume];
    const size_t steps = size_t(volume.times.steps());
    volume.motions = {{"data", std::vector<std::shared_ptr<const MotionMap>>(steps)}};
    data[missing.volume] = std::make_shared<const MovingVolume>(volume);
  }
  start_ns_ = last_ns_ = monotonic_ns();
  const std::lock_guard lock(mutex_);
  return hand_over(plan(spec, std::move(data), at_start.kinds));
}

/// Starts what needs the loop: the threads that send poses, and the estimation of missing motion.
void Session::begin_motion(const LoadedScene& at_start) {
  // A volume that stands still as one of its frames stands at the time of that frame.
  for (const MissingMotion& missing : at_start.missing)
    if (missing.own)
      send({ControlEvent::Kind::kScrub, int(missing.volume),
            missing.own->times.times_s[missing.own->segments_frame]});
  const auto at_first = this->scene();
  const bool posed = std::any_of(at_first->volumes.begin(), at_first->volumes.end(),
                                 [](const SceneVolume& volume) { return volume.is_sent(); });
  poses_ = std::make_unique<Background>(kPosePause, [this, posed] {
    attempt([&] {
      if (posed && !options_.is_second) send_poses();
      const std::lock_guard lock(mutex_);
      if (waiting_) waiting_ = !ticker_.offer(scene_);
      ticker_.collect();
    });
  });
  // On another thread: following a line may take longer than poses can wait.
  commands_ =
      std::make_unique<Background>(kPosePause, [this] { attempt([this] { take_commands(); }); });
  can_play_ = at_start.missing.empty();
  LiveMotionListener listener;
  listener.on_step = [this](size_t volume, size_t step, std::shared_ptr<const MotionMap> map) {
    return take_motion(volume, step, std::move(map));
  };
  listener.on_whole = [this](size_t volume, std::shared_ptr<const MovingVolume> data) {
    return take_volume(volume, std::move(data));
  };
  listener.on_note = [this](const std::string& note) { tell(SessionEvent::Kind::kNote, note); };
  listener.on_change = [this](const LiveMotion& motion) { on_motion(motion); };
  options_.motion.loop_has_priority = report().has_priority;
  motion_ = std::make_unique<LiveMotion>(at_start, options_.motion, std::move(listener));
}

Session::~Session() {
  stop();
}

void Session::stop() {
  const std::lock_guard lock(stopping_);
  // The force first: an estimation ends only when the device has done what it was given.
  if (motion_) motion_->request_stop();
  if (servo_) servo_->stop();
  if (host_) host_->stop();
  if (options_.second) options_.second->stop();
  poses_.reset();
  if (motion_) motion_->cancel();
  commands_.reset();  // takes the commands up to now
}

bool Session::at_rest() const noexcept {
  return servo_ ? servo_->at_rest() : host_ && host_->at_rest();
}

void Session::tell(SessionEvent::Kind kind, const std::string& sentence) const {
  if (!options_.on_event) return;
  (void)caught([&]() -> Status {
    options_.on_event({kind, sentence});
    return Nothing{};
  });
}

/// Runs a thread's work. After an exception the thread goes on, since the next call may succeed;
/// the first one is reported.
void Session::attempt(const std::function<void()>& work) {
  const Status done = caught([&]() -> Status {
    work();
    return Nothing{};
  });
  if (!done && !told_failure_.exchange(true))
    tell(SessionEvent::Kind::kNote,
         "Poses and stream tubes of the session may be late: " + done.error().message);
}

/// Reports failures that the haptic loop can not report itself: a mode that threw, or the host's
/// device.
void Session::say_what_failed(const Scene& felt) {
  for (const SceneMode& mode : felt.modes) {
    const auto* const foreign = dynamic_cast<const ForeignMode*>(mode.mode.get());
    if (!foreign || !*foreign->failure()) continue;
    if (std::find(failed_modes_.begin(), failed_modes_.end(), mode.mode) != failed_modes_.end())
      continue;
    failed_modes_.push_back(mode.mode);
    tell(SessionEvent::Kind::kNote, foreign->failure());
  }
  if (!options_.next_note) return;
  if (const std::string note = options_.next_note(); !note.empty())
    tell(SessionEvent::Kind::kNote, note);
}

/// Called on the estimation's thread, after each step and at its end.
void Session::on_motion(const LiveMotion& motion) {
  using Kind = SessionEvent::Kind;
  const LiveMotion::Progress now = motion.progress();
  const bool all_steps = now.steps_known == now.steps;
  if (!can_play_ && motion.can_move()) {
    can_play_ = true;
    if (!all_steps && !motion.has_coarse())
      tell(Kind::kMotionFailed,
           "The motion could not be estimated, so one frame is felt: " + motion.trouble());
    else if (motion.has_coarse())
      tell(Kind::kMoves,
           fmt::format("coarse, known after {:.1f} s; now it moves, and is refined meanwhile",
                       now.moves_after_s));
    else if (!motion.needs_whole())
      tell(Kind::kMoves, fmt::format("{} steps known after {:.1f} s; now it moves", now.steps,
                                     now.moves_after_s));
    if ((all_steps || motion.has_coarse()) && playing_)
      for (const size_t volume : missing_)
        send({ControlEvent::Kind::kRate, int(volume), rates_[volume]});
  }
  if (!motion.is_done() || !motion.finds_whole() || !(all_steps || motion.has_coarse())) return;
  if (!motion.trouble().empty())
    tell(Kind::kMotionFailed,
         fmt::format("One motion for the whole sequence could not be found, so {}: {}",
                     motion.has_coarse()    ? "the coarse one goes on"
                     : motion.needs_whole() ? "one frame is felt"
                                            : "the steps go on",
                     motion.trouble()));
  else
    tell(Kind::kWholeMotion,
         fmt::format("one for the whole sequence after {:.1f} s; from now on one frame's material "
                     "is felt and seen",
                     now.seconds));
}

/// Call with mutex_ locked.
Status Session::hand_over(Result<std::shared_ptr<const Scene>> scene) {
  if (!scene) return scene.error();
  scene_ = std::move(*scene);
  waiting_ = !ticker_.offer(scene_);
  return Nothing{};
}

Status Session::take_motion(size_t volume, size_t step, std::shared_ptr<const MotionMap> map) {
  if (options_.second)
    if (const Status taken = options_.second->take_motion(volume, step, map); !taken) return taken;
  const std::lock_guard lock(mutex_);
  MovingVolume known = *scene_->volumes[volume].data;
  if (known.motions.empty() || step >= known.motions[0].steps.size()) return Nothing{};
  known.motions[0].steps[step] = std::move(map);
  return hand_over(
      with_data(*scene_, volume, std::make_shared<const MovingVolume>(std::move(known))));
}

Status Session::take_volume(size_t volume, std::shared_ptr<const MovingVolume> data) {
  if (options_.second)
    if (const Status taken = options_.second->take_volume(volume, data); !taken) return taken;
  const std::lock_guard lock(mutex_);
  // A better motion of the same material: the hand goes over to it without leaving its place.
  const MovingVolume& felt = *scene_->volumes[volume].data;
  if (can_blend(felt, *data)) {
    MovingVolume better = *data;
    better.whole_before = felt.whole;
    data = std::make_shared<const MovingVolume>(std::move(better));
  }
  return hand_over(with_data(*scene_, volume, std::move(data)));
}

bool Session::has_handed_over() const {
  const std::lock_guard lock(mutex_);
  return !waiting_;
}

bool Session::send(const ControlEvent& event) {
  // Stream tubes are the first hand's.
  if (options_.second && !command_of(event)) options_.second->send(event);
  const std::lock_guard lock(mutex_);
  return servo_ ? servo_->send(event) : host_ && host_->send(event);
}

bool Session::send(const ControlEvent& first, const ControlEvent& second) {
  if (options_.second) options_.second->send(first, second);
  const std::lock_guard lock(mutex_);
  return servo_ ? servo_->send(first, second) : host_ && host_->send(first, second);
}

/// Call with mutex_ locked.
bool Session::push(const PoseUpdate& pose) {
  if (options_.second) options_.second->follow(pose);
  return servo_ ? servo_->send(pose) : host_ && host_->send(pose);
}

/// A pose that the session of the first hand has sent.
void Session::follow(const PoseUpdate& pose) {
  const std::lock_guard lock(mutex_);
  push(pose);
}

bool Session::newest(SnapshotReader who, SceneSnapshot& snapshot) {
  const bool is_new = ticker_.newest(int(who), snapshot);
  SceneSnapshot of_second;
  if (!options_.second) return is_new;
  const bool second_is_new = options_.second->newest(who, of_second);
  snapshot.has_second = of_second.now_ns != 0;
  snapshot.second = {of_second.probe_m, of_second.proxy_m,    of_second.shaft,
                     of_second.force_n, of_second.in_contact, of_second.points};
  return is_new || second_is_new;
}

bool Session::newest(int reader, TickOutput& output) noexcept {
  return servo_ ? servo_->newest(reader, output) : host_->newest(reader, output);
}

const ServoStatistics& Session::statistics() const noexcept {
  return servo_ ? servo_->statistics() : host_->statistics();
}

const ServoReport& Session::report() const {
  static const ServoReport none;
  return servo_ ? servo_->report() : none;
}

void Session::toggle_play() {
  play(!playing_);
}

void Session::play(bool on) {
  if (!can_play_) return;
  playing_ = on;
  if (on) {
    const std::lock_guard lock(mutex_);
    scrubbed_s_.clear();
  }
  const auto felt = scene();
  for (size_t v = 0; v < felt->volumes.size(); ++v)
    if (!felt->volumes[v].is_still())
      send({ControlEvent::Kind::kRate, int(v), on ? rates_[v] : 0.0});
}

void Session::scrub(const SceneSnapshot& snapshot, double share) {
  if (!can_play_) return;
  play(false);
  const auto felt = scene();
  std::vector<std::pair<int, double>> wanted;
  {
    const std::lock_guard lock(mutex_);
    for (size_t v = scrubbed_s_.size(); v < size_t(snapshot.volume_count); ++v)
      scrubbed_s_.push_back(snapshot.volumes[v].time_s);
    for (int v = 0; v < std::min(int(felt->volumes.size()), snapshot.volume_count); ++v) {
      const MovingVolume& volume = *felt->volumes[size_t(v)].data;
      if (volume.is_still()) continue;
      const double length_s = volume.times.length_s();
      double& to_s = scrubbed_s_[size_t(v)];
      to_s += share * length_s;
      if (volume.times.cyclic())
        to_s -= length_s * std::floor(to_s / length_s);
      else
        to_s = std::clamp(to_s, 0.0, length_s);
      wanted.emplace_back(v, to_s);
    }
  }
  for (const auto& [volume, to_s] : wanted) send({ControlEvent::Kind::kScrub, volume, to_s});
}

void Session::scrub_to(double share) {
  if (!can_play_) return;
  play(false);
  const auto felt = scene();
  std::vector<double> to_s(felt->volumes.size(), 0.0);
  for (size_t v = 0; v < felt->volumes.size(); ++v) {
    const MovingVolume& volume = *felt->volumes[v].data;
    if (volume.is_still()) continue;
    to_s[v] = share * volume.times.length_s();
    send({ControlEvent::Kind::kScrub, int(v), to_s[v]});
  }
  const std::lock_guard lock(mutex_);
  scrubbed_s_ = std::move(to_s);
}

std::shared_ptr<const Scene> Session::scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

void Session::drag(const Transform& moved) {
  const std::lock_guard lock(mutex_);
  const int64_t now_ns = monotonic_ns();
  for (size_t v = 0; v < scene_->volumes.size(); ++v) {
    if (scene_->volumes[v].spec.drive.kind != DriveSpec::Kind::kSecondHand) continue;
    Transform& place = moved_[v];
    place.translation_m = moved.world_from_volume(place.translation_m);
    place.rotation = glm::normalize(moved.rotation * place.rotation);
    place.scale *= moved.scale.x;
    push(PoseUpdate{int(v), place, now_ns});
  }
}

bool Session::place(size_t volume, const Transform& world_from_volume) {
  const std::lock_guard lock(mutex_);
  if (volume >= moved_.size()) return false;
  moved_[volume] = world_from_volume;
  return push(PoseUpdate{int(volume), world_from_volume, monotonic_ns()});
}

std::shared_ptr<const ReleasedTubes> Session::tubes() const {
  const std::lock_guard lock(tubes_mutex_);
  return hand_tubes_.tubes();
}

/// Executes the stream tube commands since the last call, in the present scene.
void Session::take_commands() {
  const auto felt = scene();
  SceneSnapshot now;
  newest(SnapshotReader::kTubes, now);
  const auto say = [this](const std::string& sentence) {
    if (!sentence.empty()) tell(SessionEvent::Kind::kNote, sentence);
  };
  // On a copy, so that pictures need not wait while a tube is computed.
  HandTubes tubes;
  {
    const std::lock_guard lock(tubes_mutex_);
    tubes = hand_tubes_;
  }
  say(tubes.follow(*felt, now));
  HandCommand command;
  while (ticker_.next_command(command)) say(tubes.take(command, *felt));
  {
    const std::lock_guard lock(tubes_mutex_);
    hand_tubes_ = std::move(tubes);
  }
  say_what_failed(*felt);
}

void Session::send_poses() {
  const std::lock_guard lock(mutex_);
  const int64_t now_ns = monotonic_ns();
  const double dt_s = double(now_ns - last_ns_) * 1e-9;
  last_ns_ = now_ns;
  for (size_t v = 0; v < scene_->volumes.size(); ++v) {
    const SceneVolume& volume = scene_->volumes[v];
    if (!volume.is_sent()) continue;
    const VolumeSpec& spec = volume.spec;
    if (spec.drive.kind != DriveSpec::Kind::kSecondHand) {
      moved_[v] = driven(spec.drive, spec.transform, double(now_ns - start_ns_) * 1e-9);
    } else if (!options_.second_hand) {
      continue;  // there is no second hand: only drag() and place() move it
    } else {
      const FrameData& frame = *volume.data->frames.front();
      const glm::dvec3 middle = 0.5 * (frame.low_m() + frame.high_m());
      MoveLimits limits;
      limits.home_m = spec.transform.world_from_volume(middle);
      moved_[v] = palpate::moved(moved_[v], options_.second_hand->read(), dt_s, middle, limits);
    }
    push(PoseUpdate{int(v), moved_[v], now_ns});
  }
}

}  // namespace palpate
