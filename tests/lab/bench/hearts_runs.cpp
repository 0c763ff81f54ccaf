#include "tests/lab/bench/hearts_runs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>

#include "integration/devices/held_mass.h"
#include "module/haptics/proxy/back_track.h"
#include "tests/lab/stability/shell.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::bench {
namespace {

constexpr double kPush_n = 1.0;
constexpr double kHolds_n = 0.3, kGone_n = 0.1;
constexpr double kClear_m = 8e-3, kBehind_m = 8e-3;
constexpr double kApproach_m_per_s = 0.02, kFollow_m_per_s = 0.05, kFollow_s = 0.2;
// The guards' start ramp takes two seconds.
constexpr double kStarting_s = 2.3;
// From the first press until the wall has to hold.
constexpr double kSettle_s = 0.6;
// From here on the hand is certainly inside of the wall.
constexpr double kInside_mm = 2.0;
constexpr double kFallen_mm = 3.0;  // of the proxy behind the wall
constexpr double kAlong_m_per_s = 0.04, kReach_m = 0.010;

SceneSpec scene_of(const Wall& wall, const Felt& felt) {
  SceneSpec spec;
  VolumeSpec volume;
  volume.name = "volume";
  volume.centred = false;
  spec.volumes = {volume};
  ModeSpec mode;
  mode.name = "wall";
  mode.volume = "volume";
  if (felt.segments) mode.segment = wall.segment;
  mode.strength = felt.strength;
  mode.friction = TransferFunction::constant(0.2);
  spec.modes = {mode};
  return spec;
}

/// The offset of a hand that moves along a wall from its place, m, after a way.
glm::dvec2 aside_of(Way way, double gone, double reach_m) {
  if (way == Way::kStroke) {  // 0, +10, -10, 0, ...
    const double at = std::fmod(gone, 4.0 * reach_m);
    if (at < reach_m) return {at, 0.0};
    if (at < 3.0 * reach_m) return {2.0 * reach_m - at, 0.0};
    return {at - 4.0 * reach_m, 0.0};
  }
  if (way == Way::kCircle) {
    if (gone < reach_m) return {gone, 0.0};
    const double angle = (gone - reach_m) / reach_m;
    return reach_m * glm::dvec2(std::cos(angle), std::sin(angle));
  }
  return {0.0, 0.0};
}

/// The place of material in the motion's reference frame; the last known place if it can not be
/// found.
class Reference {
 public:
  explicit Reference(const SequenceMap* map) : map_(map) {}
  glm::dvec3 of(glm::dvec3 x, FramePointer at) {
    if (!map_) return x;
    SequenceSnapshot now(*map_, map_->basis().at(at.frame, at.phase));
    const glm::dvec3 start = known_ ? last_ + (x - last_x_) : x;
    BackTrack found = back_track(now, x, start);
    if (!found.ok) found = back_track(now, x, x);
    if (found.ok) {
      last_ = found.x_m;
      last_x_ = x;
      known_ = true;
    }
    return last_;
  }

 private:
  const SequenceMap* map_;
  glm::dvec3 last_{0.0}, last_x_{0.0};
  bool known_ = false;
};

}  // namespace

const char* word(Outcome outcome) {
  switch (outcome) {
    case Outcome::kNothingMet:
      return "nothing met";
    case Outcome::kHeld:
      return "held";
    case Outcome::kLeft:
      return "left by the wall";
    case Outcome::kFaded:
      return "faded";
    case Outcome::kFell:
      return "fell";
  }
  return "";
}

const char* word(Way way) {
  return way == Way::kHold ? "press" : way == Way::kStroke ? "stroke" : "circle";
}

RunResult lean_on(const Subject& subject, const Wall& wall, const Felt& felt, bool moving,
                  const Place& place, Way way, double seconds, Histogram* ticks,
                  const std::vector<glm::dvec3>* along) {
  auto info = stability::Hand::device();
  info.workspace_radius_m = 10.0;
  const SceneSpec spec = felt.spec ? *felt.spec : scene_of(wall, felt);
  const Transform shown = spec.volumes.front().transform;
  const double scale = std::cbrt(shown.scale.x * shown.scale.y * shown.scale.z);
  auto scene = plan(spec, {felt.volume});
  if (!scene) throw studies::Mismatch(scene.error().message);
  Haptics haptics(HapticsOptions{}, info);
  haptics.adopt(Haptics::prepare(*scene));

  // In the world, where the hand is; what is compared with the wall is in volume space.
  const glm::dvec3 start_m = shown.world_from_volume(place.at_m);
  const glm::dvec3 out =
      glm::normalize(shown.world_from_volume(place.at_m + 1e-3 * place.out) - start_m);
  const glm::dvec3 aside_x = glm::normalize(
      glm::cross(out, std::abs(out.y) < 0.8 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
  const glm::dvec3 aside_y = glm::cross(out, aside_x);
  devices::MassProperties body{
      .mass_kg = 0.15, .damping_n_s_per_m = 2.0, .coulomb_n = 0.0, .hand = devices::kHumanHand};
  // Of the hand's target, over the place.
  double height_m = scale * kClear_m;
  glm::dvec3 meant = start_m + out * height_m;
  devices::HeldMass hand(body, meant);
  Reference of_proxy(subject.whole.get()), of_hand(subject.whole.get()),
      of_meant(subject.whole.get());

  RunResult result;
  TickInput input;
  glm::dvec3 force_n(0.0), last_wanted_n(0.0), last_probe(0.0);
  std::optional<double> pressed_s;
  // In the reference frame.
  std::optional<glm::dvec3> met;
  double sum_n = 0.0, gone_s = 0.0;
  bool is_weak_inside = false, is_weak_outside = false;
  int counted = 0, weak = 0, absent = 0, last_frame = -1;
  result.least_n = 1e9;
  const auto ends_s = [&] { return pressed_s ? *pressed_s + kSettle_s + seconds : 6.0; };
  for (int tick = 0; 1e-3 * tick < ends_s(); ++tick) {
    const double time_s = 1e-3 * tick;
    input.event_count = 0;
    // The sequence begins to play when the hand presses.
    const bool starts = moving && pressed_s && time_s >= *pressed_s + 0.5 * kSettle_s &&
                        time_s < *pressed_s + 0.5 * kSettle_s + 1.5e-3;
    if (tick == 0 || starts) {
      input.events[0] = {ControlEvent::Kind::kRate, 0, starts ? 1.0 : 0.0};
      input.event_count = 1;
    }
    input.dt_s = 1e-3;
    input.now_ns = int64_t(tick + 1) * 1'000'000;
    input.reading.position_m = hand.position_m();
    input.reading.time_ns = input.now_ns;
    input.reading.fresh = true;
    const auto begin = std::chrono::steady_clock::now();
    const TickOutput felt_now = haptics.tick(input);
    if (ticks && pressed_s)
      ticks->add((std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(1));
    force_n = felt_now.command.force_n;
    const double pressing_n = glm::dot(force_n, out);

    // The hand's target: towards the wall, then so that it leans with kPush_n, or to the depth of
    // its path.
    if (time_s > kStarting_s) {
      double rate = felt.path ? -felt.path->speed_m_per_s : -kApproach_m_per_s;
      if (!felt.path && (pressed_s || pressing_n > 0.1))
        rate = std::clamp(-(kPush_n - pressing_n) / body.hand.stiffness_n_per_m / kFollow_s,
                          -kFollow_m_per_s, kFollow_m_per_s);
      height_m += 1e-3 * rate;
      if (felt.path) height_m = std::max(height_m, -felt.path->depth_m);
    }
    if (!pressed_s && height_m < -scale * kBehind_m - kPush_n / body.hand.stiffness_n_per_m) break;
    const double along_s = pressed_s ? std::max(0.0, time_s - *pressed_s - kSettle_s) : 0.0;
    const glm::dvec2 aside =
        felt.path ? aside_of(way, felt.path->speed_m_per_s * along_s, felt.path->reach_m)
                  : aside_of(way, kAlong_m_per_s * along_s, kReach_m);
    const glm::dvec3 before = meant;
    meant = start_m + out * height_m + aside_x * aside.x + aside_y * aside.y;
    const FramePointer at = felt_now.first;
    if (pressed_s && along && !along->empty()) {
      const glm::dvec3 there =
          (*along)[std::min(along->size() - 1, size_t(1e3 * (time_s - *pressed_s) + 0.5))];
      meant = shown.world_from_volume(
          there +
          subject.whole->displacement(there, subject.whole->basis().at(at.frame, at.phase)));
    }
    if (pressed_s && moving)
      result.meant.push_back(of_meant.of(shown.volume_from_world(meant), at));
    hand.advance(1e-3, force_n, before, meant);

    // The change of the force.
    const double change_n = glm::length(felt_now.wanted_n - last_wanted_n);
    const glm::dvec3 carried = haptics.run()->points[0].carriers[0].carried_m;
    const double by_hand_n =
        haptics.run()->stiffness_n_per_m * glm::length(carried - (felt_now.probe_m - last_probe));
    if (tick > 0) {
      LargestChange& most = result.change;
      most.beyond_n = std::max(most.beyond_n, change_n - by_hand_n);
      if (change_n > most.n_per_ms)
        most = {change_n, by_hand_n, most.beyond_n, felt_now.cause, felt_now.frozen, time_s};
    }
    last_wanted_n = felt_now.wanted_n;
    last_probe = felt_now.probe_m;
    if (!pressed_s && glm::length(force_n) > 0.8 * kPush_n) pressed_s = time_s;
    if (!pressed_s) continue;
    const glm::dvec3 proxy = of_proxy.of(shown.volume_from_world(felt_now.proxy_m), at);
    if (!met) met = proxy;
    // Relative to the place where the wall was met, and to the given wall. Sliding along a curved
    // wall changes only the first, sliding along a wall at another place only the second.
    const auto behind_mm = [&](glm::dvec3 there) {
      const double from_wall_mm = wall.distance_mm->scalar(there);
      if (way != Way::kHold) return from_wall_mm;
      return std::min(1e3 * glm::dot(*met - there, place.out),
                      from_wall_mm - wall.distance_mm->scalar(*met));
    };
    if (time_s < *pressed_s + kSettle_s) continue;

    // Whether it is still on the wall.
    ++counted;
    const double now_n = glm::length(force_n);
    sum_n += now_n;
    result.least_n = std::min(result.least_n, now_n);
    ++result.causes[size_t(felt_now.cause)];
    const double proxy_mm = behind_mm(proxy);
    double hand_mm = -1e9;
    result.deepest_mm = std::max(result.deepest_mm, proxy_mm);
    if (now_n < kHolds_n) {
      ++absent;
      hand_mm = behind_mm(of_hand.of(shown.volume_from_world(hand.position_m()), at));
      (hand_mm > 0.0 ? is_weak_inside : is_weak_outside) = true;
      weak += hand_mm > 0.0;
    }
    gone_s = now_n < kGone_n && hand_mm > kInside_mm ? gone_s + 1e-3 : 0.0;
    // Along the wall the distance to the contours decides, but only if the hand is inside too.
    const bool behind = proxy_mm > kFallen_mm && (way == Way::kHold || now_n < kHolds_n);
    if ((behind || gone_s > 0.02) && result.fell_at_s < 0.0) result.fell_at_s = time_s - *pressed_s;
    if (moving && at.frame != last_frame && now_n > kHolds_n && felt_now.primitives > 0) {
      result.proxies.push_back({at.frame, shown.volume_from_world(felt_now.proxy_m)});
      last_frame = at.frame;
    }
  }
  if (!pressed_s) return result;
  result.mean_n = counted ? sum_n / counted : 0.0;
  result.weak = counted ? double(weak) / counted : 0.0;
  result.absent = counted ? double(absent) / counted : 0.0;
  result.outcome = result.fell_at_s >= 0.0 ? Outcome::kFell
                   : is_weak_inside        ? Outcome::kFaded
                   : is_weak_outside       ? Outcome::kLeft
                                           : Outcome::kHeld;
  return result;
}

}  // namespace palpate::bench
