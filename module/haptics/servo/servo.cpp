#include "module/haptics/servo/servo.h"

#include <cassert>

#include "module/haptics/servo/emergency.h"
#include "module/haptics/servo/emergency_system.h"

namespace palpate {
namespace {

Status check(const ServoOptions& options) {
  const LoopOptions& loop = options.loop;
  const auto refuse = [](std::string sentence) {
    return Status(Error{ErrorKind::kBadInput, std::move(sentence)});
  };
  if (loop.period_ns < 250'000 || loop.period_ns > 10'000'000)
    return refuse("The servo period is " + std::to_string(loop.period_ns / 1000) +
                  " us: it must be between 250 and 10000 us.");
  if (loop.watchdog_ns <= loop.period_ns)
    return refuse("The watchdog's time must be longer than the servo period.");
  if (loop.stop_ns < 0 || loop.ramp_ns <= 0)
    return refuse("The times for stopping and for the ramp must be positive.");
  if (options.real_time.priority < 0 || options.real_time.priority > 99)
    return refuse("The real-time priority must be between 0 (none) and 99.");
  return Nothing{};
}

}  // namespace

Result<std::unique_ptr<Servo>> Servo::start(ForceDevice& device, Ticker& ticker,
                                            const ServoOptions& options, ServoClock* clock) {
  if (const Status fine = check(options); !fine) return fine.error();
  std::unique_ptr<Servo> servo(new Servo);
  servo->ports_ = std::make_unique<ServoPorts>();
  servo->own_clock_ = std::make_unique<MonotonicClock>();
  servo->preparation_ = std::make_unique<ProcessPreparation>(options.real_time, servo->report_);
  servo->loop_ = std::make_unique<ServoLoop>(device, ticker, clock ? *clock : *servo->own_clock_,
                                             *servo->ports_, options.loop, options.listeners);
  servo->thread_ = emergency::thread_without_signals(
      [raw = servo.get(), wanted = options.real_time] { raw->run(*raw->loop_, wanted); });
  if (!servo->seated_.get_future().get())
    return Error{ErrorKind::kBadInput, "Eight servo loops run already: stop one of them first."};
  return servo;
}

void Servo::run(ServoLoop& loop, const RealTimeOptions& options) {
  const bool seated = emergency::join(&loop);
  if (seated) prepare_thread(options, report_);
  seated_.set_value(seated);
  while (seated && loop.run_period()) {
  }
  emergency::leave();
}

Servo::~Servo() {
  stop();
}

void Servo::stop() {
  if (!thread_.joinable()) return;
  ports_->stop.store(true);
  thread_.join();
}

bool Servo::newest(int reader, TickOutput& output) noexcept {
  assert(reader >= 0 && reader < ServoPorts::kReaders);
  return ports_->outputs[size_t(reader)].get(output);
}

}  // namespace palpate
