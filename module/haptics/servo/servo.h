#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "compute/volume/result.h"
#include "module/haptics/servo/real_time.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate {

struct ServoOptions {
  LoopOptions loop;
  RealTimeOptions real_time;
  /// Hear of every tick on the servo thread, as a Recorder does. Borrowed, may be null.
  TickListeners listeners = {};
};

/// The servo thread: runs a ServoLoop once per period, with the real-time privileges that the
/// system grants. Made and destroyed by one thread, its owner. While it runs only the servo thread
/// uses device and ticker.
class Servo {
 public:
  /// Starts the thread; it runs when this returns. device and ticker are borrowed, `clock` too
  /// (null: the monotonic one). kBadInput for a period outside 0.25 to 10 ms, other options that
  /// make no sense, or a ninth loop in one process.
  static Result<std::unique_ptr<Servo>> start(ForceDevice& device, Ticker& ticker,
                                              const ServoOptions& options = {},
                                              ServoClock* clock = nullptr);
  /// As stop().
  ~Servo();
  Servo(const Servo&) = delete;
  Servo& operator=(const Servo&) = delete;

  /// Asks for the ramp to zero, waits until force zero has been sent to the device, and ends the
  /// thread. This takes as long as the tick's ramp, at most LoopOptions::stop_ns + ramp_ns and the
  /// device's time to answer. Further calls do nothing.
  void stop();
  /// Whether a stop was asked for and the device has had a force of zero since. Any thread.
  bool at_rest() const noexcept { return ports_->at_rest.load(std::memory_order_acquire); }

  /// The privileges that the system granted. Does not change. Any thread.
  const ServoReport& report() const { return report_; }

  /// Sends to the loop, which takes at most four per tick, in order. False, and counted, if 256
  /// already wait. One thread for each of the two; wait-free.
  bool send(const ControlEvent& event) noexcept { return ports_->events.push(event); }
  /// Both or neither.
  bool send(const ControlEvent& first, const ControlEvent& second) noexcept {
    return ports_->events.push(first, second);
  }
  bool send(const PoseUpdate& pose) noexcept { return ports_->poses.push(pose); }
  /// Events and poses that were refused. Any thread.
  uint64_t dropped() const noexcept { return ports_->events.dropped() + ports_->poses.dropped(); }

  /// The newest tick for reader 0 or 1 (for example the renderer and the line on the console), each
  /// used by one thread. True if it is another than last time. Before the first tick `output` is
  /// left alone. Wait-free.
  bool newest(int reader, TickOutput& output) noexcept;
  /// Any thread, while it runs.
  const ServoStatistics& statistics() const noexcept { return ports_->statistics; }

 private:
  Servo() = default;
  void run(ServoLoop& loop, const RealTimeOptions& options);

  std::unique_ptr<ServoPorts> ports_;
  std::unique_ptr<MonotonicClock> own_clock_;
  std::unique_ptr<ServoLoop> loop_;
  std::unique_ptr<ProcessPreparation> preparation_;
  ServoReport report_;
  /// Whether the thread's loop is one of the eight that can be stopped in an emergency. No
  /// std::atomic::wait(): on Windows, GCC 12's can miss the notification.
  std::promise<bool> seated_;
  std::thread thread_;
};

}  // namespace palpate
