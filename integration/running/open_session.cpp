#include "integration/running/open_session.h"

#include <utility>

#include "integration/files/atomic_file.h"
#include "integration/files/state_folder.h"
#include "integration/running/session_options.h"

namespace palpate::running {
namespace {

namespace fs = std::filesystem;

Error refused(const char* sentence) {
  return {ErrorKind::kBadInput, sentence};
}

bool is_live(const SessionRequest& request) {
  return !request.inputs.empty() && openigtlink::is_address(request.inputs.front().string());
}

LiveSourceOptions live_options(const SessionRequest& request, const SessionCallbacks& callbacks) {
  LiveSourceOptions options;
  options.image = request.image;
  options.transform = request.transform;
  options.keep_cycles = !request.follow;
  if (!request.preset.empty()) options.preset = request.preset;
  options.open_context = callbacks.open_context;
  if (callbacks.on_note)
    options.on_note = [on_note = callbacks.on_note](const std::string& note) {
      on_note(NoteSource::kLive, note);
    };
  return options;
}

Result<std::unique_ptr<LiveSource>> open_live(const SessionRequest& request,
                                              const SessionCallbacks& callbacks) {
  if (request.inputs.size() > 1)
    return refused("A live source is felt alone: name it without other files");
  return LiveSource::open(server_address(request, request.inputs.front().string()),
                          live_options(request, callbacks));
}

/// Connects to the tracker of the hand.
Status open_tool(const SessionRequest& request, const SessionCallbacks& callbacks,
                 ConnectedSession& connected) {
  if (connected.tool || !openigtlink::is_address(request.device)) return Nothing{};
  auto tool = ToolSource::open(server_address(request, request.device), request.tool,
                               [on_note = callbacks.on_note](const std::string& note) {
                                 if (on_note) on_note(NoteSource::kTool, note);
                               });
  if (!tool) return tool.error();
  connected.tool = std::move(*tool);
  return Nothing{};
}

/// What comes from outside during a run is no part of a recording.
Status check_recording(const SessionRequest& request) {
  if (request.record.empty() || !is_live(request)) return Nothing{};
  return refused("What comes from a live source is no part of a recording: leave `record` out");
}

/// The device into `connected`, and what is known of it into `prepared`.
Status open_device(SessionHost& host, PreparedSession& prepared, ConnectedSession& connected) {
  const SessionRequest& request = prepared.request;
  const bool fit =
      !request.shown_only && prepared.scene.from_sequence && !request.scale && !request.true_size;
  if (host.ticks || host.device) {
    prepared.host_ticks = host.ticks.has_value();
    prepared.felt.info = host.ticks ? *host.ticks : host.device->info();
    connected.device = std::move(host.device);
    if (fit) fit_to_reach(prepared.scene, prepared.felt.info);
    return Nothing{};
  }
  auto felt = open_felt_device(request, prepared.scene, fit, host.others);
  if (!felt) return felt.error();
  prepared.felt = std::move(*felt);
  connected.device = std::move(prepared.felt.device);
  connected.tool_hand = prepared.felt.tool;
  return Nothing{};
}

/// The device of a second hand, in a scene that is scaled to the first one's.
Status open_second(PreparedSession& prepared, const OtherHands& others,
                   ConnectedSession& connected) {
  SessionRequest request = prepared.request;
  if (request.second_device.empty()) return Nothing{};
  request.device = std::exchange(request.second_device, {});
  const bool is_other = request.device == "auto" || request.device == "none" ||
                        request.device == "mouse" || request.device == "controller" ||
                        openigtlink::is_address(request.device);
  if (is_other)
    return Error{ErrorKind::kBadInput,
                 "`second_device` is " + request.device +
                     ": name a force device, KIND@ADDRESS as 'palpate devices' "
                     "shows it, or simulated"};
  if (request.device == prepared.request.device && request.device != "simulated")
    return refused(
        "`device` and `second_device` are the same: give each its address, KIND@ADDRESS");
  if (connected.live)
    return refused("A live source is felt with one hand: leave `second_device` out");
  OtherHands alone;
  alone.clock = others.clock;
  auto felt = open_felt_device(request, prepared.scene, false, alone);
  if (!felt) return felt.error();
  prepared.second_felt = std::move(*felt);
  connected.second_device = std::move(prepared.second_felt->device);
  return Nothing{};
}

/// What the loop is to do.
SessionOptions session_options(const PreparedSession& prepared, const SessionCallbacks& callbacks) {
  const SessionRequest& request = prepared.request;
  SessionOptions options;
  SafetyOptions& safety = options.haptics.safety;
  safety.max_force_n = prepared.scene.spec.max_force_n;
  safety.dead_man = request.dead_man;
  safety.max_speed_m_per_s = request.max_hand_speed_m_per_s;
  set_watchdog(options, request.watchdog_s.value_or(0.0), prepared.felt.is_harmless);
  options.tube_buttons = request.tube_buttons;
  options.servo.real_time.core = request.core;
  if (!request.real_time || request.shown_only)
    options.servo.real_time = {
        .priority = 0, .core = request.core, .lock_memory = false, .cores_awake = false};
  if (!request.preset.empty()) options.motion.preset = request.preset;
  if (request.estimate) options.motion.open_context = callbacks.open_context;
  options.on_event = callbacks.on_event;
  options.next_note = callbacks.next_note;
  return options;
}

/// What is kept of the ticks.
Result<FlightRecorderOptions> kept_ticks(const PreparedSession& prepared) {
  const SessionRequest& request = prepared.request;
  FlightRecorderOptions options;
  options.sums_up = prepared.sums_up;
  if (!request.csv.empty()) options.table = request.csv;
  if (!request.record.empty()) options.recording = request.record;
  if (request.shown_only || request.black_box == "off") return options;
  if (!request.black_box.empty()) {
    if (const Status can = files::check_can_write_folder(request.black_box); !can)
      return can.error();
    options.black_box = request.black_box;
  } else {
    // Where no state can be kept, the working folder has to do.
    const fs::path kept = files::state_folder();
    options.black_box = kept.empty() ? fs::path(".") : kept;
  }
  return options;
}

}  // namespace

std::string server_address(const SessionRequest& request, const std::string& place) {
  constexpr const char* kNoCrc = "?crc=none";
  return place + (!request.crc && !place.ends_with(kNoCrc) ? kNoCrc : "");
}

void apply_scene_options(const SessionRequest& request, LoadedScene& scene) {
  if (request.scale && scene.from_sequence)
    scene.spec.volumes[0].transform.scale = glm::dvec3(*request.scale);
  if (request.forget_motion) forget_motion(scene);
  if (!request.motion) scene.missing.clear();
  if (request.movable) make_movable(scene);
}

Status set_scene_options(SessionRequest& request, const SceneSpec& scene) {
  if (scene.session.empty()) return Nothing{};
  const Status set =
      set_options(request, scene.session, kSceneFileDoor, OptionStage::kSession, true);
  if (set) return set;
  return Error{set.error().kind, "The scene's section session: " + set.error().message};
}

Result<RequestedScene> load_request(const SessionRequest& request,
                                    const SessionCallbacks& callbacks) {
  RequestedScene read;
  loading::SequenceChoices choices = request.sequence;
  if (!request.motion) choices.finds_motion = choices.holds_frames = false;
  if (is_live(request)) {
    auto live = open_live(request, callbacks);
    if (!live) return live.error();
    read.live = std::move(*live);
  }
  auto scene =
      read.live ? read.live->load(choices, !request.shown_only, callbacks.on_doing, request.wait_s)
      : request.shown_only ? loading::load_shown_scene(request.inputs, choices, callbacks.on_doing)
                           : loading::load_scene(request.inputs, choices, callbacks.on_doing);
  if (!scene) return scene.error();
  read.scene = std::move(*scene);
  apply_scene_options(request, read.scene);
  return read;
}

Result<PreparedSession> prepare_session(SessionRequest request, SessionHost host,
                                        SessionCallbacks callbacks, ConnectedSession& connected) {
  // What fails at once comes first: reading may take minutes.
  if (const Status can = check_recording(request); !can) return can.error();
  const bool has_own_device = !host.ticks && !host.device;
  if (has_own_device)
    if (const Status opened = open_tool(request, callbacks, connected); !opened)
      return opened.error();
  if (request.serve > 0) {
    auto server = FeltServer::start(uint16_t(request.serve));
    if (!server) return server.error();
    connected.server = std::move(*server);
  }

  // The scene, and the options that it asks for itself.
  PreparedSession prepared;
  prepared.sums_up = host.sums_up;
  if (host.scene) {
    prepared.scene = std::move(*host.scene);
    prepared.first_frame = std::move(host.first_frame);
    if (is_live(request)) {
      auto live = open_live(request, callbacks);
      if (!live) return live.error();
      connected.live = std::move(*live);
    }
  } else {
    auto read = load_request(request, callbacks);
    if (!read) return read.error();
    prepared.scene = std::move(read->scene);
    connected.live = std::move(read->live);
  }
  // A recording contains the inputs of the loop, but no scene that is exchanged during the run.
  if (!request.record.empty())
    prepared.leaves_motion_out = !std::exchange(prepared.scene.missing, {}).empty();
  if (const Status asked = set_scene_options(request, prepared.scene.spec); !asked)
    return asked.error();
  if (request.stiffness_n_per_m) prepared.scene.spec.stiffness_n_per_m = *request.stiffness_n_per_m;
  if (request.max_force_n) prepared.scene.spec.max_force_n = *request.max_force_n;
  if (request.tool_radius_mm) prepared.scene.spec.tool_radius_m = 1e-3 * *request.tool_radius_mm;
  if (request.tool_points > 0) prepared.scene.spec.tool_points = request.tool_points;
  if (has_own_device)
    if (const Status opened = open_tool(request, callbacks, connected); !opened)
      return opened.error();

  // The device, to which a sequence is scaled.
  prepared.request = std::move(request);
  if (!prepared.request.shown_only && callbacks.on_doing)
    callbacks.on_doing("looking for a surface to touch");
  if (const Status opened = open_device(host, prepared, connected); !opened) return opened.error();
  if (const Status opened = open_second(prepared, host.others, connected); !opened)
    return opened.error();
  if (prepared.felt.controller || prepared.felt.tool) stand_in_true_size(prepared.scene);
  prepared.options = session_options(prepared, callbacks);
  prepared.options.clock = host.others.clock;
  return prepared;
}

Status start_session(PreparedSession& prepared, ConnectedSession& connected) {
  const auto kept = kept_ticks(prepared);
  if (!kept) return kept.error();
  auto flight = FlightRecorder::start(
      *kept, {prepared.scene.spec, prepared.felt.info, prepared.options.haptics.safety,
              prepared.options.tube_buttons});
  if (!flight) return flight.error();
  connected.flight = std::move(*flight);
  if (prepared.second_felt) {
    FlightRecorderOptions of_second = *kept;
    if (of_second.table) of_second.table = second_file(*of_second.table);
    if (of_second.recording) of_second.recording = second_file(*of_second.recording);
    SessionOptions options = prepared.options;
    set_watchdog(options, prepared.request.watchdog_s.value_or(0.0),
                 prepared.second_felt->is_harmless);
    auto second = FlightRecorder::start(
        of_second, {prepared.scene.spec, prepared.second_felt->info, options.haptics.safety, 0});
    if (!second) return second.error();
    connected.second_flight = std::move(*second);
    if (const Status started = connected.start_second(prepared.scene, std::move(options)); !started)
      return started;
  }
  const Volume* const first = prepared.first_frame ? &*prepared.first_frame : nullptr;
  return prepared.host_ticks ? connected.start_in_host(prepared.scene, prepared.felt.info,
                                                       std::move(prepared.options), first)
                             : connected.start(prepared.scene, std::move(prepared.options), first);
}

std::filesystem::path second_file(const std::filesystem::path& first) {
  std::filesystem::path second = first;
  return second.replace_extension(".second" + first.extension().string());
}

Status open_session(SessionRequest request, SessionHost host, SessionCallbacks callbacks,
                    ConnectedSession& connected) {
  auto prepared =
      prepare_session(std::move(request), std::move(host), std::move(callbacks), connected);
  return prepared ? start_session(*prepared, connected) : Status(prepared.error());
}

}  // namespace palpate::running
