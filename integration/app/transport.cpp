#include "integration/app/transport.h"

#include <algorithm>
#include <cmath>

namespace palpate::app {

void Transport::toggle() {
  if (allowed_) play(!playing_);
}

void Transport::play(bool on) {
  playing_ = on;
  if (on) {
    const std::lock_guard lock(mutex_);
    scrubbed_s_.clear();
  }
  const auto felt = palpation_.scene();
  for (size_t v = 0; v < felt->volumes.size(); ++v) {
    if (felt->volumes[v].data->is_still()) continue;
    if (on)
      palpation_.play(v);
    else
      palpation_.send({ControlEvent::Kind::kRate, int(v), 0.0});
  }
}

void Transport::scrub(const SceneMoment& moment, double share) {
  if (!allowed_) return;
  play(false);
  const auto felt = palpation_.scene();
  const std::lock_guard lock(mutex_);
  if (scrubbed_s_.empty())
    for (int v = 0; v < moment.volume_count; ++v)
      scrubbed_s_.push_back(moment.volumes[size_t(v)].time_s);
  for (int v = 0; v < std::min(int(felt->volumes.size()), moment.volume_count); ++v) {
    const MovingVolume& volume = *felt->volumes[size_t(v)].data;
    if (volume.is_still()) continue;
    const double length_s = volume.times.length_s();
    double& to_s = scrubbed_s_[size_t(v)];
    to_s += share * length_s;
    if (volume.times.cyclic())
      to_s -= length_s * std::floor(to_s / length_s);
    else
      to_s = std::clamp(to_s, 0.0, length_s);
    palpation_.send({ControlEvent::Kind::kScrub, v, to_s});
  }
}

}  // namespace palpate::app
