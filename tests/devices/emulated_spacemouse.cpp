#include "tests/devices/emulated_spacemouse.h"

namespace palpate::devices::test {
namespace {

constexpr int64_t kRepeatNs = 8'000'000;
constexpr size_t kMostWaiting = 8;

void append(Bytes& bytes, int value) {
  bytes.push_back(uint8_t(value & 0xff));
  bytes.push_back(uint8_t(value >> 8 & 0xff));
}

}  // namespace

EmulatedSpaceMouse::EmulatedSpaceMouse(const Options& options)
    : EmulatedDevice({options.vendor, options.product, options.product_name, 0x03, 0x81, 0, true,
                      uint8_t(options.six_axes_in_one ? 16 : 8)},
                     options.port),
      options_(options) {}

void EmulatedSpaceMouse::plugged() {
  axes_ = {};
  repeats_ = false;
  reports_.clear();
}

void EmulatedSpaceMouse::push(std::array<int, 6> axes) {
  const Lock lock(mutex_);
  axes_ = axes;
  repeats_ = axes != std::array<int, 6>{};
  say_motion();
  next_ns_ = monotonic_ns() + kRepeatNs;
  changed();
}

void EmulatedSpaceMouse::press(uint32_t buttons) {
  say({3, uint8_t(buttons & 0xff), uint8_t(buttons >> 8 & 0xff), uint8_t(buttons >> 16 & 0xff),
       uint8_t(buttons >> 24)});
}

void EmulatedSpaceMouse::fall_silent() {
  const Lock lock(mutex_);
  repeats_ = false;
  reports_.clear();
}

void EmulatedSpaceMouse::say(Bytes report) {
  const Lock lock(mutex_);
  queue(std::move(report));
  changed();
}

void EmulatedSpaceMouse::stall() {
  const Lock lock(mutex_);
  stalled_ = true;
  changed();
}

void EmulatedSpaceMouse::stall_ever() {
  const Lock lock(mutex_);
  stalled_ = stalled_ever_ = true;
  changed();
}

void EmulatedSpaceMouse::say_motion() {
  Bytes first = {1}, second = {2};
  for (size_t a = 0; a < 6; ++a)
    append(a < 3 || options_.six_axes_in_one ? first : second, axes_[a]);
  queue(std::move(first));
  if (!options_.six_axes_in_one) queue(std::move(second));
}

void EmulatedSpaceMouse::queue(Bytes report) {
  reports_.push_back(std::move(report));
  while (reports_.size() > kMostWaiting) reports_.pop_front();
}

int64_t EmulatedSpaceMouse::serve(int64_t now_ns) {
  if (repeats_ && now_ns >= next_ns_) {
    say_motion();
    next_ns_ = now_ns + kRepeatNs;
  }
  while (!waiting().empty() && (stalled_ || !reports_.empty())) {
    if (stalled_) {
      complete_read(-EPIPE, {});
      continue;
    }
    complete_read(0, std::move(reports_.front()));
    reports_.pop_front();
  }
  return repeats_ ? next_ns_ : kNoTime;
}

void EmulatedSpaceMouse::cleared_halt(uint8_t) {
  if (!stalled_ever_) stalled_ = false;
}

}  // namespace palpate::devices::test
