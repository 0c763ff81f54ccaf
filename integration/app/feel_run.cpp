#include "integration/app/feel_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "integration/app/advice.h"
#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_page.h"
#include "integration/app/feel_report.h"
#include "integration/app/outputs.h"
#include "integration/app/picture_file.h"
#include "integration/app/session_flags.h"
#include "integration/app/viewers.h"
#include "integration/devices/bus_devices.h"
#include "integration/files/atomic_file.h"
#include "integration/files/frames.h"
#include "integration/files/vtk_lines.h"
#include "integration/loading/tubes_file.h"
#include "integration/running/open_session.h"
#include "integration/running/replay.h"
#include "integration/web/live_page.h"
#include "integration/web/qr_code.h"
#include "integration/web/web_page.h"
#include "module/haptics/servo/emergency.h"
#include "module/session/gallery.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using headset::GatedDevice;
using running::FlightRecorder;
using running::NoteSource;
using running::PreparedSession;
using running::SessionRequest;

// a longer silence while reading is reported
constexpr auto kSilence = std::chrono::milliseconds(500);

/// How long the end of a run may take after a signal; the force is down in a tenth of a second.
constexpr std::chrono::seconds kPatience{20};

/// How often a run without a window looks what the servo thread does.
constexpr std::chrono::milliseconds kLook{50};
constexpr uint64_t kMostWaiting = 1024;  // ticks; the recorder has room for four times as many

/// How long the end of a run waits for the picture that is being drawn.
constexpr std::chrono::seconds kLastPicture{5};

/// What is felt, for titles: a sequence of many files has the name of their folder.
std::string name_of(const FeelCommand& command) {
  const std::string first = command.request.inputs.front().string();
  return openigtlink::is_address(first) ? first : files::sequence_name(command.request.inputs);
}

/// A mouse needs a window, a controller a headset. Errors: kBadInput, with the option that gives
/// one.
Status check_hand(const std::string& device, const running::OtherHands& others) {
  if (device == "controller" && !others.headset)
    return Error{
        ErrorKind::kBadInput,
        "A controller can be the hand only where there is a headset: add --headset openxr"};
  if (device != "mouse" || others.window) return Nothing{};
  return Error{ErrorKind::kBadInput,
               "A mouse can be the hand only where there is a window: add --headset none"};
}

/// One run of the loop with everything that listens to it.
class FeelRun {
 public:
  FeelRun(const FeelCommand& command, Console& console) : command_(command), console_(console) {}
  ~FeelRun() {
    if (connected_.session) end();  // after an exception
  }
  FeelRun(const FeelRun&) = delete;
  FeelRun& operator=(const FeelRun&) = delete;

  int run(CancelOnSignal& cancel) {
    cancel.end_at_once(true);
    if (const Status looking = choose_viewers(); !looking) return fail(console_, looking.error());

    // What else can be the hand, and whether that goes with the request.
    running::OtherHands others{viewers_.window != nullptr, viewers_.headset != nullptr, true,
                               command_.page_hand};
    // Only with a device that is simulated by choice: a real hand has the time that it has.
    if (command_.request.device == "simulated" && std::getenv("PALPATE_COMPUTED_TIME"))
      others.clock = &computed_time_.emplace();
    if (viewers_.headset && !command_.request.second_device.empty())
      return fail(console_, Error{ErrorKind::kBadInput,
                                  "In a headset one force device is felt: leave --second-device "
                                  "out, or add --headset off"});
    if (const Status met = check_hand(command_.request.device, others); !met)
      return fail(console_, met.error());
    if (const Status look = check_look(command_.view.look); !look)
      return fail(console_, look.error());
    if (!command_.headless.empty()) {
      auto outputs = Outputs::into(command_.headless);
      if (!outputs) return fail(console_, outputs.error());
      outputs_.emplace(std::move(*outputs));
    }
    if (const Status opened = open_page(); !opened) return fail(console_, opened.error());

    // Scene and device are read; then what a headset changes, and what is to be said of them.
    auto prepared = prepared_with(others);
    if (!prepared) return fail(console_, prepared.error());
    LoadedScene& scene = prepared->scene;
    // Before a headset lets hands move volumes, too: those need no second hand.
    const auto& volumes = scene.spec.volumes;
    if (std::any_of(volumes.begin(), volumes.end(), [](const VolumeSpec& volume) {
          return volume.drive.kind == DriveSpec::Kind::kSecondHand;
        })) {
      second_hand_ = devices::make_second_hand();
      if (!second_hand_)
        scene.notes.push_back(
            text_note("A SpaceMouse can not be used on this system: what it would move stays."));
    }
    if (prepared->leaves_motion_out)
      scene.notes.push_back(text_note(
          "No motion is estimated while recording: find it first with 'palpate motion', and name "
          "its folder with --fields."));
    if (viewers_.headset) fit_to_headset(scene, prepared->felt);
    for (const std::string& line : scene_lines(scene, connected_.live != nullptr))
      console_.say(line);
    if (command_.hand()) console_.say(fmt::format("Device    {}", prepared->felt.why));
    if (prepared->second_felt)
      console_.say(fmt::format("Second    {}", prepared->second_felt->why));
    for (const std::string& note : notes_of(scene)) console_.say("Note      " + note);
    console_.say("Shown     " + viewers_.why);

    // The session starts; from here on the signals end the run in order.
    add_viewers(prepared->options);
    if (const Status can = check_tubes(); !can) return fail(console_, can.error());
    if (const Status can = check_page(); !can) return fail(console_, can.error());
    const SceneSpec at_start = scene.spec;
    cancel.end_at_once(false);
    if (const Status started = start(*prepared); !started) return fail(console_, started.error());
    opened_ = std::move(prepared->felt);
    cancel.give_up_after(kPatience);
    begin_run(at_start);
    feel(cancel.token());
    return finish();
  }

  /// After all has been said: returns the exit code, or ends the program with it while a picture is
  /// still being drawn. A driver's call can not be interrupted, and nothing that it uses may be
  /// destroyed.
  int ended(int rc) {
    outputs_.reset();
    if (!still_draws_) return rc;
    std::fflush(nullptr);
    emergency::end_process(rc);
  }

  /// After run(): how the servo thread ran; null if it never did.
  const ServoStatistics* statistics() const {
    return connected_.session ? &connected_.session->statistics() : nullptr;
  }

 private:
  /// The slow work before the run: reading, and searching for a place to touch. Runs in parallel to
  /// the window, which stays responsive, and reports what it does.
  Result<PreparedSession> prepared_with(const running::OtherHands& others) {
    std::mutex mutex;
    std::string doing = "is being read";
    running::SessionCallbacks callbacks = session_callbacks();
    callbacks.on_doing = [&](const std::string& what) {
      const std::lock_guard lock(mutex);
      doing = what;
    };
    running::SessionHost host;
    host.others = others;
    host.sums_up = true;
    SessionRequest request = command_.request;
    if (request.shown_only) request.device = "none";
    // Motion that is found during the run is no part of a recording.
    if (!request.record.empty()) request.sequence.finds_motion = false;
    request.sequence.holds_frames = request.motion && request.record.empty();

    // The work on another thread; here what it does is shown.
    auto work = std::async(std::launch::async, [&] {
      return running::prepare_session(std::move(request), std::move(host), std::move(callbacks),
                                      connected_);
    });
    const auto begin = Clock::now();
    while (work.wait_for(std::chrono::milliseconds(15)) != std::future_status::ready) {
      std::string now;
      {
        const std::lock_guard lock(mutex);
        now = doing;
      }
      if (viewers_.window) viewers_.window->wait(now);
      if (viewers_.window && (viewers_.window->closed() || viewers_.window->lost())) {
        // Nothing has been written yet, and reading can not be stopped.
        console_.complain("palpate: The window was closed before anything was felt.");
        std::_Exit(kExitInternal);
      }
      if (Clock::now() - begin > kSilence) console_.live("Reading   " + now, "reading");
    }
    console_.end_progress();
    return work.get();
  }

  running::SessionCallbacks session_callbacks() {
    running::SessionCallbacks callbacks;
    // The device may be opened more than once; what is to be said of it is said once.
    callbacks.open_context = [this, said = std::make_shared<std::atomic<bool>>(false)] {
      Console quiet(true, false);
      return open_device(command_.gpu, said->exchange(true) ? quiet : console_);
    };
    callbacks.on_event = [this](const SessionEvent& event) { tell(event); };
    callbacks.on_note = [this](NoteSource source, const std::string& note) {
      console_.say((source == NoteSource::kLive ? "Live      " : "Tool      ") + note);
    };
    return callbacks;
  }

  /// The address is printed when the page can be used.
  Status open_page() {
    if (command_.request.web == 0) return Nothing{};
    web::LivePageOptions options;
    options.address = command_.request.web_address;
    options.port = uint16_t(command_.request.web);
    options.title = name_of(command_);
    options.view = command_.view;
    options.on_note = [this](const std::string& note) { console_.say("Page      " + note); };
    auto page = web::LivePage::start(std::move(options));
    if (!page) return page.error();
    page_ = std::move(*page);
    return Nothing{};
  }

  void tell_page() {
    const web::HttpsServer& server = page_->server();
    for (const std::string& address : server.page_addresses()) console_.say("Page      " + address);
    console_.say(fmt::format(
        "          its certificate is palpate's own, so that browsers warn; its SHA-256 is\n"
        "          {}",
        server.fingerprint()));
    // For a phone or a headset; an address of this machine alone is of no use to them.
    if (server.page_addresses().size() > 1 || command_.request.web_address != "127.0.0.1")
      console_.say(web::qr_text(server.page_addresses().back()));
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
    choice.panel = command_.panel;
    choice.refresh_hz = command_.refresh_hz;
    choice.calibrated = calibration_.has_value();
    choice.scene_name = name_of(command_);
    choice.gpu = command_.gpu;
    choice.view = command_.view;
    auto viewers = open_viewers(choice);
    if (!viewers) return viewers.error();
    viewers_ = std::move(*viewers);
    if (!command_.hand() && !viewers_.window && !viewers_.headset && command_.request.serve == 0)
      return Error{ErrorKind::kNoDevice,
                   "There is no display and no headset to view it in: --picture FILE.png or "
                   "--headless FOLDER draws pictures without"};
    return Nothing{};
  }

  /// A volume that stands still can be grabbed in the headset, and a controller needs the scene in
  /// true size.
  void fit_to_headset(LoadedScene& scene, const running::FeltDevice& felt) {
    make_movable(scene);
    if (!felt.controller && calibration_ && scene.spec.world_from_device.scale != glm::dvec3(1.0)) {
      scene.spec.world_from_device.scale = glm::dvec3(1.0);
      scene.notes.push_back(text_note(
          "The hand's movements are not enlarged: the picture stands where the device is."));
    }
  }

  /// What window and headset add to the loop.
  void add_viewers(SessionOptions& options) {
    SafetyOptions& safety = options.haptics.safety;
    if (viewers_.headset) GatedDevice::guard(safety);
    options.second_hand = second_hand_.get();
    if (command_.hand()) options.tube_buttons = headset::tube_buttons(safety);
    if (computed_time_)
      options.servo.real_time = {
          .priority = 0, .core = command_.request.core, .lock_memory = false, .cores_awake = false};
    if (viewers_.window) options.servo.listeners[1] = viewers_.window->listener();
  }

  Status check_page() const {
    return command_.page.empty() ? Nothing{} : web::check_can_write_page(command_.page);
  }

  Status check_tubes() const {
    if (!command_.hand() || command_.tubes.empty()) return Nothing{};
    return files::check_can_write_vtk(command_.tubes);
  }

  Status start(PreparedSession& prepared) {
    if (viewers_.headset) {
      auto gate = std::make_unique<GatedDevice>(std::move(connected_.device),
                                                command_.on_headset_loss == "go-on"
                                                    ? headset::OnHeadsetLoss::kGoOn
                                                    : headset::OnHeadsetLoss::kRamp);
      gate_ = gate.get();
      connected_.device = std::move(gate);
    }
    const HapticsOptions haptics = prepared.options.haptics;
    if (const Status started = running::start_session(prepared, connected_); !started)
      return started;
    const double wanted = prepared.scene.spec.stiffness_n_per_m;
    const double given = Haptics(haptics, connected_.device->info())
                             .stiffness_on_device(*connected_.session->scene(), wanted);
    if (given < wanted)
      console_.say(
          fmt::format("Note      The spring is {:.0f} N/m instead of {:.0f}: more would make this "
                      "device vibrate.",
                      given, wanted));
    return Nothing{};
  }

  /// The end of the run; a simulated hand presses once, or once more after the motion is known.
  double end_s(double motion_known_s) const {
    if (command_.seconds > 0.0) return command_.seconds;
    if (!opened_.is_simulated) return 1e12;
    return motion_known_s + opened_.path_s + 0.5;
  }

  /// Starts who draws, who looks, and who is served.
  void begin_run(const SceneSpec& scene) {
    if (outputs_) {
      GalleryOptions options;
      options.gpu.device = command_.gpu.device;
      options.view = command_.view;
      options.size = {command_.picture_size, command_.picture_size};
      gallery_ = std::make_unique<Gallery>(*connected_.session, options);
    }
    begin_viewers(scene);
    if (page_) {
      page_->begin(*connected_.session, opened_.page);
      tell_page();
    }
    if (connected_.server) {
      console_.say(fmt::format("Serve     {}, by OpenIGTLink at port {}",
                               command_.hand() ? "what is felt" : "the moved volume and its motion",
                               connected_.server->port()));
    }
    if (command_.json) print(serving_json(connected_, page_ ? &page_->server() : nullptr));
  }

  /// The run, until its end: a look every few milliseconds, while the loop has its own thread.
  void feel(std::stop_token stop) {
    const LiveMotion& motion = connected_.session->motion();
    const auto begin = Clock::now();
    const int64_t begin_ns = computed_time_ ? computed_time_->now_ns() : 0;
    TickOutput tick;
    double motion_known_s = motion.is_done() ? 0.0 : 1e12;
    double now_s = 0.0;
    while (now_s < end_s(motion_known_s) && !stop.stop_requested() && !emergency::is_asked() &&
           !viewers_ended()) {
      // Motion and pictures are computed in real time, and the hand is not to be through before.
      if (viewers_.window)
        viewers_.window->frame(tick, motion_text(motion));
      else if (!computed_time_ || !motion.is_done() || gallery_)
        std::this_thread::sleep_for(kLook);
      // Computed time must not outrun those who write its ticks.
      while (computed_time_ && (connected_.flight.waiting() > kMostWaiting ||
                                connected_.second_flight.waiting() > kMostWaiting))
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (computed_time_ && !waits_for_picture(now_s, begin))
        computed_time_->let_pass(std::chrono::nanoseconds(kLook).count());
      now_s = computed_time_ ? 1e-9 * double(computed_time_->now_ns() - begin_ns)
                             : std::chrono::duration<double>(Clock::now() - begin).count();
      connected_.session->newest(0, tick);
      tell_now(tick, now_s);
      if (motion.is_done() && motion_known_s == 1e12) motion_known_s = now_s;
    }
    console_.end_progress();
    end();
    tell_headset();
    display_lost_ = viewers_.window && viewers_.window->lost();
    if (display_lost_ && connected_.flight.black_box())
      connected_.flight.black_box()->write_last("display-lost");
  }

  bool viewers_ended() {
    return (viewers_.window && viewers_.window->closed()) || display_was_needed_and_lost() ||
           (viewers_.headset && viewers_.headset->ended());
  }

  /// The line that says what is felt now, and what has happened.
  void tell_now(const TickOutput& tick, double now_s) {
    tell_second_hand();
    tell_second_device();
    tell_headset();
    const LiveMotion& motion = connected_.session->motion();
    std::string line = live_text(tick, connected_.session->statistics(), now_s);
    if (!motion.is_done()) line += "  " + motion_text(motion);
    if (page_) page_->set_note(motion_text(motion));
    if (connected_.live) line += "  " + connected_.live->live_text();
    if (command_.hand()) console_.live(line, state_text(tick));
  }

  /// Whether computed time stands still until the first picture is drawn, for at most a minute.
  bool waits_for_picture(double now_s, Clock::time_point begin) const {
    constexpr double kTouched_s = 0.2;
    return gallery_ && now_s > kTouched_s && gallery_->frames() == 0 &&
           gallery_->trouble().empty() && Clock::now() - begin < std::chrono::minutes(1);
  }

  /// Ends the session, so that the force goes to zero whatever is being drawn; then the viewers.
  /// Further calls do nothing.
  void end() {
    if (is_ended_) return;
    is_ended_ = true;
    if (computed_time_) computed_time_->let_go();
    if (page_) {
      page_traffic_ = page_->server().traffic();
      page_->end();
    }
    connected_.stop();
    kept_ = connected_.flight.finish();
    if (connected_.second)
      if (const Status kept = connected_.second_flight.finish(); kept_ && !kept) kept_ = kept;
    if (viewers_.window) viewers_.window->end();
    if (viewers_.headset) viewers_.headset->end();
    if (gallery_) still_draws_ = !gallery_->stop(kLastPicture);
  }

  /// True if the run needed the window and its display is gone; with a headset the run goes on.
  bool display_was_needed_and_lost() {
    if (!viewers_.window || !viewers_.window->lost()) return false;
    if (!viewers_.headset) return true;
    viewers_.window->end();
    lost_window_ = std::move(viewers_.window);
    console_.complain("palpate: The display of the window has gone away; the headset goes on.");
    return false;
  }

  void begin_viewers(const SceneSpec& scene) {
    if (viewers_.window) viewers_.window->begin(*connected_.session, opened_.mouse);
    if (!viewers_.headset) return;
    headset::HeadsetScene joined;
    joined.session = connected_.session.get();
    joined.gate = gate_;
    joined.controller = opened_.controller;
    joined.max_force_n = scene.max_force_n;
    joined.view = command_.view;
    joined.sound = command_.sound;
    joined.dead_man = command_.request.dead_man;
    joined.calibration = calibration_;
    joined.device_centre_m =
        scene.world_from_device.world_from_volume(connected_.device->info().workspace_centre_m);
    viewers_.headset->begin(joined);
  }

  void tell_headset() {
    if (!viewers_.headset) return;
    for (const headset::HeadsetEvent& event : viewers_.headset->news())
      console_.say("Headset   " + advised(event));
  }

  /// Reports when the device of a second hand is lost or comes back.
  void tell_second_device() {
    if (!connected_.second) return;
    TickOutput tick;
    connected_.second->newest(0, tick);
    if (std::exchange(second_fault_, tick.fault) == tick.fault) return;
    console_.say(fmt::format("Second    {}", tick.fault == DeviceFault::kNone
                                                 ? "the device answers"
                                                 : sentence(tick.fault)));
  }

  /// Reports when the second hand is connected, is lost or can not be used.
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

  /// Prints the session's events; called on a thread of the session.
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

  void tell_what_was_sent() {
    if (connected_.server)
      console_.say(
          fmt::format("Serve     {} messages were sent; {} were left out because a client "
                      "was slow",
                      connected_.server->server().sent(), connected_.server->server().missed()));
  }

  void tell_page_numbers() {
    if (!page_) return;
    const web::HttpsServer::Traffic traffic = page_traffic_;
    console_.say(fmt::format(
        "Page      {} viewers; {} states were sent, {} left out because a viewer was slow; {} "
        "requests and viewers were refused",
        traffic.joined, traffic.sent, traffic.left_out, traffic.refused));
  }

  int finish() {
    if (!command_.hand()) {
      if (connected_.live) console_.say(connected_.live->summary());
      tell_what_was_sent();
      if (command_.json) print(served_json(connected_));
      tell_page_numbers();
      return kept_ ? kExitOk : fail(console_, kept_.error());
    }
    tell_page_numbers();
    if (command_.json) print(served_json(connected_));
    const Session& session = *connected_.session;
    const std::string summary =
        summary_text(connected_.flight.log()->numbers(), session.statistics(), session.report(),
                     session.haptics().tank().ledger());
    const Status done = write_files(summary);
    tell_what_was_felt(summary);
    tell_files(bool(done));
    if (viewers_.headset) tell_headset_numbers();
    if (!done) return fail(console_, done.error());
    if (!display_lost_) return kExitOk;
    console_.complain(
        "palpate: The display has gone away (its X server or the connection to it ended), so the "
        "force was ramped down and the run ended.");
    return kExitInternal;
  }

  /// Writes the files that need the whole run, until one of them can not be written.
  Status write_files(const std::string& summary) {
    Status done = kept_;
    const Session& session = *connected_.session;
    if (!command_.tubes.empty() && done)
      done = loading::write_tubes(command_.tubes, *session.tubes());
    const auto& rows = connected_.flight.log()->rows();
    const FeelNumbers numbers = connected_.flight.log()->numbers();
    if (!command_.picture.empty() && done)
      done = write_feel_picture(command_.picture.string(), "Feeling " + name_of(command_), numbers,
                                rows);
    if (gallery_ && done) done = publish(summary);
    if (!command_.page.empty() && done)
      done = write_feel_page(command_.page, "Feeling " + name_of(command_),
                             *session.scene()->volumes.front().data, numbers, rows, summary);
    return done;
  }

  /// What was felt, and by whom.
  void tell_what_was_felt(const std::string& summary) {
    console_.say(summary);
    if (connected_.second)
      console_.say("Second hand" + summary_text(connected_.second_flight.log()->numbers(),
                                                connected_.second->statistics(),
                                                connected_.second->report(),
                                                connected_.second->haptics().tank().ledger()));
    const std::shared_ptr<const ReleasedTubes> tubes = connected_.session->tubes();
    if (!tubes->empty()) console_.say(tubes_text(*tubes));
    if (connected_.tool) console_.say(connected_.tool->summary());
    if (connected_.live) console_.say(connected_.live->summary());
    tell_what_was_sent();
  }

  /// Which files there are. done: all could be written.
  void tell_files(bool done) {
    FlightRecorder& flight = connected_.flight;
    if (BlackBox* const box = flight.black_box()) {
      for (const fs::path& file : box->files())
        console_.say(fmt::format("Wrote     {}: the ticks around a fault", file.string()));
      if (const auto trouble = box->trouble()) console_.complain(*trouble);
    }
    if (!command_.request.csv.empty()) tell_written(command_.request.csv);
    if (!command_.picture.empty())
      console_.say(fmt::format("Wrote     {}", command_.picture.string()));
    if (!command_.page.empty() && done)
      console_.say(fmt::format("Wrote     {}", command_.page.string()));
    if (!command_.request.record.empty()) tell_written(command_.request.record);
    if (const auto lost = flight.lost()) console_.complain("palpate: " + *lost);
    if (const auto lost = connected_.second_flight.lost()) console_.complain("palpate: " + *lost);
    if (!command_.tubes.empty() && done)
      console_.say(fmt::format("Wrote     {}", command_.tubes.string()));
    if (gallery_ && done) tell_gallery();
  }

  /// Names a file of the ticks, and that of a second hand.
  void tell_written(const fs::path& file) {
    console_.say(fmt::format("Wrote     {}", file.string()));
    if (connected_.second)
      console_.say(fmt::format("Wrote     {}", running::second_file(file).string()));
  }

  /// Publishes page, views and summary, all or none.
  Status publish(const std::string& summary) {
    if (!gallery_->trouble().empty())
      console_.complain("palpate: There are no views of the volume: " + gallery_->trouble());
    const charts::Timeline timeline =
        feel_timeline("", connected_.flight.log()->numbers(), connected_.flight.log()->rows());
    const std::string title = "Feeling " + name_of(command_);
    ScenePicture of_slices(command_.view);
    of_slices.update(connected_.session->scene());
    Status done =
        stage_views(*outputs_, gallery_->pictures(), command_.view.slices ? &of_slices : nullptr,
                    TimeStrip(connected_.session->scene(), false), title, timeline, command_.view);
    if (!done) return done;
    const auto path = outputs_->stage("summary.txt");
    if (!path) return path.error();
    done = files::write_text(*path, summary.substr(1));
    return done ? outputs_->publish() : Status(outputs_->in_place(done.error()));
  }

  void tell_headset_numbers() {
    const headset::HeadsetLoop::Numbers& numbers = viewers_.headset->numbers();
    std::string last;
    // A pair for the eyes; some headsets have a second one.
    for (size_t view = 0; view < numbers.sizes.size(); view += 2)
      last += fmt::format("{}2 x {} x {}", view == 0 ? ", the last of " : " and ",
                          numbers.sizes[view].width, numbers.sizes[view].height);
    if (!last.empty()) last += fmt::format(" in {:.1f} ms on the device", numbers.picture_ms);
    console_.say(fmt::format("Headset   {} frames in {} sessions, {} of them with a picture{}",
                             numbers.frames, numbers.sessions, numbers.drawn, last));
  }

  void tell_gallery() {
    const std::string page = (command_.headless / "page.png").string();
    if (gallery_->frames() == 0) {
      console_.say(
          fmt::format("Shown     no picture: the run ended before the first one was drawn\n"
                      "Look at\n  {}   what was felt, on one page",
                      page));
      return;
    }
    console_.say(
        fmt::format("Shown     {} stereo pictures of 2 x {} x {}, {:.0f} ms each (median), the "
                    "first after {:.1f} s",
                    gallery_->frames(), command_.picture_size, command_.picture_size,
                    gallery_->median_ms(), gallery_->first_picture_s()));
    console_.say(fmt::format(
        "Look at\n  {}   what was seen and felt, on one page\n  {}   a view for two eyes", page,
        (command_.headless / "view_1.png").string()));
  }

  const FeelCommand& command_;
  Console& console_;
  std::optional<Outputs> outputs_;
  std::optional<files::StoredCalibration> calibration_;
  running::FeltDevice opened_;
  bool display_lost_ = false;
  bool is_ended_ = false, still_draws_ = false;
  Status kept_ = Nothing{};                        ///< whether table and recording are complete
  DeviceFault second_fault_ = DeviceFault::kNone;  ///< of the device of a second hand
  std::unique_ptr<SecondHand> second_hand_;
  std::optional<DeviceFault> second_hand_fault_;  ///< as it was told
  /// The window, once its display has gone away: the servo thread still uses its listener.
  std::unique_ptr<desktop::DesktopLoop> lost_window_;
  /// For tests (environment variable PALPATE_COMPUTED_TIME): the simulated hand's time passes as
  /// fast as it is computed.
  std::optional<ComputedClock> computed_time_;
  /// Ends its servo thread before the members above are destroyed.
  running::ConnectedSession connected_;
  GatedDevice* gate_ = nullptr;          ///< its device, where there is a headset
  Viewers viewers_;                      ///< look at the session, which has been stopped
  std::unique_ptr<Gallery> gallery_;     ///< likewise
  std::unique_ptr<web::LivePage> page_;  ///< moves the session's device: ends before it
  web::HttpsServer::Traffic page_traffic_;
};

/// Runs the same scene and device with no other work, for comparison: how its servo thread ran.
Result<std::string> periods_alone(FeelCommand command, CancelOnSignal& cancel) {
  constexpr double kAlone_s = 5.0;
  SessionRequest& request = command.request;
  command.headset = "off";
  request.motion = false;
  command.quiet = true;
  command.seconds = kAlone_s;
  for (fs::path* file : {&command.headless, &request.csv, &command.picture, &command.page,
                         &request.record, &command.tubes})
    file->clear();
  if (request.device == "mouse" || request.device == "controller") request.device = "simulated";
  if (openigtlink::is_address(request.device)) request.device = "auto";
  Console quiet(true, false);
  FeelRun run(command, quiet);
  const int rc = run.run(cancel);
  if (rc != kExitOk || !run.statistics())
    return Error{ErrorKind::kDeviceFailed, "The servo thread could not be run alone"};
  return periods_text(*run.statistics());
}

int replay_run(const FeelCommand& command, Console& console) {
  loading::SequenceChoices choices = command.request.sequence;
  choices.finds_motion = false;  // as during the recording
  auto scene = loading::load_scene(command.request.inputs, choices);
  if (!scene) return fail(console, scene.error());
  if (!command.tubes.empty())
    if (const Status can = files::check_can_write_vtk(command.tubes); !can)
      return fail(console, can.error());
  HandTubes tubes;
  const auto replayed = running::replay_felt(*scene, command.replay, tubes);
  if (!replayed) return fail(console, replayed.error());
  console.say(
      fmt::format("Replayed  {} ticks: {}", replayed->ticks, running::replay_text(*replayed)));
  if (!command.tubes.empty()) {
    if (const Status written = loading::write_tubes(command.tubes, *tubes.tubes()); !written)
      return fail(console, written.error());
    console.say(tubes_text(*tubes.tubes()));
    console.say(fmt::format("Wrote     {}", command.tubes.string()));
  }
  return replayed->different ? kExitFailed : kExitOk;
}

}  // namespace

int run_feel(const FeelCommand& command) {
  // In this order: the emergency handlers first, so that those for Ctrl-C are installed over them.
  emergency::install();
  CancelOnSignal cancel;
  Console console(command.quiet, command.json);
  if (!command.replay.empty()) return replay_run(command, console);
  if (!command.servo_report) {
    FeelRun run(command, console);
    return run.ended(run.run(cancel));
  }
  const Result<std::string> alone = periods_alone(command, cancel);
  if (!alone) return fail(console, alone.error());
  FeelRun run(command, console);
  const int rc = run.run(cancel);
  if (run.statistics())
    console.say(fmt::format("Servo     alone: {}\n          in this run: {}", *alone,
                            periods_text(*run.statistics())));
  return run.ended(rc);
}

}  // namespace palpate::app
