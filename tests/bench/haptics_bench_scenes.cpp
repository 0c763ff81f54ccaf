#include "tests/bench/haptics_bench_scenes.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "module/haptics/balance.h"
#include "module/scene/built_in.h"
#include "module/scene/drive.h"
#include "module/scene/make_volume.h"
#include "tests/bench/measuring.h"

namespace palpate::bench {
namespace {

constexpr double kFramesPerSecond = 2.0;
constexpr int kFrames = 4;

std::shared_ptr<const MovingVolume> made_heart() {
  VolumeSpec spec;
  spec.name = spec.source = "heart";
  spec.frames_per_second = kFramesPerSecond;
  auto volume = build(spec);
  if (!volume) throw Mismatch(volume.error().message);
  return std::make_shared<MovingVolume>(std::move(*volume));
}

std::shared_ptr<const MovingVolume> first_frame(const MovingVolume& beating) {
  auto still = std::make_shared<MovingVolume>();
  still->name = beating.name;
  still->times.times_s = {0.0};
  still->frames = {beating.frames.front()};
  return still;
}

glm::dvec3 place_of(int volume) {
  return {0.008 * volume, 0.0, 0.0};
}

/// Where a volume is at a time: turning about itself by a quarter of a turn a second.
Transform turned(int volume, double time_s) {
  DriveSpec drive;
  drive.kind = DriveSpec::Kind::kTurn;
  drive.axis = volume % 2 ? glm::dvec3(0.3, 1.0, 0.2) : glm::dvec3(0.0, 1.0, 0.0);
  drive.centre_m = place_of(volume);
  Transform start;
  start.translation_m = place_of(volume);
  return driven(drive, start, time_s);
}

std::shared_ptr<const HapticScene> assembled(
    const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data) {
  auto scene = assemble(spec, std::move(data));
  if (!scene) throw Mismatch(scene.error().message);
  return *scene;
}

}  // namespace

SceneSpec hearts_spec(int volumes, int modes_of_each, Moves moves, PosePath path,
                      BackTracking method) {
  const SceneSpec one = heart_scene();
  SceneSpec spec = one;
  spec.volumes.clear();
  spec.modes.clear();
  for (int v = 0; v < volumes; ++v) {
    VolumeSpec volume = one.volumes.front();
    volume.name += std::to_string(v);
    volume.frames_per_second = kFramesPerSecond;
    volume.transform.translation_m = place_of(v);
    volume.drive.kind =
        moves == Moves::kNothing ? DriveSpec::Kind::kStill : DriveSpec::Kind::kSecondHand;
    volume.path = path;
    volume.back_tracking = method;
    for (int m = 0; m < modes_of_each; ++m) {
      ModeSpec mode = one.modes.front();
      mode.name += std::to_string(v) + "." + std::to_string(m);
      mode.volume = volume.name;
      if (m % 2) {
        mode.kind = "follow";
        mode.vector = VectorProperty::kGradient;
        mode.strength = *TransferFunction::linear({0.0, 1e5}, {0.0, 0.5});
      }
      spec.modes.push_back(mode);
    }
    spec.volumes.push_back(volume);
  }
  return spec;
}

std::shared_ptr<const MovingVolume> heart_volume(bool still) {
  static const auto beating = made_heart();
  static const auto one = first_frame(*beating);
  return still ? one : beating;
}

void HeartHand::next(TickInput& input, FramePointer first) noexcept {
  const int64_t now_ns = ++tick_ * 1'000'000;
  const double t = 1e-9 * double(now_ns);
  input.dt_s = 1e-3;
  input.now_ns = input.reading.time_ns = now_ns;
  input.reading.fresh = true;
  const double radius = test::shell_radius_m(first, kFrames);
  const double depth = 0.001 + 0.002 * std::cos(glm::two_pi<double>() * 0.7 * t);
  const double angle = 0.05 * t / 0.03;
  const glm::dvec3 along(std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle));
  input.reading.position_m = (radius - depth) * along;
  input.pose_count = input.event_count = 0;
  if (moves_ == Moves::kNothing || now_ns < next_pose_ns_) return;
  for (int v = 0; v < std::min(volumes_, int(input.poses.size())); ++v)
    input.poses[size_t(input.pose_count++)] = {v, turned(v, t), now_ns};
  next_pose_ns_ = now_ns + (long_frame_ ? 22'000'000 : 11'000'000);
  long_frame_ = !long_frame_;
}

TickOutput PaperLoop::tick(const TickInput& input) noexcept {
  TickOutput out;
  const glm::dvec3 probe = input.reading.position_m;
  if (!started_) run_.place_proxy(probe);
  started_ = true;
  run_.time_s += input.dt_s;
  for (int p = 0; p < input.pose_count; ++p)
    run_.volumes[size_t(input.poses[size_t(p)].volume)].pose.add(input.poses[size_t(p)].transform,
                                                                 input.poses[size_t(p)].time_ns);
  for (const int v : run_.posed) {
    VolumeRun& volume = run_.volumes[size_t(v)];
    const VolumeSpec& spec = volume.plan->spec;
    volume.set(spec.path == PosePath::kExact && spec.drive.kind != DriveSpec::Kind::kSecondHand
                   ? driven(spec.drive, spec.transform, run_.time_s)
                   : volume.pose.at(input.now_ns));
  }
  for (const int v : run_.playing) {
    VolumeRun& volume = run_.volumes[size_t(v)];
    volume.pointer = volume.playback.step(input.dt_s);
    volume.crossed = volume.playback.crossed();
  }
  placed_.set.clear();
  for (CarrierRun& carrier : run_.carriers) carrier.carrier->carry();
  for (const HapticMode& mode : run_.scene->modes)
    run_.carriers[size_t(mode.carrier)].carrier->place(mode, probe, input.dt_s, 1.0, 1e9, placed_);
  out.proxy_m = balance(placed_.set, probe, run_.stiffness_n_per_m).proxy;
  // Where the fixed point does not converge, the paper goes on with the better guess.
  for (CarrierRun& carrier : run_.carriers) carrier.carrier->go_to(out.proxy_m);
  out.primitives = uint8_t(placed_.set.count());
  out.probe_m = probe;
  out.wanted_n = run_.stiffness_n_per_m * (out.proxy_m - probe);
  if (!run_.playing.empty()) out.first = run_.volumes[size_t(run_.playing.front())].pointer;
  return out;
}

PaperHand::PaperHand(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data)
    : loop(assembled(spec, std::move(data))) {}

TickOutput PaperHand::to(glm::dvec3 probe_m) {
  input.now_ns += 1'000'000;
  input.dt_s = 1e-3;
  input.reading.position_m = probe_m;
  input.reading.time_ns = input.now_ns;
  input.reading.fresh = true;
  const TickOutput out = loop.tick(input);
  input.pose_count = 0;
  return out;
}

HapticsOptions bare() {
  HapticsOptions options;
  options.meter_energy = false;
  options.lead = false;
  return options;
}

}  // namespace palpate::bench
