#include "integration/app/calibrate/calibrate_run.h"
#include "integration/app/force_device.h"
#include "integration/devices/force_devices.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <sstream>
#include <thread>

#include "integration/app/calibrate/tip_log.h"
#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/progress.h"
#include "integration/app/session_flags.h"
#include "integration/devices/calibration_hand.h"
#include "integration/files/scene/calibration_file.h"
#include "integration/headset/touch_taker.h"
#include "module/haptics/servo/emergency.h"
#include "module/haptics/servo/monotonic.h"
#include "module/haptics/servo/servo.h"
#include "module/xr/headset.h"

namespace palpate::app {
namespace {

constexpr double kGood_m = 0.001;    // expected error in the workspace: too small to be noticed
constexpr double kUsable_m = 0.003;  // above it picture and force are visibly apart
// least share of samples that agree; a smaller share agrees by chance
constexpr double kAgree = 0.6;
constexpr size_t kFirstWord = 6;  // points after which their fit is reported
constexpr int kBuzzFrames = 8;

/// Where a person is to take the device's tip, in turn: words and directions, each component -1, 0
/// or 1 of the reach, in the device's own axes (x right, y up, z towards the user).
struct TouchPlace {
  const char* words;
  glm::dvec3 direction;
};

/// Corners and middles of faces, the ones furthest apart first.
constexpr std::array<TouchPlace, 14> kPlaces = {{
    {"left, down, far from you", {-1, -1, -1}},
    {"right, up, near to you", {1, 1, 1}},
    {"right, down, near to you", {1, -1, 1}},
    {"left, up, far from you", {-1, 1, -1}},
    {"left, up, near to you", {-1, 1, 1}},
    {"right, down, far from you", {1, -1, -1}},
    {"left, down, near to you", {-1, -1, 1}},
    {"right, up, far from you", {1, 1, -1}},
    {"all the way left", {-1, 0, 0}},
    {"all the way right", {1, 0, 0}},
    {"all the way up", {0, 1, 0}},
    {"all the way down", {0, -1, 0}},
    {"as near to you as it goes", {0, 0, 1}},
    {"as far from you as it goes", {0, 0, -1}},
}};

/// Shows no picture; records only the hands' poses and their times.
class HandWatch final : public xr::PictureSource {
 public:
  Status use(const std::shared_ptr<vulkan::Context>&) override { return Nothing{}; }
  void drop() noexcept override {}
  Result<xr::Drawn> record(const xr::HeadsetFrame& frame, VkCommandBuffer) override {
    hands = *frame.hands;
    time_s = 1e-9 * double(frame.display_time_ns);
    ++frames;
    return xr::Drawn{};
  }
  xr::Hands hands;
  double time_s = 0.0;
  uint64_t frames = 0;
};

std::string mm(double m) {
  return fmt::format("{:.1f} mm", 1e3 * m);
}

/// One run, from the search for a headset to the end.
class Calibrating {
 public:
  Calibrating(const CalibrateCommand& command, Console& console, std::stop_token stop)
      : command_(command), console_(console), stop_(stop), headset_({}, watch_) {
    tip_m_ = tip_of(command.tip).value_or(glm::dvec3(0.0));
  }

  int run() {
    if (command_.tip == "pivot" && command_.by == "movement")
      return fail(console_, {ErrorKind::kBadInput,
                             "A movement finds the tip by itself: leave --tip pivot away, or "
                             "calibrate --by points"});
    if (const Status opened = open_device(); !opened) return fail(console_, opened.error());
    if (const Status there = find_headset(); !there) return leave(there.error());
    if (command_.tip == "pivot")
      if (const Status pivoted = find_tip(); !pivoted) return leave(pivoted.error());
    auto found = command_.by == "points" ? by_points() : by_movement();
    if (!found) return leave(found.error());
    const int rc = store(*found);
    end_headset();
    return rc;
  }

 private:
  size_t side() const { return command_.hand == "left" ? 0 : 1; }
  const xr::Controller& hand() const { return watch_.hands.hand[side()]; }

  int leave(const Error& error) {
    end_headset();
    return fail(console_, error);
  }

  Status open_device() {
    if (command_.device == "simulated") {
      auto simulated = std::make_unique<devices::CalibrationHand>();
      simulated_ = simulated.get();
      device_ = std::move(simulated);
    } else {
      auto found = devices::find_force_device(command_.device,
                                              {"", command_.falcon_firmware.string(), true});
      if (!found) return found.error();
      if (!*found)
        return Error{ErrorKind::kNoDevice, "No force device is there: plug in " +
                                               devices_that_would_do() +
                                               ", or see how it goes with --device simulated"};
      device_ = std::move(*found);
    }
    info_ = device_->info();
    ServoOptions options;
    if (simulated_) options.real_time = {.priority = 0, .lock_memory = false, .cores_awake = false};
    auto servo = Servo::start(*device_, log_, options);
    if (!servo) return servo.error();
    servo_ = std::move(*servo);
    console_.say(fmt::format("Device    {}; it gives no force while it is calibrated", info_.name));
    return Nothing{};
  }

  /// Runs one frame of the headset, or a short pause if there is none.
  Status frame() {
    const uint64_t before = watch_.frames;
    const xr::Report& report = headset_.step(monotonic_ns());
    if (!report.sentence.empty()) console_.say("Headset   " + report.sentence);
    if (stop_.stop_requested() || emergency::is_asked())
      return Error{ErrorKind::kCancelled, "Stopped before there was a calibration"};
    if (report.state == xr::HeadsetState::kNoRuntime)
      return Error{ErrorKind::kNoDevice, problem_text(report.problem, Console::verbose())};
    if (report.state == xr::HeadsetState::kEnded)
      return Error{ErrorKind::kCancelled,
                   "The session in the headset was ended before there was a calibration"};
    fresh_ = watch_.frames != before;
    if (!fresh_) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (!report.hands.focused) watch_.hands = {};
    buzz();
    first_new_ = tips_.size();
    log_.drain(tips_);
    return Nothing{};
  }

  Status find_headset() {
    const int64_t start_ns = monotonic_ns();
    while (!watch_.hands.focused) {
      if (const Status framed = frame(); !framed) return framed;
      if (command_.wait_s > 0.0 && 1e-9 * double(monotonic_ns() - start_ns) > command_.wait_s)
        return Error{ErrorKind::kNoDevice,
                     headset_.report().problem.message.empty()
                         ? "No headset gave this program its input in time: put it on"
                         : problem_text(headset_.report().problem, Console::verbose())};
    }
    return Nothing{};
  }

  void buzz() {
    if (buzzing_ == 0) return;
    // Vibration: two pulses if a point was refused, one if it was taken.
    const bool on = !twice_ || buzzing_ <= kBuzzFrames || buzzing_ > 2 * kBuzzFrames;
    if (on) headset_.vibrate(int(side()), 1.0);
    --buzzing_;
  }
  void knock(bool refused) {
    twice_ = refused;
    buzzing_ = refused ? 3 * kBuzzFrames : kBuzzFrames;
  }

  void ask_for(const TouchPlace& place, const std::string& which, const std::string& so_far) {
    if (simulated_)
      simulated_->go_to(info_.workspace_centre_m +
                        0.5 * info_.workspace_radius_m * place.direction);
    asked_for_ = which;
    asked_s_ = 1e-9 * double(monotonic_ns());
    console_.say(fmt::format("{}{}{}", which, place.words, so_far));
  }

  /// The live line about both tips while the user moves to a point.
  void live() {
    // The simulated device is at the new point in readings from now on.
    if (tips_.empty() || tips_.back().time_s <= asked_s_) {
      if (log_.fault() == DeviceFault::kNone) return;
      const std::string why = with_flags(sentence(log_.fault()));
      console_.live("the device: " + why, why);
      return;
    }
    const glm::dvec3 tip = 1e3 * tips_.back().device_m;
    const char* const seen = hand().active ? "seen" : "not seen by the headset";
    // Into a file a line comes seldom, but soon after each new point.
    console_.live(
        fmt::format("tip at {:.1f} {:.1f} {:.1f} mm; controller {}", tip.x, tip.y, tip.z, seen),
        asked_for_ + seen);
  }

  Result<TouchedPoint> take_point() {
    headset::TouchTaker taker(tip_m_);
    while (true) {
      if (const Status framed = frame(); !framed) return framed.error();
      live();
      if (!fresh_) continue;
      const auto taken =
          taker.step(watch_.time_s, hand(), std::span<const TipSample>(tips_).subspan(first_new_));
      if (taken.point) {
        knock(false);
        return *taken.point;
      }
      if (taken.refused.empty()) continue;
      knock(true);
      console_.say("Not taken " + taken.refused);
    }
  }

  double seconds() const {
    return command_.seconds > 0.0 ? command_.seconds : command_.tip == "pivot" ? 15.0 : 30.0;
  }

  /// The controller's poses after the trigger is pulled.
  Result<std::vector<ControllerSample>> turning() {
    std::vector<ControllerSample> samples;
    bool was_pressed = true;  // a button that is already down is not a press
    std::optional<double> since_s;
    while (!since_s || watch_.time_s - *since_s < seconds()) {
      if (const Status framed = frame(); !framed) return framed.error();
      if (!fresh_) continue;
      const bool pressed = hand().active && hand().grabs;
      if (pressed && !was_pressed && !since_s) {
        since_s = watch_.time_s;
        knock(false);
      }
      was_pressed = pressed;
      if (since_s && hand().active) samples.push_back({watch_.time_s, hand().world_from_grip});
      console_.live(since_s ? fmt::format("{:.0f} s of {:.0f}, {} controller samples",
                                          watch_.time_s - *since_s, seconds(), samples.size())
                            : std::string("waiting for the trigger"),
                    since_s ? "moving" : "waiting");
    }
    knock(false);
    return samples;
  }

  Status find_tip() {
    console_.say(fmt::format(
        "Rest the controller's touching tip in a dent that holds it, pull the trigger, and turn "
        "the controller about the tip, tilted to all sides and rolled, for {:.0f} s until it "
        "vibrates.",
        seconds()));
    const auto samples = turning();
    if (!samples) return samples.error();
    const auto found = find_pivot(*samples);
    if (!found) return found.error();
    // Solve each half alone: the distance between the results is the uncertainty.
    const std::span<const ControllerSample> all(*samples);
    const auto first = find_pivot(all.first(all.size() / 2));
    const auto second = find_pivot(all.subspan(all.size() / 2));
    const double apart_m = first && second ? 0.5 * glm::distance(first->controller_from_tip_m,
                                                                 second->controller_from_tip_m)
                                           : std::numeric_limits<double>::infinity();
    const glm::dvec3 tip = 1e3 * found->controller_from_tip_m;
    console_.say(fmt::format(
        "Tip       at {:.1f},{:.1f},{:.1f} mm of the controller's grip: {} of {} poses agree to {} "
        "(RMS); each half of them alone puts it within {} of that",
        tip.x, tip.y, tip.z, found->used, found->all, mm(found->rms_m), mm(apart_m)));
    if (found->used < kAgree * found->all || !(apart_m <= kGood_m))
      return Error{ErrorKind::kBadInput,
                   "The tip is not known well enough: keep it in its dent, tilt the controller "
                   "further to all sides, and turn for longer with --seconds"};
    tip_m_ = found->controller_from_tip_m;
    return Nothing{};
  }

  Result<Calibration> by_points() {
    console_.say(
        "Take the device's tip to the place named, hold the controller's tip to it, pull the "
        "trigger, and keep both still until it vibrates: once if taken, twice if not.");
    std::vector<TouchedPoint> points;
    while (int(points.size()) < command_.points) {
      const size_t number = points.size();
      std::string so_far;
      if (number >= kFirstWord)
        if (const auto fit = calibrate_by_points(points))
          so_far = fmt::format(" (so far they fit to {})", mm(fit->rms_m));
      ask_for(kPlaces[number % kPlaces.size()],
              fmt::format("Point {:2} of {}: ", number + 1, command_.points), so_far);
      const auto point = take_point();
      if (!point) return point.error();
      points.push_back(*point);
    }
    auto found = calibrate_by_points(points);
    if (!found) return found;
    found->controller_from_tip_m = tip_m_;
    const glm::dvec3 edge =
        info_.workspace_centre_m + glm::dvec3(info_.workspace_radius_m, 0.0, 0.0);
    expected_m_ = expected_error_m(points, *found, edge);
    console_.say(fmt::format(
        "Found     {} of {} points agree to {} (RMS); expected error {} in the middle of the "
        "device's reach, {} at its edge",
        found->used, found->all, mm(found->rms_m),
        mm(expected_error_m(points, *found, info_.workspace_centre_m)), mm(expected_m_)));
    return found;
  }

  Result<Calibration> by_movement() {
    console_.say(fmt::format(
        "Move the stylus, with the controller clipped to it, through all of its reach and turn it "
        "in all directions, for {:.0f} s",
        seconds()));
    if (simulated_) simulated_->wander();
    std::vector<ControllerSample> samples;
    std::optional<double> since_s;
    while (!since_s || watch_.time_s - *since_s < seconds()) {
      if (const Status framed = frame(); !framed) return framed.error();
      if (!fresh_) continue;
      if (!since_s) {
        since_s = watch_.time_s;
        if (!tips_.empty()) tips_.erase(tips_.begin(), tips_.end() - 1);
      }
      if (hand().active) samples.push_back({watch_.time_s, hand().world_from_grip});
      console_.live(fmt::format("{:.0f} s of {:.0f}, {} controller samples{}",
                                watch_.time_s - *since_s, seconds(), samples.size(),
                                hand().active ? "" : "; the headset does not see the controller"),
                    hand().active ? "seen" : "not seen");
    }
    auto found = calibrate_by_movement(tips_, samples);
    if (!found) return found;
    tip_m_ = found->controller_from_tip_m;
    expected_m_ = halves_apart_m(samples);
    console_.say(fmt::format(
        "Found     {} of {} samples agree to {} (RMS); the headset's poses come {:.1f} ms late; "
        "the tip is {} from the controller's grip",
        found->used, found->all, mm(found->rms_m), 1e3 * found->delay_s,
        mm(glm::length(found->controller_from_tip_m))));
    console_.say(fmt::format(
        "Check     each half of the movement alone puts the device's reach within {} of that",
        mm(expected_m_)));
    return found;
  }

  /// How far the results of the movement's two halves, which share no sample, are apart: half of
  /// the largest distance in the device's workspace. Infinite if a half gives no result.
  double halves_apart_m(std::span<const ControllerSample> samples) const {
    const size_t half = samples.size() / 2;
    const auto first = calibrate_by_movement(tips_, samples.first(half));
    const auto second = calibrate_by_movement(tips_, samples.subspan(half));
    if (!first || !second) return std::numeric_limits<double>::infinity();
    double most_m = 0.0;
    for (int a = 0; a < 3; ++a)
      for (const double sign : {-1.0, 1.0}) {
        glm::dvec3 edge = info_.workspace_centre_m;
        edge[a] += sign * info_.workspace_radius_m;
        most_m = std::max(
            most_m, glm::distance(first->stage_from_device(edge), second->stage_from_device(edge)));
      }
    return 0.5 * most_m;
  }

  /// Checks the calibration with a point that was not used, and stores it if it can be used.
  int store(const Calibration& found) {
    const bool agreed = found.used >= kAgree * found.all;
    double off = expected_m_;
    if (command_.by == "points") {
      ask_for({"once more, where the picture will matter most", {0.0, 0.0, 0.0}}, "Check: ", "");
      const auto point = take_point();
      if (!point) return fail(console_, point.error());
      off = off_m(found, *point);
      console_.say(fmt::format("Check     a point that was not used is {} off", mm(off)));
    }
    const double error = std::max(off, expected_m_);
    if (!agreed || error > kUsable_m) {
      console_.complain(
          "palpate: The calibration is not good enough and was not stored: see that the "
          "controller's touching tip is the one that --tip says, that the headset sees it all the "
          "time, and touch more places, far apart.");
      return kExitFailed;
    }
    const Status written = files::write_calibration(command_.output, stored(found));
    if (!written) return fail(console_, written.error());
    console_.say(fmt::format("Wrote     {}: use it with 'palpate feel ... --calibration {}'",
                             command_.output.string(), command_.output.string()));
    if (error <= kGood_m) return kExitOk;
    console_.say(
        "Note      It can be used, but picture and force will be seen apart: touch more places for "
        "a better one.");
    return kExitSuspect;
  }

  files::StoredCalibration stored(const Calibration& found) const {
    const xr::Report& report = headset_.report();
    files::StoredCalibration stored;
    stored.calibration = found;
    stored.space = xr::name(report.origin);
    stored.device = info_.name;
    stored.headset = report.system;
    stored.runtime = report.runtime;
    return stored;
  }

  void end_headset() {
    console_.end_progress();
    headset_.end(monotonic_ns());
    while (headset_.step(monotonic_ns()).state != xr::HeadsetState::kEnded &&
           headset_.report().state != xr::HeadsetState::kNoRuntime)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  const CalibrateCommand& command_;
  Console& console_;
  std::stop_token stop_;
  glm::dvec3 tip_m_{0.0};
  std::string asked_for_;  ///< the point that the user is to touch
  double asked_s_ = 0.0;   ///< when that was said, monotonic time
  std::unique_ptr<ForceDevice> device_;
  devices::CalibrationHand* simulated_ = nullptr;  ///< the device, if it is simulated
  DeviceInfo info_;
  TipLog log_;
  std::unique_ptr<Servo> servo_;  ///< ends before log_ and device_
  HandWatch watch_;
  xr::Headset headset_;
  std::vector<TipSample> tips_;
  size_t first_new_ = 0;
  bool fresh_ = false, twice_ = false;
  int buzzing_ = 0;
  double expected_m_ = 0.0;
};

}  // namespace

std::optional<glm::dvec3> tip_of(const std::string& text) {
  std::istringstream words(text);
  glm::dvec3 tip_mm(0.0);
  char first = 0, second = 0;
  if (!(words >> tip_mm.x >> first >> tip_mm.y >> second >> tip_mm.z) || first != ',' ||
      second != ',' || words.peek() != std::istringstream::traits_type::eof())
    return std::nullopt;
  // A controller's tip is not a metre from its grip.
  if (!glm::all(glm::lessThanEqual(glm::abs(tip_mm), glm::dvec3(1000.0)))) return std::nullopt;
  return 1e-3 * tip_mm;
}

int run_calibrate(const CalibrateCommand& command) {
  emergency::install();
  const CancelOnSignal cancel;
  Console console(command.quiet, false);
  return Calibrating(command, console, cancel.token()).run();
}

}  // namespace palpate::app
