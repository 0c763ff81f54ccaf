#include "module/haptics/servo/host_loop.h"

#include <cmath>

#include "module/haptics/servo/monotonic.h"

namespace palpate {
namespace {

/// The force of a tick has to go out with that tick.
LoopOptions twice(LoopOptions options) {
  options.exchanges = Exchanges::kTwice;
  return options;
}

}  // namespace

DeviceReading HostLoop::HostLoopDevice::exchange(const DeviceCommand& wanted) noexcept {
  command = wanted;
  const DeviceReading answer = reading;
  // The second exchange of a period brings no new position.
  reading.fresh = false;
  return answer;
}

HostLoop::HostLoop(Ticker& ticker, const DeviceInfo& device, const LoopOptions& options,
                   TickListeners listeners)
    : device_(device), loop_(device_, ticker, clock_, ports_, twice(options), listeners) {}

glm::dvec3 HostLoop::tick(const HostTick& tick) noexcept {
  if (over_) return glm::dvec3(0.0);
  const int64_t called_ns = monotonic_ns();
  const int64_t time_ns = tick.time_ns == 0 ? called_ns : tick.time_ns;
  const glm::dvec3 x = tick.position_m;
  const bool finite = std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z);
  const bool rises = time_ns > clock_.time_ns;
  clock_.time_ns = rises ? time_ns : clock_.time_ns + 1;
  ahead_ns_.store(clock_.time_ns - called_ns, std::memory_order_relaxed);

  DeviceReading& reading = device_.reading;
  reading.fault = finite && rises ? DeviceFault::kNone : DeviceFault::kGarbage;
  reading.fresh = finite && rises;
  if (finite) reading.position_m = x;
  reading.time_ns = clock_.time_ns;
  reading.buttons = tick.buttons;
  reading.grip = believable(tick.grip);
  over_ = !loop_.run_period();
  return over_ ? glm::dvec3(0.0) : device_.command.force_n;
}

bool HostLoop::send(PoseUpdate pose) noexcept {
  pose.time_ns += ahead_ns_.load(std::memory_order_relaxed);
  return ports_.poses.push(pose);
}

}  // namespace palpate
