#pragma once

#include <array>

#include "module/haptics/device.h"
#include "module/haptics/servo/mailbox.h"
#include "module/haptics/servo/servo_clock.h"
#include "module/haptics/servo/statistics.h"
#include "module/haptics/ticker.h"

namespace palpate {

/// How many exchanges with the device there are in one period T. A device answers a command with a
/// position, so with one exchange per period the force is a whole period old: K_max = b / (T/2 +
/// T). With a second exchange right after the tick it is one round trip R old: K_max = b / (T/2 +
/// R). The second answer is kept for the next tick only if the next first answer does not contain
/// the same. With R > T/4 half the period and one exchange would be better still, at the same use
/// of the bus: that is the caller's choice of period.
enum class Exchanges : uint8_t {
  /// twice if nine of ten round trips take less than 0.4 T; measured again after every fault
  kAuto,
  kOnce,  ///< for a device that needs the whole period for one
  /// first with the old force, to get a position; then with the force that the tick computed from
  /// it
  kTwice,
};

struct LoopOptions {
  int64_t period_ns = 1'000'000;    ///< 250 us to 10 ms
  int64_t watchdog_ns = 5'000'000;  ///< ticks further apart than this are TickInput::late
  int64_t stop_ns = 500'000'000;    ///< the tick's own ramp to zero may take this long ...
  int64_t ramp_ns = 20'000'000;     ///< ... then the loop ramps its last force itself, over this
  Exchanges exchanges = Exchanges::kAuto;
};

/// Whether a second exchange fits into the period: see Exchanges. Real-time safe.
class ExchangeTimes {
 public:
  ExchangeTimes(Exchanges wanted, int64_t period_ns)
      : wanted_(wanted), limit_ns_(period_ns * 2 / 5) {}
  void add(const DeviceReading& reading, int64_t took_ns) noexcept;
  bool twice() const noexcept {
    return wanted_ == Exchanges::kTwice || (wanted_ == Exchanges::kAuto && fits_);
  }

 private:
  static constexpr int kTrials = 64;
  Exchanges wanted_;
  int64_t limit_ns_;
  int seen_ = 0, short_ = 0;
  bool fits_ = false;
};

/// Hears of every tick after its force was sent. Given to a Servo: on its thread, so it must be
/// real-time safe; given to a Recorder: on that one's thread, where it may take its time.
class TickListener {
 public:
  virtual ~TickListener() = default;
  virtual void hear(const TickInput& input, const TickOutput& output) noexcept = 0;
};

struct HeardTick {
  TickInput input;
  TickOutput output;
};

/// Those who hear; null: nobody.
using TickListeners = std::array<TickListener*, 4>;

/// Inputs and outputs of the running loop; each has one writer and one reader.
struct ServoPorts {
  static constexpr int kReaders = 2;
  Ring<ControlEvent, 256> events;
  Ring<PoseUpdate, 256> poses;
  std::array<Newest<TickOutput>, kReaders> outputs;
  ServoStatistics statistics;
  std::atomic<bool> stop{false};  ///< ramp to zero, then end
  /// The device has had a force of zero since a stop was asked for.
  std::atomic<bool> at_rest{false};
};

/// What the servo thread runs, period by period. It has no thread of its own, and `clock` is its
/// only source of time, so tests run it step by step. After construction everything is real-time
/// safe: no allocation, lock, log or exception.
class ServoLoop {
 public:
  /// All are borrowed. Listeners may be null.
  ServoLoop(ForceDevice& device, Ticker& ticker, ServoClock& clock, ServoPorts& ports,
            const LoopOptions& options, TickListeners listeners = {});

  /// One period: waits for its deadline, asks the device where it is, ticks, sends. False when a
  /// stop was asked for and force zero has been sent three times: the loop has ended.
  bool run_period() noexcept;
  /// For a crash of the servo thread itself: ramps the last force to zero over options.ramp_ns, one
  /// exchange per ms. Does nothing if the crash was inside the device's own code.
  void ramp_down_now() noexcept;

 private:
  void note_start(int64_t woke_ns) noexcept;
  void note_end(int64_t woke_ns, int64_t end_ns) noexcept;
  DeviceReading exchange() noexcept;
  DeviceReading read() noexcept;
  TickInput gather(const DeviceReading& reading, int64_t now_ns) noexcept;
  void guard(const DeviceCommand& wanted, int64_t now_ns) noexcept;
  bool is_over() noexcept;

  ForceDevice& device_;
  Ticker& ticker_;
  ServoClock& clock_;
  ServoPorts& ports_;
  LoopOptions options_;
  TickListeners listeners_;
  ExchangeTimes exchange_times_;

  DeviceCommand command_;  ///< what the device has, or gets next
  DeviceReading second_;   ///< the answer to the second exchange
  bool have_second_ = false;
  int64_t device_ns_ = 0, tick_ns_ = 0;  ///< longest exchange and the tick of this period
  int64_t deadline_ns_ = 0, last_woke_ns_ = 0, last_end_ns_ = 0, last_tick_at_ns_ = 0;
  bool started_ = false;

  int64_t stop_asked_ns_ = 0, ramp_start_ns_ = 0;
  bool stopping_ = false, ramping_ = false;
  DeviceCommand ramp_from_;
  int zeros_ = 0;
  std::atomic<bool> in_device_{false};
};

}  // namespace palpate
