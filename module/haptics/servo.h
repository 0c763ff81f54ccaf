#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "compute/volume/result.h"
#include "module/haptics/real_time.h"
#include "module/haptics/servo_loop.h"

namespace palpate {

struct ServoOptions {
  LoopOptions loop;
  RealTimeOptions real_time;
  /// Hear of every tick on the servo thread, as a Recorder does. Borrowed, may be null.
  TickListeners listeners = {};
};

/// The thread that lets the hand feel: a ServoLoop, once per period, with what the system gives of
/// real-time. Made and destroyed by one thread, its owner. While it runs, device and ticker are the
/// servo thread's alone.
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

  /// Asks for the ramp to zero, waits until the device has had zero, and ends the thread: after the
  /// tick's ramp, or LoopOptions::stop_ns + ramp_ns at the latest, plus what the device takes to
  /// answer. Further calls do nothing.
  void stop();
  /// Whether a stop was asked for and the device has had a force of zero since. Any thread.
  bool at_rest() const noexcept { return ports_->at_rest.load(std::memory_order_acquire); }

  /// What the system gave. Does not change. Any thread.
  const ServoReport& report() const { return report_; }

  /// Into the loop, in order, at most four per tick; false, and counted, if 256 wait already. One
  /// thread each; wait-free.
  bool send(const ControlEvent& event) noexcept { return ports_->events.push(event); }
  /// Both or neither.
  bool send(const ControlEvent& first, const ControlEvent& second) noexcept {
    return ports_->events.push(first, second);
  }
  bool send(const PoseUpdate& pose) noexcept { return ports_->poses.push(pose); }
  /// Events and poses that were refused. Any thread.
  uint64_t dropped() const noexcept { return ports_->events.dropped() + ports_->poses.dropped(); }

  /// The newest tick for reader 0 or 1 (say, the renderer and the live line), each one thread's:
  /// true if it is another than last time. Before the first tick `output` is left alone. Wait-free.
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
  enum class Start { kPending, kRunning, kRefused };
  std::atomic<Start> start_{Start::kPending};
  std::thread thread_;
};

}  // namespace palpate
