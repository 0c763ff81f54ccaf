#include "integration/running/flight_recorder.h"

#include <fmt/format.h>

#include <utility>

namespace palpate::running {
namespace {

constexpr int64_t kPeriod_ns = 1'000'000;  // of the servo loop

}  // namespace

Result<FlightRecorder> FlightRecorder::start(const FlightRecorderOptions& options,
                                             const loading::ReplayKey& key) {
  FlightRecorder flight;
  std::vector<TickListener*> listeners;
  if (options.sums_up || options.table) {
    auto log = TickLog::start(options.table.value_or(""));
    if (!log) return log.error();
    flight.log_ = std::move(*log);
    listeners.push_back(flight.log_.get());
  }
  if (options.black_box) {
    BlackBoxOptions box;
    box.folder = *options.black_box;
    flight.black_box_ = std::make_unique<BlackBox>(box);
    listeners.push_back(flight.black_box_.get());
  }
  if (options.recording) {
    auto recorder =
        TickRecorder::start(*options.recording, text_of(key), kPeriod_ns, std::move(listeners));
    if (!recorder) return recorder.error();
    flight.recorder_ = std::move(*recorder);
  } else if (!listeners.empty()) {
    flight.recorder_ = std::make_unique<TickRecorder>(std::move(listeners));
  }
  flight.needs_every_tick_ = options.table || options.recording;
  return flight;
}

Status FlightRecorder::finish() {
  const Status recorded = recorder_ ? recorder_->finish() : Status(Nothing{});
  const Status logged = log_ ? log_->finish() : Status(Nothing{});
  return logged ? recorded : logged;
}

std::optional<std::string> FlightRecorder::lost() const {
  if (!needs_every_tick_ || recorder_->lost() == 0) return std::nullopt;
  return fmt::format(
      "{} ticks are missing in the table or the recording: the disk was too slow, or the machine "
      "too busy",
      recorder_->lost());
}

}  // namespace palpate::running
