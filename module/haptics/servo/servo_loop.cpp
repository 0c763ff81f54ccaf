#include "module/haptics/servo/servo_loop.h"

#include <algorithm>

#include "module/haptics/force_vector.h"
#include "module/haptics/servo/emergency.h"

namespace palpate {

void ExchangeTimes::add(const DeviceReading& reading, int64_t took_ns) noexcept {
  // A missing device answers at once, which says nothing about its real round trip.
  if (reading.fault != DeviceFault::kNone) {
    seen_ = short_ = 0;
    fits_ = false;
  }
  if (reading.fault != DeviceFault::kNone || !reading.fresh || seen_ == kTrials) return;
  ++seen_;
  if (took_ns < limit_ns_) ++short_;
  fits_ = seen_ == kTrials && 10 * short_ >= 9 * kTrials;
}

ServoLoop::ServoLoop(ForceDevice& device, Ticker& ticker, ServoClock& clock, ServoPorts& ports,
                     const LoopOptions& options, TickListeners listeners)
    : device_(device),
      ticker_(ticker),
      clock_(clock),
      ports_(ports),
      options_(options),
      listeners_(listeners),
      exchange_times_(options.exchanges, options.period_ns) {}

bool ServoLoop::run_period() noexcept {
  if (!started_) deadline_ns_ = clock_.now_ns() + options_.period_ns;
  clock_.sleep_until(deadline_ns_);
  const int64_t woke_ns = clock_.now_ns();
  note_start(woke_ns);

  device_ns_ = 0;
  const DeviceReading reading = read();
  const int64_t now_ns = clock_.now_ns();
  const TickInput input = gather(reading, now_ns);
  const TickOutput output = ticker_.tick(input);
  const int64_t ticked_ns = clock_.now_ns();
  tick_ns_ = ticked_ns - now_ns;
  guard(output.command, ticked_ns);
  have_second_ = exchange_times_.twice();
  if (have_second_) second_ = exchange();

  const bool over = is_over();
  for (TickListener* listener : listeners_)
    if (listener) listener->hear(input, output);
  for (auto& reader : ports_.outputs) reader.put(output);
  note_end(woke_ns, clock_.now_ns());
  return !over;
}

void ServoLoop::note_start(int64_t woke_ns) noexcept {
  ServoStatistics& statistics = ports_.statistics;
  const int64_t behind_ns = woke_ns - deadline_ns_;
  if (started_) statistics.period.add(woke_ns - last_woke_ns_);
  statistics.lateness.add(behind_ns);
  if (behind_ns > options_.period_ns / 2) {
    const bool overrun = started_ && 2 * (last_end_ns_ - deadline_ns_) > behind_ns;
    const MissCause cause = !overrun                ? MissCause::kWokeLate
                            : device_ns_ > tick_ns_ ? MissCause::kDeviceLong
                                                    : MissCause::kTickLong;
    count_up(statistics.misses[int(cause)]);
    // Lost time is not made up for: ticks in a burst would give scene and hand a wrong speed.
    deadline_ns_ = woke_ns;
  }
  last_woke_ns_ = woke_ns;
}

void ServoLoop::note_end(int64_t woke_ns, int64_t end_ns) noexcept {
  ServoStatistics& statistics = ports_.statistics;
  statistics.tick.add(tick_ns_);
  statistics.work.add(end_ns - woke_ns);
  statistics.twice.store(exchange_times_.twice(), std::memory_order_relaxed);
  count_up(statistics.ticks);
  deadline_ns_ += options_.period_ns;
  if (deadline_ns_ - end_ns > options_.period_ns) {
    // The clock went back: sleeping until the old deadline could take for ever.
    count_up(statistics.misses[int(MissCause::kClock)]);
    deadline_ns_ = end_ns + options_.period_ns;
  }
  last_end_ns_ = end_ns;
  started_ = true;
}

DeviceReading ServoLoop::exchange() noexcept {
  const int64_t from_ns = clock_.now_ns();
  // The compiler may not move these around the call: a signal handler of this thread reads it.
  in_device_.store(true);
  const DeviceReading reading = device_.exchange(command_);
  in_device_.store(false);
  const int64_t took_ns = clock_.now_ns() - from_ns;
  ports_.statistics.device.add(took_ns);
  exchange_times_.add(reading, took_ns);
  device_ns_ = std::max(device_ns_, took_ns);
  zeros_ = command_.force_n == glm::dvec3(0.0) ? zeros_ + 1 : 0;
  return reading;
}

DeviceReading ServoLoop::read() noexcept {
  DeviceReading reading = exchange();
  if (!have_second_) return reading;
  // A position or a fault that only the second answer brought must not be lost.
  if (second_.fault != DeviceFault::kNone && reading.fault == DeviceFault::kNone)
    reading.fault = second_.fault;
  if (second_.fresh && !reading.fresh) {
    reading.position_m = second_.position_m;
    reading.time_ns = second_.time_ns;
    reading.grip = second_.grip;
    reading.fresh = true;
  }
  return reading;
}

TickInput ServoLoop::gather(const DeviceReading& reading, int64_t now_ns) noexcept {
  TickInput input;
  const int64_t passed_ns = started_ ? now_ns - last_tick_at_ns_ : options_.period_ns;
  last_tick_at_ns_ = now_ns;
  input.dt_s = double(passed_ns) * 1e-9;
  input.now_ns = now_ns;
  input.reading = reading;
  input.late = passed_ns > options_.watchdog_ns;
  if (input.late) count_up(ports_.statistics.late);
  if (!stopping_ && (ports_.stop.load(std::memory_order_relaxed) || emergency::is_asked())) {
    stopping_ = true;
    stop_asked_ns_ = now_ns;
  }
  input.stop = stopping_;
  while (input.pose_count < int(input.poses.size()) &&
         ports_.poses.pop(input.poses[input.pose_count]))
    ++input.pose_count;
  while (input.event_count < int(input.events.size()) &&
         ports_.events.pop(input.events[input.event_count]))
    ++input.event_count;
  return input;
}

/// The tick limits its own force. This only checks that the tick itself works: that its force is
/// finite, and that a stop comes to an end.
void ServoLoop::guard(const DeviceCommand& wanted, int64_t now_ns) noexcept {
  const bool finite = is_finite(wanted.force_n) && is_finite(wanted.torque_n_m);
  if (!finite) count_up(ports_.statistics.not_finite);
  const bool too_long = stopping_ && now_ns - stop_asked_ns_ > options_.stop_ns;
  if (!ramping_ && (!finite || too_long)) {
    ramping_ = true;
    ramp_start_ns_ = now_ns;
    ramp_from_ = command_;
  }
  if (!ramping_) {
    command_ = wanted;
    return;
  }
  const double done = double(now_ns - ramp_start_ns_) / double(options_.ramp_ns);
  const double left = done >= 0.0 && done < 1.0 ? 1.0 - done : 0.0;
  command_.force_n = ramp_from_.force_n * left;
  command_.torque_n_m = ramp_from_.torque_n_m * left;
  command_.in_contact = false;
  // The tick is trusted again once it asks for zero by itself.
  const bool asks_for_none =
      wanted.force_n == glm::dvec3(0.0) && wanted.torque_n_m == glm::dvec3(0.0);
  if (!stopping_ && asks_for_none && done >= 1.0) ramping_ = false;
}

bool ServoLoop::is_over() noexcept {
  const bool at_zero = stopping_ && command_.force_n == glm::dvec3(0.0) && zeros_ >= 3;
  ports_.at_rest.store(at_zero, std::memory_order_release);
  emergency::rest(at_zero);
  return at_zero && ports_.stop.load(std::memory_order_relaxed);
}

void ServoLoop::ramp_down_now() noexcept {
  if (in_device_.load()) return;
  const auto finite = [](glm::dvec3 v) { return is_finite(v) ? v : glm::dvec3(0.0); };
  const glm::dvec3 from_n = finite(command_.force_n), from_n_m = finite(command_.torque_n_m);
  const auto steps = int(std::max<int64_t>(1, options_.ramp_ns / 1'000'000));
  for (int step = 1; step <= steps + 2; ++step) {
    const double left = std::max(0.0, 1.0 - double(step) / double(steps));
    command_.force_n = from_n * left;
    command_.torque_n_m = from_n_m * left;
    device_.exchange(command_);
    clock_.sleep_until(clock_.now_ns() + 1'000'000);
  }
}

}  // namespace palpate
