#include "integration/headset/headset_loop.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "compute/vulkan/caught.h"
#include "integration/charts/slice_panel.h"
#include "integration/headset/held_models.h"
#include "integration/headset/place_check.h"
#include "integration/sound/contact_sound.h"
#include "module/haptics/scene/snapshot_ahead.h"
#include "module/haptics/servo/monotonic.h"
#include "module/haptics/servo/real_time.h"
#include "module/xr/vibration.h"

namespace palpate::headset {
namespace {

using namespace std::chrono_literals;

constexpr int64_t kShown_ns = 2'000'000'000;    // without a frame for this long the program hangs
constexpr int64_t kDeadMan_ns = 500'000'000;    // releasing must not wait for a slow frame
constexpr auto kPause = 10ms;                   // if no display paces the loop
constexpr double kNear_m = 0.45, kFar_m = 0.9;  // distance of the scene's centre from the eyes
constexpr double kBelow_m = 0.15;               // and its distance below them
constexpr double kRoom = 1.5;                   // of the scene's radius, at least
constexpr double kFinger_m = 0.004;  // radius of the ball at a fingertip that does not pinch
constexpr glm::dvec3 kFinger{0.45, 0.48, 0.54};
constexpr double kPanelWidth_m = 0.5, kPanelAway_m = 0.85;
constexpr double kPanelAside = 0.75;  // angle to the left of the scene, radians
constexpr double kLongest_s = 0.1;    // a longer frame counts as this

bool is_shown(xr::HeadsetState state) {
  return state == xr::HeadsetState::kVisible || state == xr::HeadsetState::kFocused;
}

/// Straight ahead, level; if the head looks straight up or down, the direction of its top.
glm::dvec3 ahead_of(const Pose& head) {
  glm::dvec3 ahead = head.rotation * glm::dvec3(0.0, 0.0, -1.0);
  if (std::abs(ahead.y) > 0.98)
    ahead = head.rotation * glm::dvec3(0.0, ahead.y > 0 ? -1.0 : 1.0, 0.0);
  ahead.y = 0.0;
  return glm::normalize(ahead);
}

}  // namespace

/// The state that only the thread uses.
class HeadsetLoop::Run {
 public:
  Run(HeadsetLoop& loop, const HeadsetLoopOptions& options)
      : loop_(loop),
        options_(options),
        source_([this](const xr::HeadsetFrame& frame) { return show(frame); }),
        headset_(asked_of_headset(options), source_) {}

  void live(std::stop_token stop) {
    give_way(BackgroundWork::kPictures);
    while (true) {
      const int64_t now_ns = monotonic_ns();
      if (stop.stop_requested() && !ending_) {
        headset_.end(now_ns);
        ending_ = true;
      }
      const xr::Report& report = headset_.step(now_ns);
      take(report, now_ns);
      if (report.state == xr::HeadsetState::kEnded || report.state == xr::HeadsetState::kNoRuntime)
        break;
      if (report.state == xr::HeadsetState::kWaiting || report.state == xr::HeadsetState::kIdle)
        std::this_thread::sleep_for(kPause);
    }
    count();
  }

 private:
  static xr::HeadsetOptions asked_of_headset(const HeadsetLoopOptions& options) {
    xr::HeadsetOptions asked;
    asked.overlay = options.overlay;
    asked.refresh_hz = options.refresh_hz;
    if (!options.calibrated) asked.origin = xr::Origin::kLocalFloor;
    if (options.pass_through) asked.blend = xr::BlendMode::kAlpha;
    return asked;
  }

  void take(const xr::Report& report, int64_t now_ns) {
    if (!report.sentence.empty())
      loop_.tell(report.sentence == report.problem.message
                     ? xr::problem_text(report.problem, options_.details)
                     : report.sentence);
    if (!source_.trouble().empty() && source_.trouble() != trouble_)
      loop_.tell("There is no picture: " + source_.trouble());
    trouble_ = source_.trouble();
    if (source_.preparing() && !preparing_)
      loop_.tell(
          "The picture is being prepared: the data go to the device, and its kernels are "
          "compiled.");
    preparing_ = source_.preparing();
    if (report.main_visible != main_visible_)
      loop_.tell(report.main_visible ? "The program below is visible again."
                                     : "The program below is not visible now, only palpate is.");
    main_visible_ = report.main_visible;
    tell_found(report);
    tell_tracking(report);
    tell_models(report);
    tell_panel(report);
    tell_rate(report);
    tell_sound();
    if (!scene_) begin();
    if (scene_) gate(report, now_ns);
    if (scene_ && report.frames != frames_) act(report, now_ns);
    frames_ = report.frames;
    if (report.state == xr::HeadsetState::kEnded) loop_.ended_ = true;
  }

  /// Explains, once, how bare hands are used; reports if the runtime does not show them.
  void tell_tracking(const xr::Report& report) {
    if (!scene_ || !scene_->controller) return;
    if (report.hand_tracking && !tracking_told_)
      loop_.tell(
          "Without a controller, pinch to touch: hold thumb and forefinger together. A short pinch "
          "lays a stream tube; two short pinches in a row keep the tubes.");
    tracking_told_ |= report.hand_tracking;
    if (report.no_hand_tracking != no_tracking_ && !report.no_hand_tracking.empty())
      loop_.tell(
          fmt::format("The runtime does not give the joints of bare hands in this session{}.",
                      options_.details ? ": " + report.no_hand_tracking : ""));
    no_tracking_ = report.no_hand_tracking;
  }

  /// Says once that controllers are not seen, and why.
  void tell_models(const xr::Report& report) {
    if (const std::string trouble = models_.take_trouble(); !trouble.empty())
      loop_.tell("A controller is not drawn. " + trouble);
    if (report.no_controller_models != no_models_ && !report.no_controller_models.empty())
      loop_.tell(fmt::format("The runtime does not give the shapes of its controllers{}.",
                             options_.details ? ": " + report.no_controller_models : ""));
    no_models_ = report.no_controller_models;
    const bool held = report.hands.hand[0].active || report.hands.hand[1].active;
    if (!held || models_told_ || report.controller_models || !no_models_.empty()) return;
    models_told_ = true;
    loop_.tell(
        "Controllers are not drawn: the runtime does not give their shapes "
        "(XR_EXT_interaction_render_model).");
  }

  /// Says once that the world may not follow a person who recentres.
  void tell_floor(const xr::Report& report) {
    if (options_.calibrated || floor_told_ || report.origin == xr::Origin::kLocalFloor) return;
    floor_told_ = true;
    loop_.tell(
        "The runtime has no floor that follows you when you recentre (XR_EXT_local_floor): if the "
        "volume stays behind, grab it or bring it in front of you.");
  }

  void tell_panel(const xr::Report& report) {
    if (report.no_panel != no_panel_ && !report.no_panel.empty())
      loop_.tell(fmt::format("The runtime shows no text beside the volume{}.",
                             options_.details ? ": " + report.no_panel : ""));
    no_panel_ = report.no_panel;
  }

  /// Says which rate the display is to have, and why, once for each choice; and when the runtime
  /// takes another one.
  void tell_rate(const xr::Report& report) {
    const xr::DisplayRate& rate = report.display;
    if (options_.refresh_hz > 0.0 && report.sessions > 0 && rate.offered_hz.empty() &&
        rate.refused.empty() && !no_rates_told_) {
      no_rates_told_ = true;
      loop_.tell("The runtime lets no program choose the display's rate: it stays as it is.");
    }
    if (rate.refused != no_rate_ && !rate.refused.empty())
      loop_.tell(fmt::format("The runtime did not change the display's rate{}.",
                             options_.details ? ": " + rate.refused : ""));
    no_rate_ = rate.refused;
    // A session may choose in the step in which it begins.
    if (report.sessions != rate_sessions_) asked_hz_ = 0.0;
    rate_sessions_ = report.sessions;
    if (rate.hz != reported_hz_) {
      if (asked_hz_ > 0.0 && rate.hz != expected_hz_)
        loop_.tell(fmt::format("The runtime has changed the display's rate to {:g} Hz.", rate.hz));
      expected_hz_ = reported_hz_ = rate.hz;
    }
    if (rate.chosen_hz > 0.0 && asked_hz_ == 0.0) {
      expected_hz_ = rate.chosen_hz;
      if (rate.chosen_hz != told_hz_)
        loop_.tell(fmt::format("The display is to run at {:g} Hz, of {:g}{}.", rate.chosen_hz,
                               fmt::join(rate.offered_hz, ", "),
                               rate.needed_s > 0.0
                                   ? fmt::format(": a picture needs {:.1f} ms", 1e3 * rate.needed_s)
                                   : ""));
      told_hz_ = rate.chosen_hz;
    }
    asked_hz_ = rate.chosen_hz;
  }

  void tell_sound() {
    if (sound_)
      if (const std::string trouble = sound_->take_trouble(); !trouble.empty()) loop_.tell(trouble);
  }

  void tell_found(const xr::Report& report) {
    const std::lock_guard lock(loop_.mutex_);
    if (loop_.found_) return;
    const bool there = report.sessions > 0;
    const bool runtime = report.state != xr::HeadsetState::kNoRuntime;
    loop_.found_ =
        Availability{runtime, there, report.problem.trouble == xr::Trouble::kUnsupported && !there,
                     there ? report.system + " through " + report.runtime
                           : xr::problem_text(report.problem, options_.details)};
    loop_.changed_.notify_all();
  }

  void begin() {
    const std::lock_guard lock(loop_.mutex_);
    if (!loop_.scene_) return;
    scene_ = *loop_.scene_;
    hands_ = std::make_unique<SceneHands>(*scene_->session, scene_->view);
    picture_ = std::make_unique<ScenePicture>(scene_->view);
    if (options_.panel) slices_ = std::make_unique<LiveSlices>(*scene_->session);
  }

  void gate(const xr::Report& report, int64_t now_ns) {
    const bool shown = is_shown(report.state);
    // Nothing is told or gated while the loop ends: the session is to be stopped next.
    if (ending_ || report.state == xr::HeadsetState::kEnded) return;
    if (shown != shown_ && was_shown_)
      loop_.tell(shown ? "The picture is back in the headset."
                 : scene_->gate->on_loss() == OnHeadsetLoss::kRamp
                     ? "The picture in the headset is gone: the force goes down until it is back."
                     : "The picture in the headset is gone: the force goes on.");
    shown_ = shown;
    was_shown_ |= shown;
    if (scene_->gate->on_loss() == OnHeadsetLoss::kRamp)
      scene_->gate->shown_until(shown ? now_ns + kShown_ns : 0);
    scene_->gate->dead_man_until(xr::dead_man_held(report.hands) ? now_ns + kDeadMan_ns : 0);
  }

  /// The work of each frame.
  void act(const xr::Report& report, int64_t now_ns) {
    const double dt_s = last_ns_ ? std::min(1e-9 * double(now_ns - last_ns_), kLongest_s) : 0.0;
    last_ns_ = now_ns;
    if (report.sessions != sessions_) {
      sessions_ = report.sessions;
      if (options_.pass_through && report.blend == xr::BlendMode::kOpaque)
        loop_.tell({HeadsetEvent::Kind::kNoPassThrough,
                    "This headset does not show the room behind the volume."});
      tell_floor(report);
      if (!headset_.colocation().keeps()) placed_ = false;
    }
    if (!placed_) {
      // The hands' actions of this frame were relative to the former place of the world: drop them.
      if (head_) place(report);
      return;
    }
    xr::Hands hands = report.hands;
    if (check_) {
      auto said =
          check_->step(1e-9 * double(now_ns), snapshot_.probe_m, headset_.colocation(), hands);
      if (said) loop_.tell(std::move(*said));
    }
    hands_->step(hands, snapshot_, dt_s);
    if (report.hands.recentre) bring_here();
    if (report.hands.panel) shows_panel_ = !shows_panel_;
    write_panel(report, now_ns);
    if (scene_->controller) feel(report.hands, dt_s);
  }

  /// Places the world of the scene in the room.
  void place(const xr::Report& report) {
    const auto felt = scene_->session->scene();
    xr::Colocation& room = headset_.colocation();
    placed_ = true;
    if (scene_->calibration && !room.keeps()) {
      if (scene_->calibration->space == xr::name(report.origin)) {
        const Transform& device = felt->world_from_device;
        hang_panel(inverse(room.world_from_base()) * *head_);
        room.keep(scene_->calibration->calibration.stage_from_device,
                  {device.translation_m, device.rotation});
        check_.emplace(scene_->calibration->calibration.controller_from_tip_m);
        return;
      }
      loop_.tell({HeadsetEvent::Kind::kOtherSpace,
                  fmt::format("The calibration belongs to the {} space, which this runtime does "
                              "not have now.",
                              scene_->calibration->space)});
      scene_->calibration.reset();
    } else if (!scene_->controller && !guess_told_) {
      guess_told_ = true;
      loop_.tell({HeadsetEvent::Kind::kNoCalibration,
                  "Where the force device stands in this room is a guess, so what is felt is not "
                  "where it is seen."});
    }
    glm::dvec3 centre;
    double radius_m = 0.0;
    picture_->bounds(snapshot_, centre, radius_m);
    const Pose room_from_head = inverse(room.world_from_base()) * *head_;
    const glm::dvec3 ahead = ahead_of(room_from_head);
    Pose room_from_world;
    // The world's z axis, the patient's front, towards the person.
    room_from_world.rotation = glm::angleAxis(std::atan2(-ahead.x, -ahead.z), glm::dvec3(0, 1, 0));
    const double distance_m = std::clamp(kRoom * radius_m, kNear_m, kFar_m);
    const glm::dvec3 target =
        room_from_head.position_m + distance_m * ahead - glm::dvec3(0.0, kBelow_m, 0.0);
    room_from_world.position_m = target - room_from_world.rotation * centre;
    hang_panel(room_from_head);
    room.follow(inverse(room_from_world));
    head_.reset();
  }

  /// Moves the world to the force device or, without one, in front of the person.
  void bring_here() {
    if (!head_) return;
    glm::dvec3 centre;
    double radius_m = 0.0;
    picture_->bounds(snapshot_, centre, radius_m);
    const double distance_m = std::clamp(kRoom * radius_m, kNear_m, kFar_m);
    const glm::dvec3 before =
        head_->position_m + distance_m * ahead_of(*head_) - glm::dvec3(0.0, kBelow_m, 0.0);
    hands_->bring(centre, scene_->controller ? before : scene_->device_centre_m, head_->position_m);
    hang_panel(inverse(headset_.colocation().world_from_base()) * *head_);
  }

  /// Hangs the panel to the left of where the person looks, turned to the person.
  void hang_panel(const Pose& room_from_head) {
    const glm::dvec3 up(0.0, 1.0, 0.0);
    const glm::dvec3 to_panel = glm::angleAxis(kPanelAside, up) * ahead_of(room_from_head);
    room_from_panel_.rotation = glm::angleAxis(std::atan2(-to_panel.x, -to_panel.z), up);
    room_from_panel_.position_m = room_from_head.position_m + kPanelAway_m * to_panel;
  }

  /// Asks for a panel that says what is felt and shown, and what the buttons do.
  void write_panel(const xr::Report& report, int64_t now_ns) {
    if (!slices_ || !shows_panel_) return;
    const ViewChoices& view = hands_->view();
    if (view.slices) slices_->want({snapshot_, view, charts::slice_edge_px(kRoomPanelHeight_px)});
    RoomText text;
    text.slices = view.slices ? slices_->newest() : nullptr;
    text.colours = tube_colours_;
    if (view.hand) {
      const bool free = snapshot_.cause == Cause::kNone;
      text.force = fmt::format("{:.1f} N", glm::length(snapshot_.force_n));
      text.state = !free                  ? sentence(snapshot_.cause)
                   : snapshot_.in_contact ? "touching"
                                          : "nothing is touched";
    }
    text.lines = charts::time_lines(*scene_->session->scene(), snapshot_);
    if (view.look != "auto") text.lines.push_back("look: " + view.look);
    if (!trouble_.empty()) text.lines.push_back("There is no picture: " + trouble_);
    text.help = help(report.hands);
    panel_.want(text, now_ns);
  }

  /// For the controllers, or the hands, that were seen last.
  const std::vector<ButtonHelp>& help(const xr::Hands& hands) {
    const bool controllers = hands.hand[0].active || hands.hand[1].active;
    const bool fingers = hands.fingers[0].seen || hands.fingers[1].seen;
    if (controllers) {
      const size_t side = hands.hand[1].active ? 1 : 0;
      const std::string trigger = scene_->dead_man     ? "Hold to feel the force"
                                  : scene_->controller ? "Lay a stream tube"
                                                       : "";
      help_ = button_help(hands.hand[side].profile, trigger);
    } else if (fingers && scene_->controller) {
      help_ = {
          {"pinch", "Touch"}, {"short pinch", "Lay a stream tube"}, {"twice", "Keep the tubes"}};
    }
    return help_;
  }

  /// Moves the probe with a controller or a bare finger. If no hand holds it, the force ramps to
  /// zero.
  void feel(const xr::Hands& hands, double dt_s) {
    hold_ = probe_hand_.step(hands, dt_s);
    if (hold_.asks_for_tube) scene_->session->release_tube();
    if (hold_.asks_to_keep) scene_->session->keep_tubes();
    if (hold_.by == ProbeHold::By::kNobody) {
      scene_->controller->let_go();
      was_touching_ = false;
      return;
    }
    const Transform& device = scene_->session->scene()->world_from_device;
    scene_->controller->hold(device.volume_from_world(hold_.tip_m), hold_.buttons);
    if (hold_.by == ProbeHold::By::kController) {
      headset_.vibrate(hold_.side,
                       xr::vibration(glm::length(snapshot_.force_n), scene_->max_force_n));
      return;
    }
    if (!sound_ && scene_->sound) sound_ = std::make_unique<sound::ContactSound>();
    if (sound_ && snapshot_.in_contact && !was_touching_) sound_->play();
    was_touching_ = snapshot_.in_contact;
  }

  /// Draws what holds the probe: a pen, a fingertip, or only fingertips that do not pinch.
  void show_probe(ViewChoices& view) const {
    if (!scene_->controller) return;
    view.full_force_n = scene_->max_force_n;
    view.fingertip = hold_.by == ProbeHold::By::kFinger;
    view.hand = view.hand && hold_.by != ProbeHold::By::kNobody;
  }

  void add_fingers(Things& things) const {
    if (!scene_->controller) return;
    for (const size_t side : {size_t(0), size_t(1)}) {
      const bool feels = hold_.by == ProbeHold::By::kFinger && size_t(hold_.side) == side;
      if (hold_.shown[side] && !feels) add_sphere(things, hold_.tips[side], kFinger_m, kFinger);
    }
  }

  std::optional<xr::Scenery> show(const xr::HeadsetFrame& frame) {
    if (!scene_) return std::nullopt;
    scene_->session->newest(SnapshotReader::kHeadset, snapshot_);
    if (snapshot_.volume_count == 0) return std::nullopt;
    Pose head = frame.eyes[0].world_from_eye;
    head.position_m = 0.5 * (head.position_m + frame.eyes[1].world_from_eye.position_m);
    head_ = head;
    ViewChoices view = hands_->view();
    show_probe(view);
    picture_->choose(view);
    picture_->update(scene_->session->scene());
    picture_->show(scene_->session->tubes());
    // Nothing is drawn before the world's place in the room is known.
    if (!placed_) return std::nullopt;
    xr::Scenery scenery;
    const SceneSnapshot ahead = ahead_.at(snapshot_, frame.display_time_ns);
    // A second pair of views, if there is one, is seen within the first.
    const Eye pair[] = {xr::eye_of(frame.eyes[0]), xr::eye_of(frame.eyes[1])};
    scenery.scene = picture_->at(ahead, frame.display_time_ns, pair);
    tube_colours_ = scenery.scene.tube_colours;
    add_fingers(scenery.scene.things);
    scenery.scene.meshes = models_.show(frame.held);
    if (const auto clip = hands_->clip(ahead)) scenery.scene.clips.push_back(*clip);
    if (shows_panel_ && panel_.newest())
      scenery.panel = xr::HangingPanel{panel_.newest(),
                                       headset_.colocation().world_from_base() * room_from_panel_,
                                       kPanelWidth_m};
    // With pass-through, a pixel without coverage must also add no light.
    if (headset_.report().see_through)
      scenery.scene.background_top = scenery.scene.background_bottom = glm::dvec3(0.0);
    scenery.volumes = picture_->volumes();
    return scenery;
  }

  void count() {
    const xr::Report& report = headset_.report();
    loop_.numbers_ = {report.frames,   report.drawn, report.sessions, 1e3 * source_.picture_s(),
                      source_.sizes(), report.depth, report.system,   report.runtime};
  }

  HeadsetLoop& loop_;
  const HeadsetLoopOptions options_;
  xr::VolumeSource source_;
  xr::Headset headset_;
  std::optional<HeadsetScene> scene_;
  std::unique_ptr<SceneHands> hands_;
  ProbeHand probe_hand_;
  ProbeHold hold_;                              ///< in the last frame
  std::unique_ptr<sound::ContactSound> sound_;  ///< created when a finger first touches
  bool was_touching_ = false;
  bool tracking_told_ = false, floor_told_ = false;
  std::string no_tracking_, no_models_;
  bool models_told_ = false;
  std::optional<PlaceCheck> check_;  ///< only with a calibration
  std::unique_ptr<ScenePicture> picture_;
  HeldModels models_;
  std::vector<TubeColours> tube_colours_;  ///< of the last frame
  SceneSnapshot snapshot_;
  SnapshotAhead ahead_;
  std::unique_ptr<LiveSlices> slices_;  ///< none: no panel is asked for
  RoomPanel panel_;
  Pose room_from_panel_;
  std::vector<ButtonHelp> help_;
  bool shows_panel_ = true;
  std::string no_panel_, no_rate_;
  bool no_rates_told_ = false;
  uint64_t rate_sessions_ = 0;
  double asked_hz_ = 0.0;  ///< by this session, at the last step
  double told_hz_ = 0.0, reported_hz_ = 0.0, expected_hz_ = 0.0;
  std::optional<Pose> head_;  ///< world, in the last frame that asked for a picture
  bool main_visible_ = true;
  bool guess_told_ = false, placed_ = false, shown_ = false, was_shown_ = false, ending_ = false;
  uint64_t frames_ = 0, sessions_ = 0;
  int64_t last_ns_ = 0;
  std::string trouble_;
  bool preparing_ = false;
};

HeadsetLoop::HeadsetLoop(const HeadsetLoopOptions& options) {
  thread_ = std::jthread([this, options](std::stop_token stop) {
    const Status lived = caught([&]() -> Status {
      Run(*this, options).live(stop);
      return Nothing{};
    });
    if (!lived) fail(lived.error());
  });
}

HeadsetLoop::~HeadsetLoop() {
  end();
}

HeadsetLoop::Availability HeadsetLoop::found() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return found_.has_value(); });
  return *found_;
}

void HeadsetLoop::begin(const HeadsetScene& scene) {
  const std::lock_guard lock(mutex_);
  scene_ = scene;
}

void HeadsetLoop::end() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

/// The thread has ended by an exception: no further picture comes.
void HeadsetLoop::fail(const Error& error) {
  const std::lock_guard lock(mutex_);
  news_.push_back(
      {HeadsetEvent::Kind::kNote, "There is no picture any more: " + error.message + "."});
  if (scene_ && scene_->gate->on_loss() == OnHeadsetLoss::kRamp) {
    scene_->gate->shown_until(0);
    ended_ = true;
  }
  if (!found_) found_ = Availability{false, false, false, error.message};
  changed_.notify_all();
}

void HeadsetLoop::tell(HeadsetEvent event) {
  const std::lock_guard lock(mutex_);
  news_.push_back(std::move(event));
}

std::vector<HeadsetEvent> HeadsetLoop::news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

}  // namespace palpate::headset
