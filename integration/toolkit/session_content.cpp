#include "integration/toolkit/session_content.h"

#include <utility>

#include "module/haptics/servo/monotonic.h"

namespace palpate::toolkit {

Status SessionContent::push(const PalGrid* grid, PalSampleType type, const void* samples,
                            int64_t time_ns) {
  const auto refused = [](const char* sentence) { return Error{ErrorKind::kBadInput, sentence}; };
  const int64_t now_ns = monotonic_ns();
  const std::lock_guard one_at_a_time(pushing_);
  // stop() removes it only between two frames.
  LiveSequence* sequence = nullptr;
  {
    const std::lock_guard lock(live_mutex_);
    sequence = pushed_.get();
  }
  if (!sequence)
    return refused(
        "The session takes no frames: its scene was not opened with PAL_SCENE_LIVE, or it was "
        "stopped");
  if (time_ns < 0 || time_ns > now_ns)
    return refused("The time of a frame is CLOCK_MONOTONIC when it was taken, not in the future");
  Grid where = pushed_grid_;
  if (grid) {
    auto given = grid_of(*grid);
    if (!given) return given.error();
    where = *given;
  }
  auto frame = volume_of(where, type, samples);
  if (!frame) return frame.error();
  sequence->push(*frame, time_ns > 0 ? time_ns : now_ns);
  return Nothing{};
}

LiveNumbers SessionContent::live_numbers() {
  if (connected.live) return connected.live->numbers();
  const std::lock_guard lock(live_mutex_);
  return pushed_ ? pushed_->numbers() : last_numbers_;
}

void SessionContent::stop() {
  const std::lock_guard one_at_a_time(stopping_);
  {
    const std::lock_guard pushing(pushing_);
    std::unique_ptr<LiveSequence> ended;
    {
      const std::lock_guard lock(live_mutex_);
      if (pushed_) last_numbers_ = pushed_->numbers();
      ended = std::move(pushed_);
    }
  }
  connected.stop();
}

Status SessionContent::finish() {
  stop();
  Status done = Nothing{};
  if (!connected.session || std::exchange(finished_, true)) return done;
  const auto also = [&done](const Status& next) {
    if (done) done = next;
  };
  running::FlightRecorder& flight = connected.flight;
  also(flight.finish());
  if (flight.black_box() && flight.black_box()->trouble())
    also(Error{ErrorKind::kBadOutput, *flight.black_box()->trouble()});
  if (const auto lost = flight.lost()) also(Error{ErrorKind::kBadOutput, *lost});
  return done;
}

}  // namespace palpate::toolkit
