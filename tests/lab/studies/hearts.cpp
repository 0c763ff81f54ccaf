#include "tests/lab/studies/hearts.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "module/scene/built_in.h"
#include "module/scene/drive.h"
#include "module/scene/make_volume.h"
#include "tests/lab/stability/shell.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

constexpr double kFramesPerSecond = 2.0;
constexpr int kFrames = 4;

std::shared_ptr<const MovingVolume> made_heart() {
  VolumeSpec spec;
  spec.name = spec.source = "shell";
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

/// The pose of a volume at a time: it rotates about itself by a quarter turn per second.
Transform turned(int volume, double time_s) {
  DriveSpec drive;
  drive.kind = DriveSpec::Kind::kTurn;
  drive.axis = volume % 2 ? glm::dvec3(0.3, 1.0, 0.2) : glm::dvec3(0.0, 1.0, 0.0);
  drive.centre_m = place_of(volume);
  Transform start;
  start.translation_m = place_of(volume);
  return driven(drive, start, time_s);
}

}  // namespace

SceneSpec hearts_spec(int volumes, int modes_of_each, Moves moves, PosePath path,
                      BackTracking method) {
  const SceneSpec one = shell_scene();
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
  const double radius = stability::shell_radius_m(first, kFrames);
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

}  // namespace palpate::studies
