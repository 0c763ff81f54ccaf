// Sessions, and force devices of the host.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integration/loading/tubes_file.h"
#include "integration/running/open_session.h"
#include "integration/toolkit/options.h"
#include "integration/toolkit/session_content.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::toolkit {
namespace {

/// The session whose callback is running on this thread; null: none.
thread_local const void* session_calling_back = nullptr;

DeviceFault fault_of(uint32_t fault) noexcept {
  switch (fault) {
    case PAL_FAULT_NONE:
      return DeviceFault::kNone;
    case PAL_FAULT_NOT_OPENED:
      return DeviceFault::kNotOpened;
    case PAL_FAULT_UNPLUGGED:
      return DeviceFault::kUnplugged;
    case PAL_FAULT_TIMEOUT:
      return DeviceFault::kTimeout;
    case PAL_FAULT_NOT_HOMED:
      return DeviceFault::kNotHomed;
    case PAL_FAULT_FORCE_OFF:
      return DeviceFault::kForceOff;
    default:
      return DeviceFault::kGarbage;
  }
}

GripReading grip_of(const PalGrip& given) noexcept {
  GripReading grip;
  grip.turns = (given.senses & PAL_GRIP_TURNS) != 0;
  const double(&q)[4] = given.device_from_grip;
  grip.device_from_grip = glm::dquat(q[0], q[1], q[2], q[3]);
  for (int a = 0; a < 3; ++a)
    grip.angular_velocity_rad_per_s[a] = given.angular_velocity_rad_per_s[a];
  grip.opens = (given.senses & PAL_GRIP_OPENS) != 0;
  grip.opening_rad = given.opening_rad;
  return believable(grip);
}

/// A force device of the host, as a ForceDevice of the servo loop.
class HostDevice final : public ForceDevice {
 public:
  HostDevice(const PalDevice& device, DeviceInfo info)
      : exchange_(device.exchange),
        grip_(device.grip),
        torque_(device.torque),
        user_(device.user),
        info_(std::move(info)) {}
  DeviceInfo info() const override { return info_; }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    PalReading given{};
    PalGrip grip{};
    grip.size = sizeof grip;
    const double force_n[3] = {command.force_n.x, command.force_n.y, command.force_n.z};
    const glm::dvec3 torque = command.torque_n_m;
    const double torque_n_m[3] = {torque.x, torque.y, torque.z};
    const void* const before = std::exchange(session_calling_back, session_);
    const Thrown thrown = call_host("exchange", [&] {
      if (torque_) torque_(user_, torque_n_m);
      exchange_(user_, force_n, &given);
      if (grip_) grip_(user_, &grip);
    });
    session_calling_back = before;
    if (thrown) {
      // After an exception no reading can be trusted: report a fault, whose ramp takes the force to
      // zero.
      given = {};
      grip = {};
      given.fault = PAL_FAULT_GARBAGE;
      if (!has_thrown_.exchange(true)) {
        thrown_ = thrown;
        is_told_.store(true, std::memory_order_release);
      }
    }
    DeviceReading reading;
    const glm::dvec3 x(given.position_m[0], given.position_m[1], given.position_m[2]);
    const bool finite = std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z);
    reading.fault = finite ? fault_of(given.fault) : DeviceFault::kGarbage;
    if (reading.fault == DeviceFault::kNone) last_m_ = x;
    reading.position_m = last_m_;
    reading.time_ns = given.time_ns ? given.time_ns : monotonic_ns();
    reading.buttons = given.buttons;
    reading.grip = grip_of(grip);
    reading.fresh = reading.fault == DeviceFault::kNone && given.is_fresh;
    return reading;
  }
  /// Sets the session whose servo loop calls exchange; call it before the loop runs.
  void belongs_to(const void* session) { session_ = session; }
  /// The first exception from exchange; empty if there was none. Any thread.
  Thrown thrown() const noexcept {
    return is_told_.load(std::memory_order_acquire) ? thrown_ : Thrown();
  }

 private:
  void (*exchange_)(void* user, const double force_n[3], PalReading* reading);
  void (*grip_)(void* user, PalGrip* grip);
  void (*torque_)(void* user, const double torque_n_m[3]);
  void* user_;
  DeviceInfo info_;
  const void* session_ = nullptr;
  glm::dvec3 last_m_{0.0};
  std::atomic<bool> has_thrown_{false}, is_told_{false};
  Thrown thrown_;
};

PalResult take_info(const PalDeviceInfo* given, DeviceInfo& info) {
  PalDeviceInfo host;
  if (const PalResult read =
          taken(given, offsetof(PalDeviceInfo, resolution_m), "PalDeviceInfo", host);
      read != PAL_OK)
    return read;
  info.kind = "host";
  info.name = host.name ? host.name : "host";
  info.max_force_n = host.max_force_n;
  info.continuous_force_n = host.continuous_force_n;
  info.max_torque_n_m = host.max_torque_n_m;
  info.max_stiffness_n_per_m = host.max_stiffness_n_per_m;
  info.workspace_radius_m = host.workspace_radius_m;
  info.resolution_m = host.resolution_m;
  info.delay_s = host.delay_s;
  info.buttons = 32;
  for (int a = 0; a < 3; ++a) info.workspace_centre_m[a] = host.workspace_centre_m[a];
  const auto usable = [](double number) { return std::isfinite(number) && number >= 0.0; };
  const glm::dvec3 centre = info.workspace_centre_m;
  if (!(info.max_force_n > 0.0) || !(info.workspace_radius_m > 0.0) || !usable(info.max_force_n) ||
      !usable(info.continuous_force_n) || !usable(info.max_torque_n_m) ||
      !usable(info.workspace_radius_m) || !usable(info.max_stiffness_n_per_m) ||
      !usable(info.resolution_m) || !usable(info.delay_s) ||
      !std::isfinite(centre.x + centre.y + centre.z))
    return failed(PAL_BAD_INPUT,
                  {"PalDeviceInfo: max_force_n and workspace_radius_m must be above 0, the other "
                   "numbers finite and not below 0"});
  return PAL_OK;
}

PalResult take_host_device(const PalDevice& given, const SessionContent& content,
                           std::unique_ptr<ForceDevice>& taken_device) {
  PalDevice host;
  if (const PalResult read = taken(&given, offsetof(PalDevice, user), "PalDevice", host);
      read != PAL_OK)
    return read;
  if (!host.exchange) return failed(PAL_BAD_INPUT, {"A PalDevice needs exchange"});
  DeviceInfo known;
  if (const PalResult read = take_info(host.info, known); read != PAL_OK) return read;
  if ((known.max_torque_n_m > 0.0) != (host.torque != nullptr))
    return failed(PAL_BAD_INPUT,
                  {"A PalDevice that gives a torque needs both max_torque_n_m and torque"});
  auto device = std::make_unique<HostDevice>(host, std::move(known));
  device->belongs_to(&content);
  taken_device = std::move(device);
  return PAL_OK;
}

/// What the host ticks with, or its device.
PalResult take_host(const PalSessionInfo& info, SessionContent& content,
                    running::SessionHost& host) {
  if (content.host_ticks) return take_info(info.host, host.ticks.emplace());
  return info.device ? take_host_device(*info.device, content, host.device) : PAL_OK;
}

/// The fields of the structure, as options; then the text of options.
Status take_options(const PalSessionInfo& info, running::SessionRequest& request) {
  constexpr uint32_t kFlags = PAL_SESSION_HOST_TICKS | PAL_SESSION_NO_ESTIMATION |
                              PAL_SESSION_NO_REAL_TIME | PAL_SESSION_DEAD_MAN | PAL_SESSION_FOLLOW;
  if (const Status checked = check_flags("PalSessionInfo", info.flags, kFlags); !checked)
    return checked;
  OptionTaker take(request);
  take.text("device", info.device_name);
  take.number("max_force_n", info.max_force_n);
  take.number("stiffness_n_per_m", info.stiffness_n_per_m);
  take.number("watchdog_s", info.watchdog_s);
  take.text("preset", info.preset);
  take.text("record", info.recording);
  take.number("tube_buttons", double(info.tube_buttons));
  take.text("csv", info.csv);
  take.text("black_box", info.black_box);
  take.number("serve", double(info.serve_port));
  take.text("path", info.simulated_path);
  take.text("hand", info.simulated_hand);
  take.number("lets_go_s", info.lets_go_s);
  take.text("tool", info.tool);
  take.flag("estimate", info.flags, PAL_SESSION_NO_ESTIMATION, false);
  take.flag("real_time", info.flags, PAL_SESSION_NO_REAL_TIME, false);
  take.flag("dead_man", info.flags, PAL_SESSION_DEAD_MAN, true);
  take.flag("follow", info.flags, PAL_SESSION_FOLLOW, true);
  take.all(info.options, running::OptionStage::kSession);
  return take.status();
}

/// Checks combinations of options that are not allowed.
PalResult check(const PalSessionInfo& info, const running::SessionRequest& request,
                const SceneContent& of_scene) {
  if ((info.flags & PAL_SESSION_HOST_TICKS) && (info.device || request.given.contains("device")))
    return failed(PAL_BAD_INPUT,
                  {"A host that ticks has the device itself: give PalSessionInfo.host alone"});
  if (!request.record.empty() && of_scene.live)
    return failed(PAL_BAD_INPUT, {"What comes from a live source is no part of a recording"});
  if (!request.record.empty() && !of_scene.scene.missing.empty())
    return failed(PAL_BAD_INPUT, {"The motion of the scene is not known, and what is found "
                                  "meanwhile is no part of a recording: give the motion"});
  if (of_scene.live && (!of_scene.context->device || !request.estimate))
    return failed(PAL_NO_DEVICE,
                  {"Live frames are followed by estimating their motion: open the context with a "
                   "device that computes, and the session with estimation"});
  return PAL_OK;
}

/// The host's functions, as the session calls them.
running::SessionCallbacks callbacks_of(const PalSessionInfo& info, const SceneContent& of_scene,
                                       const SessionContent* session,
                                       const std::shared_ptr<SessionNotes>& notes) {
  running::SessionCallbacks callbacks;
  if (of_scene.context->device)
    callbacks.open_context =
        [device = of_scene.context->device]() -> Result<std::shared_ptr<vulkan::Context>> {
      return device;
    };
  callbacks.on_note = [notes](running::NoteSource, const std::string& note) { notes->say(note); };
  if (info.on_event)
    callbacks.on_event = [on_event = info.on_event, user = info.user, session,
                          context = of_scene.context](const SessionEvent& event) {
      const void* const before = std::exchange(session_calling_back, session);
      const Thrown thrown = call_host(
          "on_event", [&] { on_event(user, PalEventKind(event.kind), event.sentence.c_str()); });
      session_calling_back = before;
      if (thrown) context->say(thrown.sentence());
    };
  return callbacks;
}
static_assert(int(SessionEvent::Kind::kNote) == PAL_EVENT_NOTE &&
              int(SessionEvent::Kind::kMoves) == PAL_EVENT_MOVES &&
              int(SessionEvent::Kind::kWholeMotion) == PAL_EVENT_WHOLE_MOTION &&
              int(SessionEvent::Kind::kMotionFailed) == PAL_EVENT_MOTION_FAILED);

PalResult open_session(PalScene* scene, const PalSessionInfo* given, PalSession** session) {
  const Use use(of(scene));
  if (!use) return refused_handle("scene");
  if (!session) return failed(PAL_BAD_INPUT, {"The argument that takes the session is NULL"});
  PalSessionInfo info;
  if (const PalResult read =
          taken(given, offsetof(PalSessionInfo, max_force_n), "PalSessionInfo", info);
      read != PAL_OK)
    return read;
  running::SessionRequest request = use->request;
  if (const Status options = take_options(info, request); !options) return failed(options.error());
  if (const PalResult checked = check(info, request, *use); checked != PAL_OK) return checked;

  auto content = std::make_shared<SessionContent>(use->context);
  content->host_ticks = (info.flags & PAL_SESSION_HOST_TICKS) != 0;
  running::SessionHost host;
  if (const PalResult device = take_host(info, *content, host); device != PAL_OK) return device;
  host.scene = use->scene;
  if (use->live) host.first_frame = use->live->first;
  if (!use->live || !use->live->is_server) request.inputs.clear();
  running::SessionCallbacks callbacks = callbacks_of(info, *use, content.get(), content->notes);
  callbacks.next_note = [notes = content->notes,
                         of_host = dynamic_cast<HostDevice*>(host.device.get()),
                         told = false]() mutable -> std::string {
    const Thrown thrown = of_host ? of_host->thrown() : Thrown();
    if (!thrown || std::exchange(told, true)) return notes->next();
    return fmt::format("The force goes to zero while the device gives no position: {}",
                       thrown.sentence());
  };
  LiveSequenceOptions live;
  if (!request.preset.empty()) live.preset = request.preset;
  live.open_context = callbacks.open_context;
  live.keep_cycles = !request.follow;
  live.on_note = [notes = content->notes](const std::string& note) { notes->say(note); };

  auto prepared = running::prepare_session(std::move(request), std::move(host),
                                           std::move(callbacks), content->connected);
  if (!prepared) return failed(prepared.error());
  // Whether memory is locked is up to the host.
  prepared->options.servo.real_time.lock_memory = false;
  if (const Status started = running::start_session(*prepared, content->connected); !started)
    return failed(started.error());
  if (use->live && !use->live->is_server) content->follow(use->live->first, std::move(live));
  *session = reinterpret_cast<PalSession*>(Handle<SessionContent>::make(std::move(content)));
  return PAL_OK;
}

/// Runs `work` with the session of a handle.
template <class Work>
PalResult with(const PalSession* session, const Work& work) noexcept {
  return guarded([&] {
    const Use use(of(session));
    return use ? work(*use) : refused_handle("session");
  });
}

constexpr const char* kTooMuchWaits =
    "Too many changes wait already: the haptic loop does not run, or try again later";

PalResult sent(SessionContent& of_session, const ControlEvent& event) {
  return of_session.session().send(event) ? PAL_OK : failed(PAL_NOT_YET, {kTooMuchWaits});
}

PalResult both_sent(SessionContent& of_session, const ControlEvent& first,
                    const ControlEvent& second) {
  return of_session.session().send(first, second) ? PAL_OK : failed(PAL_NOT_YET, {kTooMuchWaits});
}

void fill(PalState& state, SessionContent& of_session) {
  const auto [snapshot, tick] = of_session.snapshot_and_tick();
  const Session& session = of_session.session();
  const glm::dquat world_from_device = session.scene()->world_from_device.rotation;
  const auto in_world = [&](glm::dvec3 device_n, double(&world_n)[3]) {
    const glm::dvec3 n = world_from_device * device_n;
    for (int a = 0; a < 3; ++a) world_n[a] = n[a];
  };
  state.in_contact = snapshot.in_contact;
  state.time_ns = snapshot.now_ns;
  for (int a = 0; a < 3; ++a) {
    state.hand_m[a] = snapshot.probe_m[a];
    state.proxy_m[a] = snapshot.proxy_m[a];
    state.shaft[a] = snapshot.shaft[a];
  }
  in_world(tick.command.force_n, state.force_n);
  in_world(tick.command.torque_n_m, state.torque_n_m);
  const bool is_scene = snapshot.cause == Cause::kNone;
  state.cause = is_scene ? "" : word(snapshot.cause);
  state.cause_sentence = is_scene ? "" : sentence(snapshot.cause);
  state.can_play = session.can_play();
  const LiveMotion::Progress motion = session.motion().progress();
  state.steps = uint32_t(motion.steps);
  state.steps_known = uint32_t(motion.steps_known);
  state.volume_count = uint32_t(snapshot.volume_count);
  for (int v = 0; v < snapshot.volume_count; ++v) {
    const VolumeSnapshot& volume = snapshot.volumes[size_t(v)];
    rows_of(volume.world_from_volume, state.volumes[v].world_from_volume);
    state.volumes[v].time_s = volume.time_s;
    state.volumes[v].rate = volume.rate;
  }
  state.ticks = session.statistics().ticks.load();
  state.late_ticks = session.statistics().late.load();
  const LiveNumbers live = of_session.live_numbers();
  state.frames_received = live.received;
  state.frames_felt = live.felt;
  state.frame_delay_s = live.delay_median_s;
  state.frame_cycle_s = live.cycle_s;
  state.hand_work_j = tick.hand_work_j;
  in_world(tick.ledger.asked_n, state.asked_n);
  state.limiter_count = uint32_t(kLimiters);
  state.reserved = 0;
  for (size_t k = 0; k < kLimiters; ++k) {
    state.limiters[k].word = word(Limiter(k));
    in_world(tick.ledger.held_n[k], state.limiters[k].held_n);
  }
}
static_assert(size_t(PAL_MOST_LIMITERS) >= kLimiters);
static_assert(int(PAL_MOST_VOLUMES) == SceneSnapshot::kMostVolumes);

void fill(PalVolumeState& state, const VolumeSnapshot& volume) {
  rows_of(volume.world_from_volume, state.world_from_volume);
  state.time_s = volume.time_s;
  state.rate = volume.rate;
}

void fill(PalTube& tube, const ReleasedTube& released, const SceneSnapshot& snapshot) {
  const StreamTube& line = *released.tube;
  tube.volume = uint32_t(released.volume);
  tube.is_kept = released.kept;
  tube.is_closed = line.closed();
  tube.field = PalTubeField(line.field());
  tube.point_count = uint32_t(line.lengths().size());
  tube.seed_point = uint32_t(line.seed());
  tube.length_unit = unit(line.field());
  const size_t given = std::min<size_t>(tube.point_count, tube.capacity);
  if (tube.points_m) {
    const VolumeSnapshot& now = snapshot.volumes[released.volume];
    const std::vector<glm::dvec3> places = line.places(pointer_at(line.data()->times, now.time_s));
    for (size_t k = 0; k < given; ++k) {
      const glm::dvec3 place_m = now.world_from_volume.world_from_volume(places[k]);
      for (int a = 0; a < 3; ++a) tube.points_m[3 * k + size_t(a)] = place_m[a];
    }
  }
  if (tube.lengths) std::copy_n(line.lengths().begin(), given, tube.lengths);
}
static_assert(int(TubeField::kVectors) == PAL_TUBE_VECTORS &&
              int(TubeField::kGradient) == PAL_TUBE_GRADIENT &&
              int(TubeField::kCurl) == PAL_TUBE_CURL &&
              int(TubeField::kVelocity) == PAL_TUBE_VELOCITY);

}  // namespace
}  // namespace palpate::toolkit

using namespace palpate::toolkit;
using palpate::ControlEvent;

PalResult pal_session_open(PalScene* scene, const PalSessionInfo* info, PalSession** session) {
  return guarded([&] { return open_session(scene, info, session); });
}

PalResult pal_session_close(PalSession** session) {
  return guarded([&] {
    if (!session) return PAL_OK;
    {
      const Use use(of(seen_in(session)));
      if (use && session_calling_back == &*use)
        return failed(
            PAL_BAD_INPUT,
            {"A session can not be closed from its own callback: close it from another thread"});
    }
    // A view may keep the rest of the session alive; its threads end here.
    const auto content = closed(of(taken_out_of(session)));
    if (!content) return PAL_OK;
    const palpate::Status written = content->finish();
    return written ? PAL_OK : failed(written.error());
  });
}

PalResult pal_session_stop(PalSession* session) {
  return with(session, [](SessionContent& of_session) {
    if (session_calling_back == &of_session)
      return failed(
          PAL_BAD_INPUT,
          {"A session can not be stopped from its own callback: stop it from another thread"});
    of_session.stop();
    return PAL_OK;
  });
}

int pal_session_at_rest(const PalSession* session) {
  const Use use(of(session));
  return use && use->session().at_rest();
}

PalResult pal_haptics_tick(PalSession* session, const PalTick* tick, double force_n[3]) {
  if (!force_n) return failed(PAL_BAD_INPUT, {"The argument that takes the force is NULL"});
  force_n[0] = force_n[1] = force_n[2] = 0.0;
  const Use use(of(session));
  if (!use) return refused_handle("session");
  if (!tick || !use->host_ticks)
    return failed(PAL_BAD_INPUT,
                  {"The tick is missing, or the session has a haptic thread of its own"});
  const glm::dvec3 force =
      use->session().tick({{tick->position_m[0], tick->position_m[1], tick->position_m[2]},
                           tick->time_ns,
                           tick->buttons,
                           use->grip});
  for (int a = 0; a < 3; ++a) force_n[a] = force[a];
  return PAL_OK;
}

PalResult pal_haptics_torque(PalSession* session, double torque_n_m[3]) {
  if (!torque_n_m) return failed(PAL_BAD_INPUT, {"The argument that takes the torque is NULL"});
  torque_n_m[0] = torque_n_m[1] = torque_n_m[2] = 0.0;
  const Use use(of(session));
  if (!use) return refused_handle("session");
  if (!use->host_ticks)
    return failed(PAL_BAD_INPUT, {"The session has a haptic thread of its own"});
  const glm::dvec3 torque = use->session().torque_n_m();
  for (int a = 0; a < 3; ++a) torque_n_m[a] = torque[a];
  return PAL_OK;
}

PalResult pal_haptics_hold(PalSession* session, const PalGrip* grip) {
  const Use use(of(session));
  if (!use) return refused_handle("session");
  PalGrip known;
  if (const PalResult read = taken(grip, offsetof(PalGrip, device_from_grip), "PalGrip", known);
      read != PAL_OK)
    return read;
  if (!use->host_ticks)
    return failed(PAL_BAD_INPUT, {"The session has a haptic thread of its own"});
  if (known.senses & ~uint32_t(PAL_GRIP_TURNS | PAL_GRIP_OPENS))
    return failed(PAL_BAD_INPUT, {"PalGrip: senses has a flag that is not known"});
  use->grip = grip_of(known);
  return PAL_OK;
}

PalResult pal_session_state(PalSession* session, PalState* state) {
  return with(session, [&](SessionContent& of_session) {
    PalState known;
    if (const PalResult read = taken(state, offsetof(PalState, hand_m), "PalState", known);
        read != PAL_OK)
      return read;
    fill(known, of_session);
    std::memcpy(state, &known, state->size);
    return PAL_OK;
  });
}

PalResult pal_session_volume(PalSession* session, uint32_t index, PalVolumeState* volume) {
  return with(session, [&](SessionContent& of_session) {
    PalVolumeState known;
    if (const PalResult read =
            taken(volume, offsetof(PalVolumeState, time_s), "PalVolumeState", known);
        read != PAL_OK)
      return read;
    if (index >= of_session.session().scene()->volumes.size()) return PAL_END;
    const palpate::SceneSnapshot snapshot = of_session.snapshot();
    if (index >= uint32_t(snapshot.volume_count))
      return failed(PAL_NOT_YET, {"There was no haptic frame yet"});
    fill(known, snapshot.volumes[index]);
    std::memcpy(volume, &known, volume->size);
    return PAL_OK;
  });
}

PalResult pal_session_push_frame(PalSession* session, const PalGrid* grid, PalSampleType type,
                                 const void* samples, int64_t time_ns) {
  return with(session, [&](SessionContent& of_session) {
    const palpate::Status pushed = of_session.push(grid, type, samples, time_ns);
    return pushed ? PAL_OK : failed(pushed.error());
  });
}

PalResult pal_session_play(PalSession* session, int on) {
  return with(session, [&](SessionContent& of_session) {
    if (!of_session.session().can_play())
      return failed(PAL_NOT_YET, {"The motion is not known yet"});
    of_session.session().play(on != 0);
    return PAL_OK;
  });
}

PalResult pal_session_scrub(PalSession* session, double share) {
  return with(session, [&](SessionContent& of_session) {
    if (!(share >= 0.0 && share <= 1.0))
      return failed(PAL_BAD_INPUT, {"A share of the sequence is from 0 to 1"});
    if (!of_session.session().can_play())
      return failed(PAL_NOT_YET, {"The motion is not known yet"});
    of_session.session().scrub_to(share);
    return PAL_OK;
  });
}

PalResult pal_session_set_mode(PalSession* session, uint32_t index, int on, double gain) {
  return with(session, [&](SessionContent& of_session) {
    if (index >= of_session.session().scene()->modes.size())
      return failed(PAL_BAD_INPUT, {"The scene has no such mode"});
    if (const auto checked = check_number("gain", gain, palpate::files::kGains); !checked)
      return failed(checked.error());
    return both_sent(of_session, {ControlEvent::Kind::kModeOn, int(index), on ? 1.0 : 0.0},
                     {ControlEvent::Kind::kModeGain, int(index), gain});
  });
}

PalResult pal_session_place(PalSession* session, uint32_t volume,
                            const double world_from_volume[12]) {
  return with(session, [&](SessionContent& of_session) {
    const auto scene = of_session.session().scene();
    if (volume >= scene->volumes.size() || !world_from_volume)
      return failed(PAL_BAD_INPUT, {"The scene has no such volume, or its place is missing"});
    if (scene->volumes[volume].spec.drive.kind != palpate::DriveSpec::Kind::kSecondHand)
      return failed(PAL_BAD_INPUT,
                    {"The volume does not take places: open its scene with PAL_SCENE_MOVABLE"});
    glm::dmat4 matrix(1.0);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        matrix[column][row] = world_from_volume[4 * row + column];
    const auto transform = palpate::split(matrix);
    if (!transform) return failed(transform.error());
    return of_session.session().place(volume, *transform)
               ? PAL_OK
               : failed(PAL_NOT_YET,
                        {"Too many places wait already: the haptic loop does not run"});
  });
}

PalResult pal_session_rearm(PalSession* session) {
  return with(session, [](SessionContent& of_session) {
    return sent(of_session, {ControlEvent::Kind::kRearm, 0, 0.0});
  });
}

PalResult pal_session_ask_tubes(PalSession* session, PalTubesAction action) {
  return with(session, [&](SessionContent& of_session) {
    switch (action) {
      case PAL_TUBES_RELEASE:
        return sent(of_session, {ControlEvent::Kind::kReleaseTube});
      case PAL_TUBES_KEEP:
        return sent(of_session, {ControlEvent::Kind::kKeepTubes});
      case PAL_TUBES_CLEAR:
        return sent(of_session, {ControlEvent::Kind::kClearTubes});
      default:
        return failed(PAL_BAD_INPUT, {"There is no such action on stream tubes"});
    }
  });
}

PalResult pal_session_tube(PalSession* session, uint32_t index, PalTube* tube) {
  return with(session, [&](SessionContent& of_session) {
    PalTube known;
    if (const PalResult read = taken(tube, offsetof(PalTube, length_unit), "PalTube", known);
        read != PAL_OK)
      return read;
    const auto tubes = of_session.session().tubes();
    if (index >= tubes->size()) return PAL_END;
    fill(known, (*tubes)[index], of_session.snapshot());
    std::memcpy(tube, &known, tube->size);
    return PAL_OK;
  });
}

PalResult pal_session_save_tubes(PalSession* session, const char* path) {
  if (!path) return failed(PAL_BAD_INPUT, {"The path is missing"});
  return with(session, [&](SessionContent& of_session) {
    const palpate::Status written =
        palpate::loading::write_tubes(path, *of_session.session().tubes());
    return written ? PAL_OK : failed(written.error());
  });
}
