#include "integration/app/palpation.h"

#include <algorithm>
#include <chrono>

#include "module/scene/drive.h"

namespace palpate::app {
namespace {

constexpr std::chrono::milliseconds kPosePause{16};  // as often as a display asks

int64_t monotonic_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

}  // namespace

bool needs_poses(const VolumeSpec& spec) {
  if (spec.drive.kind == DriveSpec::Kind::kSecondHand) return true;
  return spec.drive.kind != DriveSpec::Kind::kStill && spec.path != PosePath::kExact;
}

Result<std::unique_ptr<Palpation>> Palpation::start(FeltScene scene, ForceDevice& device,
                                                    const HapticsOptions& haptics,
                                                    const ServoOptions& servo,
                                                    const devices::SecondHand* second_hand) {
  auto palpation =
      std::unique_ptr<Palpation>(new Palpation(std::move(scene), haptics, device.info()));
  {
    const std::lock_guard lock(palpation->mutex_);
    for (const VolumeSpec& volume : palpation->felt_.spec.volumes) {
      palpation->rates_.push_back(volume.rate);
      palpation->moved_.push_back(driven(volume.drive, volume.transform, 0.0));
    }
    // A motion that is to come has its steps from the start, all still.
    for (const MissingMotion& missing : palpation->felt_.missing) {
      palpation->felt_.spec.volumes[missing.volume].rate = 0.0;
      // What waits for one motion has no steps.
      if (missing.own) continue;
      MovingVolume volume = *palpation->felt_.data[missing.volume];
      const size_t steps = size_t(volume.times.steps());
      volume.motions = {{"data", std::vector<std::shared_ptr<const MotionMap>>(steps)}};
      palpation->felt_.data[missing.volume] = std::make_shared<const MovingVolume>(volume);
    }
    if (const Status status = palpation->hand_over(); !status) return status.error();
  }
  palpation->second_hand_ = second_hand;
  palpation->start_ns_ = palpation->last_ns_ = monotonic_ns();
  auto started = Servo::start(device, palpation->ticker_, servo);
  if (!started) return started.error();
  palpation->servo_ = std::move(*started);
  const auto& volumes = palpation->felt_.spec.volumes;
  // What stands still as one of its frames stands at the time of that.
  for (const MissingMotion& missing : palpation->felt_.missing)
    if (missing.own)
      palpation->send({ControlEvent::Kind::kScrub, int(missing.volume),
                       missing.own->times.times_s[missing.own->segments_frame]});
  const bool posed = std::any_of(volumes.begin(), volumes.end(), needs_poses);
  palpation->poses_ =
      std::make_unique<Background>(kPosePause, [palpation = palpation.get(), posed] {
        if (posed) palpation->send_poses();
        const std::lock_guard lock(palpation->mutex_);
        if (palpation->waiting_)
          palpation->waiting_ = !palpation->ticker_.offer(palpation->assembled_);
        palpation->ticker_.collect();
      });
  return palpation;
}

Palpation::~Palpation() {
  stop();
}

void Palpation::stop() {
  poses_.reset();
  if (servo_) servo_->stop();
}

/// With mutex_ held.
Status Palpation::hand_over() {
  auto assembled = assemble(felt_.spec, felt_.data, felt_.kinds);
  if (!assembled) return assembled.error();
  assembled_ = *assembled;
  waiting_ = !ticker_.offer(assembled_);
  return Nothing{};
}

Status Palpation::take_motion(size_t volume, size_t step, std::shared_ptr<const MotionMap> map) {
  const std::lock_guard lock(mutex_);
  MovingVolume known = *felt_.data[volume];
  if (known.motions.empty() || step >= known.motions[0].steps.size()) return Nothing{};
  known.motions[0].steps[step] = std::move(map);
  felt_.data[volume] = std::make_shared<const MovingVolume>(std::move(known));
  return hand_over();
}

Status Palpation::take_volume(size_t volume, std::shared_ptr<const MovingVolume> data) {
  const std::lock_guard lock(mutex_);
  felt_.data[volume] = std::move(data);
  return hand_over();
}

bool Palpation::send(const ControlEvent& event) {
  const std::lock_guard lock(mutex_);
  return servo_->send(event);
}

void Palpation::play(size_t volume) {
  send({ControlEvent::Kind::kRate, int(volume), rates_[volume]});
}

std::shared_ptr<const HapticScene> Palpation::scene() const {
  const std::lock_guard lock(mutex_);
  return assembled_;
}

void Palpation::drag(const Transform& moved) {
  const std::lock_guard lock(mutex_);
  const int64_t now_ns = monotonic_ns();
  const auto& volumes = felt_.spec.volumes;
  for (size_t v = 0; v < volumes.size(); ++v) {
    if (volumes[v].drive.kind != DriveSpec::Kind::kSecondHand) continue;
    Transform& place = moved_[v];
    place.translation_m = moved.world_from_volume(place.translation_m);
    place.rotation = glm::normalize(moved.rotation * place.rotation);
    place.scale *= moved.scale.x;
    servo_->send(PoseUpdate{int(v), place, now_ns});
  }
}

void Palpation::send_poses() {
  const std::lock_guard lock(mutex_);
  const int64_t now_ns = monotonic_ns();
  const double dt_s = double(now_ns - last_ns_) * 1e-9;
  last_ns_ = now_ns;
  const auto& volumes = felt_.spec.volumes;
  for (size_t v = 0; v < volumes.size(); ++v) {
    if (!needs_poses(volumes[v])) continue;
    if (volumes[v].drive.kind != DriveSpec::Kind::kSecondHand) {
      moved_[v] = driven(volumes[v].drive, volumes[v].transform, double(now_ns - start_ns_) * 1e-9);
    } else if (!second_hand_) {
      continue;  // only dragged
    } else {
      const FrameData& frame = *felt_.data[v]->frames.front();
      const glm::dvec3 middle = 0.5 * (frame.low_m() + frame.high_m());
      devices::MoveLimits limits;
      limits.home_m = volumes[v].transform.world_from_volume(middle);
      moved_[v] = devices::moved(moved_[v], second_hand_->read(), dt_s, middle, limits);
    }
    servo_->send(PoseUpdate{int(v), moved_[v], now_ns});
  }
}

}  // namespace palpate::app
