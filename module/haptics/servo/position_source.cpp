#include "module/haptics/servo/position_source.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/force_vector.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate {
namespace {

constexpr double kMostOfScenes_n = 100.0;
constexpr double kLongest_s = 0.010;  // a thread that was late does not make up for it in one jump
constexpr double kSeen_m = 1e-4;      // about a pixel at arm's length

}  // namespace

PositionSource::PositionSource(const PositionSourceOptions& options)
    : options_(options),
      position_{options.start_m, 0, !options.waits},
      follower_(options.start_m, options.settle_per_s, options.speed_m_per_s),
      there_(!options.waits) {}

void PositionSource::hold(glm::dvec3 place_m, uint32_t buttons) noexcept {
  if (!is_finite(place_m)) return;
  const double away_m = glm::length(place_m);
  if (away_m > options_.workspace_radius_m) place_m *= options_.workspace_radius_m / away_m;
  newest_.put({place_m, buttons, true});
}

void PositionSource::let_go() noexcept {
  newest_.put({glm::dvec3(0.0), 0, false});
}

DeviceInfo PositionSource::info() const {
  DeviceInfo info;
  info.kind = info.name = options_.kind;
  info.max_force_n = 3.0 * kMostOfScenes_n;
  info.workspace_radius_m = options_.workspace_radius_m;
  info.resolution_m = kSeen_m;
  info.actuated_dof = 0;
  info.buttons = 1;
  return info;
}

DeviceReading PositionSource::exchange(const DeviceCommand&) noexcept {
  return exchange_at(monotonic_ns());
}

DeviceReading PositionSource::exchange_at(int64_t now_ns) noexcept {
  newest_.get(position_);
  if (!position_.there) {
    there_ = false;
    DeviceReading nothing;
    nothing.position_m = last_m_;
    nothing.time_ns = now_ns;
    nothing.fault = DeviceFault::kNoHand;
    return nothing;
  }
  if (!there_)
    follower_ = Follower(position_.place_m, options_.settle_per_s, options_.speed_m_per_s);
  there_ = true;
  const double dt_s = started_ ? 1e-9 * double(now_ns - last_ns_) : 0.0;
  last_ns_ = now_ns;
  started_ = true;
  DeviceReading reading;
  reading.position_m = last_m_ = follower_.step(position_.place_m, std::min(dt_s, kLongest_s));
  reading.time_ns = now_ns;
  reading.buttons = position_.buttons;
  reading.fresh = true;
  return reading;
}

}  // namespace palpate
