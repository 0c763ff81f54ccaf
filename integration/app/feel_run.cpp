#include "integration/app/feel_run.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <future>
#include <mutex>
#include <thread>

#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_report.h"
#include "integration/app/outputs.h"
#include "integration/app/picture_file.h"
#include "integration/app/state_folder.h"
#include "integration/app/viewers.h"
#include "integration/devices/spacemouse.h"
#include "integration/files/atomic_file.h"
#include "integration/files/vtk_lines.h"
#include "integration/scenes/replay_key.h"
#include "integration/scenes/tubes_file.h"
#include "integration/sessions/felt_server.h"
#include "integration/sessions/live_source.h"
#include "integration/sessions/replay.h"
#include "integration/sessions/tick_log.h"
#include "integration/sessions/tool_source.h"
#include "module/haptics/black_box.h"
#include "module/haptics/emergency.h"
#include "module/haptics/recording.h"
#include "module/session/session.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using headset::GatedDevice;
using headset::tube_buttons;
using sessions::FeltServer;
using sessions::LiveSource;
using sessions::LiveSourceOptions;
using sessions::TickLog;
using sessions::ToolSource;

constexpr auto kSilence = std::chrono::milliseconds(500);  // reading that takes longer is reported

/// How long the end of a run may take after a signal; the force is down in a tenth of a second.
constexpr std::chrono::seconds kPatience{10};

/// Watchdog of a simulated hand: a late tick can not hurt it, and this machine may be busy.
constexpr double kWatchdog_ms = 5.0, kSimulatedWatchdog_ms = 50.0;

HapticsOptions haptics_options(const FeelCommand& command, const SceneSpec& spec, bool simulated) {
  HapticsOptions options;
  options.safety.max_force_n = spec.max_force_n;
  options.safety.dead_man = command.dead_man;
  const double watchdog_ms = command.watchdog_ms > 0.0 ? command.watchdog_ms
                             : simulated               ? kSimulatedWatchdog_ms
                                                       : kWatchdog_ms;
  options.safety.late_s = 1e-3 * watchdog_ms;
  options.safety.stale_s = std::max(options.safety.stale_s, 2.0 * options.safety.late_s);
  return options;
}

ServoOptions servo_options(const FeelCommand& command, const HapticsOptions& haptics) {
  ServoOptions options;
  options.loop.watchdog_ns = int64_t(1e9 * haptics.safety.late_s);
  options.real_time.core = command.core;
  if (command.no_real_time || !command.hand)
    options.real_time = {
        .priority = 0, .core = command.core, .lock_memory = false, .cores_awake = false};
  return options;
}

/// "Segment   pool, colour 0.9 0.3 0.3: a wall of 4 N, 4000 N/m".
std::string segment_text(const Segment& segment, const SegmentsSpec& spec) {
  std::string text = fmt::format("Segment   {}, colour {:.2g} {:.2g} {:.2g}", segment.name,
                                 segment.colour.r, segment.colour.g, segment.colour.b);
  const auto part = std::find_if(spec.parts.begin(), spec.parts.end(),
                                 [&](const SegmentSpec& of) { return of.name == segment.name; });
  if (part == spec.parts.end()) return text;
  return text + (part->felt ? fmt::format(": a wall of {:.3g} N, {:.4g} N/m", part->strength_n,
                                          part->stiffness_n_per_m)
                            : ": not felt as a wall");
}

/// What can be said of the scene and the device before anything is felt.
void announce(const FeelCommand& command, const LoadedScene& scene, const OpenedDevice& opened,
              bool live, Console& console) {
  for (size_t v = 0; v < scene.data.size(); ++v) {
    const MovingVolume& volume = *scene.data[v];
    const size_t frames = volume.times.times_s.size();
    const bool missing =
        std::any_of(scene.missing.begin(), scene.missing.end(),
                    [&](const MissingMotion& motion) { return motion.volume == v; });
    const bool stands = volume.whole && volume.whole->largest_u_m() == 0.0;
    if (live) {
      console.say(
          fmt::format("Volume    {}: live; the first frame stands still until the next "
                      "one comes",
                      volume.name));
      continue;
    }
    std::string motion = ", with its motion";
    if (missing)
      motion = ", still at first: its motion is estimated while you feel it";
    else if (stands)
      motion = fmt::format(", of which frame {} stands still", volume.whole->reference());
    else if (volume.whole)
      motion = fmt::format(", with one motion for all of them: frame {} is carried",
                           volume.whole->reference());
    else if (volume.motions.empty())
      motion = ", frame by frame";
    console.say(fmt::format("Volume    {}: {}", volume.name,
                            frames == 1 ? "one frame, which stands still"
                                        : fmt::format("{} frames in {:.3g} s{}", frames,
                                                      volume.times.length_s(), motion)));
    for (const Segment& segment : volume.segments)
      console.say(segment_text(segment, scene.spec.volumes[v].segments));
  }
  if (command.hand) console.say(fmt::format("Device    {}", opened.why));
  for (const std::string& note : scene.notes) console.say("Note      " + note);
}

/// "motion 3 of 20 steps, 25 s left"; nothing once it is done.
std::string motion_text(const LiveMotion& motion) {
  if (motion.is_done()) return {};
  const LiveMotion::Progress now = motion.progress();
  std::string text = now.steps_known == now.steps
                         ? "one motion for the whole sequence"
                         : fmt::format("motion {} of {} steps", now.steps_known, now.steps);
  return now.left_s < 0.0 ? text : text + ", " + duration_text(now.left_s) + " left";
}

/// "Tubes     3 stream tubes, 2 of them kept".
std::string tubes_text(const ReleasedTubes& tubes) {
  const auto kept =
      std::count_if(tubes.begin(), tubes.end(), [](const ReleasedTube& tube) { return tube.kept; });
  return fmt::format("Tubes     {} stream tube{}, {} of them kept", tubes.size(),
                     tubes.size() == 1 ? "" : "s", kept);
}

/// How evenly the servo thread ran.
struct ServoPeriods {
  double median_us = 0.0, p999_us = 0.0, most_us = 0.0;
  uint64_t ticks = 0;
};

/// One run of the loop with everything that listens to it.
class FeelRun {
 public:
  FeelRun(const FeelCommand& command, Console& console) : command_(command), console_(console) {}
  ~FeelRun() {
    if (session_) end();  // after an exception
  }
  FeelRun(const FeelRun&) = delete;
  FeelRun& operator=(const FeelRun&) = delete;

  int run(CancelOnSignal& cancel) {
    cancel.end_at_once(true);
    ForceDeviceChoice choice = command_.device;
    if (const Status looking = choose_viewers(); !looking) return fail(console_, looking.error());
    choice.real_time = !command_.no_real_time;
    choice.has_window = viewers_.window != nullptr;
    choice.has_headset = viewers_.headset != nullptr;
    if (!command_.hand) choice.device = "none";
    if (!command_.tool.empty()) {
      auto tool =
          ToolSource::open(command_.tool, command_.tool_name,
                           [this](const std::string& note) { console_.say("Tool      " + note); });
      if (!tool) return fail(console_, tool.error());
      tool_ = std::move(*tool);
      choice.device = "tool";
    }
    if (const Status met = check_choice(choice); !met) return fail(console_, met.error());
    if (const Status look = check_look(command_.view.look); !look)
      return fail(console_, look.error());
    if (!command_.headless.empty()) {
      auto outputs = Outputs::into(command_.headless);
      if (!outputs) return fail(console_, outputs.error());
      outputs_.emplace(std::move(*outputs));
    }
    if (command_.serve_port > 0) {
      auto server = FeltServer::start(uint16_t(command_.serve_port));
      if (!server) return fail(console_, server.error());
      server_ = std::move(*server);
    }
    auto scene = prepared(choice);
    if (!scene) return fail(console_, scene.error());
    const auto& volumes = scene->spec.volumes;
    wants_second_hand_ = std::any_of(volumes.begin(), volumes.end(), [](const VolumeSpec& volume) {
      return volume.drive.kind == DriveSpec::Kind::kSecondHand;
    });
    if (viewers_.headset) fit_to_headset(*scene);
    if (opened_.controller || opened_.tool) sessions::stand_in_true_size(*scene);
    announce(command_, *scene, opened_, live_ != nullptr, console_);
    console_.say("Seen      " + viewers_.why);
    if (const Status ready = start_listeners(*scene); !ready) return fail(console_, ready.error());
    const SceneSpec at_start = scene->spec;
    cancel.end_at_once(false);
    if (const Status started = start(std::move(*scene)); !started)
      return fail(console_, started.error());
    cancel.give_up_after(kPatience);
    feel(at_start, cancel.token());
    return finish();
  }

  /// After run(): the servo thread's periods; nothing if it never ran.
  std::optional<ServoPeriods> periods() const {
    if (!session_) return std::nullopt;
    const ServoStatistics& statistics = session_->statistics();
    const auto us = [](int64_t ns) { return 1e-3 * double(ns); };
    return ServoPeriods{us(statistics.period.quantile_ns(0.5)),
                        us(statistics.period.quantile_ns(0.999)), us(statistics.period.most_ns()),
                        statistics.ticks.load()};
  }

 private:
  /// The slow work before anything can be felt: reading, and finding a place to touch. Runs beside
  /// the window, which goes on answering, and reports what it does.
  Result<LoadedScene> prepared(const ForceDeviceChoice& choice) {
    std::mutex mutex;
    std::string doing = "is being read";
    const auto say = [&](const std::string& what) {
      const std::lock_guard lock(mutex);
      doing = what;
    };
    auto work = std::async(std::launch::async, [&] { return scene_and_device(choice, say); });
    const auto begin = Clock::now();
    while (work.wait_for(std::chrono::milliseconds(15)) != std::future_status::ready) {
      std::string now;
      {
        const std::lock_guard lock(mutex);
        now = doing;
      }
      if (viewers_.window) viewers_.window->wait(now);
      if (viewers_.window && (viewers_.window->closed() || viewers_.window->lost())) {
        // Nothing is written yet, and reading can not be asked to stop.
        console_.complain("palpate: The window was closed before anything was felt.");
        std::_Exit(kExitInternal);
      }
      if (Clock::now() - begin > kSilence) console_.live("Reading   " + now);
    }
    console_.end_progress();
    return work.get();
  }

  Result<LoadedScene> scene_and_device(const ForceDeviceChoice& choice,
                                       const scenes::OnDoing& doing) {
    const bool live = openigtlink::is_place(command_.inputs.front().string());
    if (live)
      if (const Status opened = open_live(); !opened) return opened.error();
    scenes::SequenceChoices choices = command_.sequence;
    choices.finds_motion = !command_.no_motion && command_.record.empty();
    choices.holds_frames = choices.finds_motion;
    auto scene = live            ? live_->load(choices, command_.hand, doing)
                 : command_.hand ? scenes::load_scene(command_.inputs, choices, doing)
                                 : scenes::load_shown_scene(command_.inputs, choices, doing);
    if (!scene) return scene;
    apply_choices(*scene);
    if (command_.hand) doing("looking for a surface to touch");
    const bool fit = command_.hand && scene->from_sequence && command_.scale == "fit";
    auto opened = open_force_device(choice, *scene, fit);
    if (!opened) return opened.error();
    opened_ = std::move(*opened);
    return scene;
  }

  Status open_live() {
    if (command_.inputs.size() > 1)
      return Error{ErrorKind::kBadInput,
                   "A live source is felt alone: name it without other files"};
    if (!command_.record.empty())
      return Error{ErrorKind::kBadInput,
                   "What comes from a live source is no part of a recording: leave --record out"};
    LiveSourceOptions options;
    options.image = command_.live_image;
    options.transform = command_.live_transform;
    options.keep_cycles = command_.keep_cycles;
    if (!command_.preset.empty()) options.preset = command_.preset;
    // A scene may be opened more than once; its notes are printed once.
    options.open_context = [this, said = std::make_shared<std::atomic<bool>>(false)] {
      Console quiet(true, false);
      return open_device(command_.gpu, said->exchange(true) ? quiet : console_);
    };
    options.on_note = [this](const std::string& note) { console_.say("Live      " + note); };
    auto opened = LiveSource::open(command_.inputs.front().string(), std::move(options));
    if (!opened) return opened.error();
    live_ = std::move(*opened);
    return Nothing{};
  }

  Status choose_viewers() {
    if (!command_.calibration.empty()) {
      auto stored = files::read_calibration(command_.calibration);
      if (!stored) return stored.error();
      calibration_ = std::move(*stored);
    }
    ViewerChoice choice;
    choice.headset = command_.headset;
    choice.headless = !command_.headless.empty();
    choice.mirror = command_.mirror;
    choice.pass_through = command_.pass_through;
    choice.overlay = command_.overlay;
    choice.scene_name = command_.inputs.front().filename().string();
    choice.gpu = command_.gpu;
    choice.view = command_.view;
    auto viewers = open_viewers(choice);
    if (!viewers) return viewers.error();
    viewers_ = std::move(*viewers);
    if (!command_.hand && !viewers_.window && !viewers_.headset && command_.serve_port == 0)
      return Error{ErrorKind::kNoDevice,
                   "There is no display and no headset to view it in: --picture FILE.png or "
                   "--headless FOLDER draws pictures without"};
    return Nothing{};
  }

  /// A volume that stands still may be taken by a hand there, and a controller feels in true size.
  void fit_to_headset(LoadedScene& scene) {
    make_movable(scene);
    if (!opened_.controller && calibration_ &&
        scene.spec.world_from_device.scale != glm::dvec3(1.0)) {
      scene.spec.world_from_device.scale = glm::dvec3(1.0);
      scene.notes.push_back(
          "The hand's movements are not enlarged: the picture stands where the device is.");
    }
  }

  void apply_choices(LoadedScene& scene) const {
    if (command_.stiffness_n_per_m > 0.0) scene.spec.stiffness_n_per_m = command_.stiffness_n_per_m;
    if (command_.max_force_n > 0.0) scene.spec.max_force_n = command_.max_force_n;
    if (scene.from_sequence && command_.scale != "fit")
      scene.spec.volumes[0].transform.scale = glm::dvec3(std::stod(command_.scale));
    if (command_.estimate) forget_motion(scene);
    // A recording holds what goes into the loop; a scene that is exchanged meanwhile does not.
    if (!command_.record.empty() && !scene.missing.empty())
      scene.notes.push_back(
          "No motion is estimated while recording: find it first with 'palpate motion', and name "
          "its folder with --fields.");
    if (command_.no_motion || !command_.record.empty()) scene.missing.clear();
  }

  Status start_listeners(const LoadedScene& scene) {
    auto log = TickLog::start(command_.csv);
    if (!log) return log.error();
    log_ = std::move(*log);
    if (!command_.hand) {
      recorder_ = std::make_unique<TickRecorder>(std::vector<TickListener*>{log_.get()});
      return Nothing{};
    }
    if (!command_.tubes.empty())
      if (const Status can = files::check_can_write_vtk(command_.tubes); !can) return can;
    if (!command_.black_box.empty())
      if (const Status can = files::check_can_write_folder(command_.black_box); !can) return can;
    BlackBoxOptions box;
    // Where no state can be kept, the working folder has to do.
    const fs::path kept = state_folder();
    box.folder = !command_.black_box.empty() ? command_.black_box : kept.empty() ? "." : kept;
    black_box_ = std::make_unique<BlackBox>(box);
    std::vector<TickListener*> listeners = {log_.get(), black_box_.get()};
    if (command_.record.empty()) {
      recorder_ = std::make_unique<TickRecorder>(std::move(listeners));
      return Nothing{};
    }
    const SafetyOptions safety = haptics_options(scene).safety;
    auto recorder =
        TickRecorder::start(command_.record,
                            text_of(scenes::ReplayKey{scene.spec, opened_.device->info(), safety,
                                                      tube_buttons(safety)}),
                            1'000'000, std::move(listeners));
    if (!recorder) return recorder.error();
    recorder_ = std::move(*recorder);
    return Nothing{};
  }

  HapticsOptions haptics_options(const LoadedScene& scene) const {
    // A late tick can not hurt a simulated hand or one that feels no force.
    const bool harmless =
        opened_.simulated || opened_.mouse || opened_.controller || opened_.tool || !command_.hand;
    HapticsOptions haptics = app::haptics_options(command_, scene.spec, harmless);
    if (viewers_.headset) {
      GatedDevice::guard(haptics.safety);
    }
    return haptics;
  }

  Status start(LoadedScene scene) {
    const HapticsOptions haptics = haptics_options(scene);
    SessionOptions options;
    options.haptics = haptics;
    options.servo = servo_options(command_, haptics);
    options.servo.listeners = {recorder_.get(),
                               viewers_.window ? viewers_.window->listener() : nullptr};
    const double wanted = scene.spec.stiffness_n_per_m;
    if (wants_second_hand_) second_hand_ = std::make_unique<devices::SpaceMouse>();
    if (viewers_.headset) {
      auto gate = std::make_unique<GatedDevice>(std::move(opened_.device),
                                                command_.on_headset_loss == "go-on"
                                                    ? headset::OnHeadsetLoss::kGoOn
                                                    : headset::OnHeadsetLoss::kRamp);
      gate_ = gate.get();
      opened_.device = std::move(gate);
    }
    options.second_hand = second_hand_.get();
    if (command_.hand) options.tube_buttons = tube_buttons(haptics.safety);
    options.motion.preset = command_.preset.empty() ? "balanced" : command_.preset;
    options.motion.open_context = [this] { return open_device(command_.gpu, console_); };
    options.on_event = [this](const SessionEvent& event) { tell(event); };
    auto started = Session::start(scene, *opened_.device, options);
    if (!started) return started.error();
    session_ = std::move(*started);
    const double given =
        Haptics(haptics, opened_.device->info()).stiffness_on_device(*session_->scene(), wanted);
    if (given < wanted)
      console_.say(fmt::format(
          "Note      The spring is {:.0f} N/m instead of {:.0f}: more would make this device hum.",
          given, wanted));
    return Nothing{};
  }

  /// When it is over; a simulated hand presses once, or once more after the motion is known.
  double end_s(double motion_known_s) const {
    if (command_.seconds > 0.0) return command_.seconds;
    if (!opened_.simulated) return 1e12;
    return motion_known_s + opened_.path_s + 0.5;
  }

  void feel(const SceneSpec& scene, std::stop_token stop) {
    if (outputs_) {
      GalleryOptions options;
      options.gpu.device = command_.gpu.device;
      options.view = command_.view;
      options.size = {command_.picture_size, command_.picture_size};
      gallery_ = std::make_unique<Gallery>(*session_, options);
    }
    begin_viewers(scene);
    if (live_) live_->begin(*session_);
    if (tool_) tool_->begin(*opened_.tool, scene);
    if (server_) {
      server_->begin(*session_);
      console_.say(fmt::format("Serve     {}, by OpenIGTLink at port {}",
                               command_.hand ? "what is felt" : "the moved volume and its motion",
                               server_->port()));
      if (command_.json) tell_serving();
    }
    const LiveMotion& motion = session_->motion();
    const auto begin = Clock::now();
    TickOutput tick;
    double motion_known_s = motion.is_done() ? 0.0 : 1e12;
    double now_s = 0.0;
    while (now_s < end_s(motion_known_s) && !stop.stop_requested() && !emergency::is_asked() &&
           !(viewers_.window && viewers_.window->closed()) && !display_was_needed_and_lost() &&
           !(viewers_.headset && viewers_.headset->ended())) {
      if (viewers_.window)
        viewers_.window->frame(tick, motion_text(motion));
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      now_s = std::chrono::duration<double>(Clock::now() - begin).count();
      session_->newest(0, tick);
      tell_second_hand();
      tell_headset();
      std::string line = live_text(tick, session_->statistics(), now_s);
      if (!motion.is_done()) line += "  " + motion_text(motion);
      if (live_) line += "  " + live_->live_text();
      if (command_.hand) console_.live(line);
      if (motion.is_done() && motion_known_s == 1e12) motion_known_s = now_s;
    }
    console_.end_progress();
    end();
    tell_headset();
    recorded_ = recorder_->finish();
    if (tool_) tool_->end();
    display_lost_ = viewers_.window && viewers_.window->lost();
    if (display_lost_ && black_box_) black_box_->write_last("display-lost");
  }

  /// Ends the threads that use the session, then its own. Further calls do nothing.
  void end() {
    if (viewers_.window) viewers_.window->end();
    if (viewers_.headset) viewers_.headset->end();
    if (gallery_) gallery_->stop();
    if (server_) server_->end();
    if (live_) live_->end();
    session_->stop();
  }

  /// A headset goes on without the window that mirrors it.
  bool display_was_needed_and_lost() {
    if (!viewers_.window || !viewers_.window->lost()) return false;
    if (!viewers_.headset) return true;
    viewers_.window->end();
    lost_window_ = std::move(viewers_.window);
    console_.complain("palpate: The display of the window has gone away; the headset goes on.");
    return false;
  }

  void begin_viewers(const SceneSpec& scene) {
    if (viewers_.window) viewers_.window->begin(*session_, opened_.mouse);
    if (!viewers_.headset) return;
    headset::HeadsetScene joined;
    joined.session = session_.get();
    joined.gate = gate_;
    joined.controller = opened_.controller;
    joined.max_force_n = scene.max_force_n;
    joined.view = command_.view;
    joined.sound = command_.sound;
    joined.calibration = calibration_;
    joined.device_centre_m =
        scene.world_from_device.world_from_volume(opened_.device->info().workspace_centre_m);
    viewers_.headset->begin(joined);
  }

  void tell_headset() {
    if (!viewers_.headset) return;
    for (const headset::HeadsetEvent& event : viewers_.headset->news())
      console_.say("Headset   " + advised(event));
  }

  /// Reports when it is connected, is lost or can not be used.
  void tell_second_hand() {
    if (!second_hand_) return;
    const DeviceFault fault = second_hand_->read().fault;
    if (second_hand_fault_ == fault) return;
    second_hand_fault_ = fault;
    if (fault == DeviceFault::kNone)
      console_.say("Second    " + second_hand_->info().name + " moves the volume");
    else if (fault == DeviceFault::kNotOpened)
      console_.say("Second    no SpaceMouse is plugged in: the volume stays until one is");
    else
      console_.say(fmt::format("Second    {}", sentence(fault)));
  }

  /// The session's events, on a thread of its own.
  void tell(const SessionEvent& event) {
    switch (event.kind) {
      case SessionEvent::Kind::kNote:
        return console_.say("Note      " + event.sentence);
      case SessionEvent::Kind::kMoves:
      case SessionEvent::Kind::kWholeMotion:
        return console_.say("Motion    " + event.sentence);
      case SessionEvent::Kind::kMotionFailed:
        return console_.complain("palpate: " + event.sentence);
    }
  }

  /// A line of JSON on stdout, flushed at once: the reader may wait for it.
  static void print(const nlohmann::json& json) {
    std::printf("%s\n", json.dump().c_str());
    std::fflush(stdout);
  }

  void tell_serving() {
    const auto scene = session_->scene();
    const MovingVolume& first = *scene->volumes.front().data;
    print({{"event", "serving"},
           {"port", server_->port()},
           {"volume", first.name},
           {"frames", first.times.times_s.size()},
           {"length_s", first.times.length_s()},
           {"live", live_ != nullptr}});
  }

  void tell_served() {
    nlohmann::json json = {{"event", "ended"},
                           {"messages_sent", server_->server().sent()},
                           {"messages_missed", server_->server().missed()}};
    if (live_) {
      const LiveNumbers& numbers = live_->numbers();
      json["live"] = {
          {"images", live_->arrived().images},        {"transforms", live_->arrived().transforms},
          {"refused", live_->arrived().refused},      {"followed", numbers.felt},
          {"delay_median_s", numbers.delay_median_s}, {"cycle_s", numbers.cycle_s}};
    }
    print(json);
  }

  void tell_what_was_sent() {
    if (server_)
      console_.say(
          fmt::format("Serve     {} messages were sent; {} were left out because a client "
                      "was slow",
                      server_->server().sent(), server_->server().missed()));
  }

  int finish() {
    Status done = log_->finish();
    if (done) done = recorded_;
    if (!command_.hand) {
      if (live_) console_.say(live_->summary());
      tell_what_was_sent();
      if (command_.json) tell_served();
      return done ? kExitOk : fail(console_, done.error());
    }
    const std::shared_ptr<const ReleasedTubes> tubes = session_->tubes();
    if (!command_.tubes.empty() && done) done = scenes::write_tubes(command_.tubes, *tubes);
    const auto& rows = log_->rows();
    const FeelNumbers numbers = log_->numbers();
    if (!command_.picture.empty() && done)
      done = write_feel_picture(
          command_.picture.string(),
          fmt::format("Feeling {}", command_.inputs.front().filename().string()), numbers, rows);
    const std::string summary = summary_text(numbers, session_->statistics(), session_->report(),
                                             session_->haptics().tank().ledger());
    if (gallery_ && done) done = publish(summary);
    console_.say(summary);
    if (!tubes->empty()) console_.say(tubes_text(*tubes));
    if (tool_) console_.say(tool_->summary());
    if (live_) console_.say(live_->summary());
    tell_what_was_sent();
    for (const fs::path& file : black_box_->files())
      console_.say(fmt::format("Wrote     {}: the ticks around a fault", file.string()));
    if (const auto trouble = black_box_->trouble()) console_.complain(*trouble);
    if (!command_.csv.empty()) console_.say(fmt::format("Wrote     {}", command_.csv.string()));
    if (!command_.picture.empty())
      console_.say(fmt::format("Wrote     {}", command_.picture.string()));
    if (!command_.record.empty())
      console_.say(fmt::format("Wrote     {}", command_.record.string()));
    if (recorder_->lost() > 0 && !(command_.csv.empty() && command_.record.empty()))
      console_.complain("palpate: " + sessions::lost_text(recorder_->lost()));
    if (!command_.tubes.empty() && done)
      console_.say(fmt::format("Wrote     {}", command_.tubes.string()));
    if (gallery_ && done) tell_gallery();
    if (viewers_.headset) tell_headset_numbers();
    if (!done) return fail(console_, done.error());
    if (!display_lost_) return kExitOk;
    console_.complain(
        "palpate: The display has gone away (its X server or the connection to it ended), so the "
        "force was ramped down and the run ended.");
    return kExitInternal;
  }

  /// Page, views and summary, all or nothing.
  Status publish(const std::string& summary) {
    if (!gallery_->trouble().empty())
      console_.complain("palpate: There are no views of the volume: " + gallery_->trouble());
    const charts::Timeline timeline = feel_timeline("", log_->numbers(), log_->rows());
    const std::string title =
        fmt::format("Feeling {}", command_.inputs.front().filename().string());
    Status done = stage_views(*outputs_, gallery_->pictures(), title, timeline);
    if (!done) return done;
    const auto path = outputs_->stage("summary.txt");
    if (!path) return path.error();
    done = files::write_text(*path, summary.substr(1));
    return done ? outputs_->publish() : Status(outputs_->in_place(done.error()));
  }

  void tell_headset_numbers() {
    const headset::HeadsetLoop::Numbers& numbers = viewers_.headset->numbers();
    console_.say(fmt::format(
        "Headset   {} frames in {} sessions, {} of them with a picture{}", numbers.frames,
        numbers.sessions, numbers.drawn,
        numbers.drawn == 0
            ? ""
            : fmt::format(", the last of 2 x {} x {} in {:.1f} ms on the device",
                          numbers.size.width, numbers.size.height, numbers.picture_ms)));
  }

  void tell_gallery() {
    console_.say(
        fmt::format("Seen      {} stereo pictures of 2 x {} x {}, {:.0f} ms each (median), the "
                    "first after {:.1f} s",
                    gallery_->frames(), command_.picture_size, command_.picture_size,
                    gallery_->median_ms(), gallery_->first_picture_s()));
    console_.say(fmt::format(
        "Look at\n  {}   what was seen and felt, on one page\n  {}   a view for two eyes",
        (command_.headless / "page.png").string(), (command_.headless / "view_1.png").string()));
  }

  const FeelCommand& command_;
  Console& console_;
  std::optional<Outputs> outputs_;
  std::optional<files::StoredCalibration> calibration_;
  OpenedDevice opened_;
  std::unique_ptr<ToolSource> tool_;  ///< moves opened_.tool, until it ends
  GatedDevice* gate_ = nullptr;       ///< the device, where there is a headset
  bool wants_second_hand_ = false;
  bool display_lost_ = false;
  std::unique_ptr<TickLog> log_;
  std::unique_ptr<BlackBox> black_box_;
  std::unique_ptr<TickRecorder>
      recorder_;  ///< passes ticks to the two above, and writes the recording
  Status recorded_ = Nothing{};
  std::unique_ptr<devices::SpaceMouse> second_hand_;
  std::optional<DeviceFault> second_hand_fault_;  ///< as it was told
  std::unique_ptr<FeltServer> server_;            ///< ends before session_ does: see end()
  std::unique_ptr<LiveSource> live_;              ///< likewise
  /// The window, once its display has gone away: the servo thread still uses its listener.
  std::unique_ptr<desktop::DesktopLoop> lost_window_;
  std::unique_ptr<Session>
      session_;      ///< ends its servo thread before the members above are destroyed
  Viewers viewers_;  ///< look at session_, which has been stopped
  std::unique_ptr<Gallery> gallery_;  ///< likewise
};

std::string text_of(const ServoPeriods& periods) {
  return fmt::format("period median {:.0f}, p99.9 {:.0f}, most {:.0f} us in {} ticks",
                     periods.median_us, periods.p999_us, periods.most_us, periods.ticks);
}

/// Runs the same scene and device with no other work, for comparison.
Result<ServoPeriods> periods_alone(FeelCommand command, CancelOnSignal& cancel) {
  constexpr double kAlone_s = 5.0;
  command.headset = "off";
  command.no_motion = command.quiet = true;
  command.seconds = kAlone_s;
  for (fs::path* file :
       {&command.headless, &command.csv, &command.picture, &command.record, &command.tubes})
    file->clear();
  command.tool.clear();
  if (command.device.device == "mouse" || command.device.device == "controller")
    command.device.device = "simulated";
  Console quiet(true, false);
  FeelRun run(command, quiet);
  const int rc = run.run(cancel);
  const auto periods = run.periods();
  if (rc != kExitOk || !periods)
    return Error{ErrorKind::kDeviceFailed, "The servo thread could not be run alone"};
  return *periods;
}

int replay_run(const FeelCommand& command, Console& console) {
  scenes::SequenceChoices choices = command.sequence;
  choices.finds_motion = false;  // as while it was recorded
  auto scene = scenes::load_scene(command.inputs, choices);
  if (!scene) return fail(console, scene.error());
  if (!command.tubes.empty())
    if (const Status can = files::check_can_write_vtk(command.tubes); !can)
      return fail(console, can.error());
  HandTubes tubes;
  const auto replayed = sessions::replay_felt(*scene, command.replay, tubes);
  if (!replayed) return fail(console, replayed.error());
  console.say(
      fmt::format("Replayed  {} ticks: {}", replayed->ticks, sessions::replay_text(*replayed)));
  if (!command.tubes.empty()) {
    if (const Status written = scenes::write_tubes(command.tubes, *tubes.tubes()); !written)
      return fail(console, written.error());
    console.say(tubes_text(*tubes.tubes()));
    console.say(fmt::format("Wrote     {}", command.tubes.string()));
  }
  return replayed->different ? kExitFailed : kExitOk;
}

}  // namespace

int run_feel(const FeelCommand& command) {
  // In this order: the emergency handlers first, so that those for Ctrl-C are put on top of them.
  emergency::install();
  CancelOnSignal cancel;
  Console console(command.quiet, command.json);
  if (!command.replay.empty()) return replay_run(command, console);
  if (!command.servo_report) return FeelRun(command, console).run(cancel);
  const Result<ServoPeriods> alone = periods_alone(command, cancel);
  if (!alone) return fail(console, alone.error());
  FeelRun run(command, console);
  const int rc = run.run(cancel);
  if (const auto joined = run.periods())
    console.say(fmt::format("Servo     alone: {}\n          in this run: {}", text_of(*alone),
                            text_of(*joined)));
  return rc;
}

}  // namespace palpate::app
