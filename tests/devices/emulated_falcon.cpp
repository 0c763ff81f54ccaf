#include "tests/devices/emulated_falcon.h"

#include <algorithm>
#include <cmath>

#include "integration/devices/falcon_kinematics.h"

namespace palpate::devices::test {
namespace {

constexpr int kPacketBaud = 0x0002, kLoaderBaud = 0x4138, kImageBaud = 0x0015;
constexpr uint8_t kModemStatus = 0x01, kLineStatus = 0x60;
// Counts beyond which all index marks have been passed.
constexpr int kFarOut = 900, kFarIn = -900;

int number(const Bytes& packet, size_t at) {
  int value = 0;
  for (size_t n = 4; n-- > 0;) value = value * 16 + (packet[at + n] - 'A');
  return value >= 32768 ? value - 65536 : value;
}

}  // namespace

EmulatedFalcon::EmulatedFalcon(Options options)
    : EmulatedDevice({0x0403, 0xcb48, options.product_name, 0xff, 0x81, 0x02, false, 64},
                     options.port),
      options_(std::move(options)) {
  running_ = options_.firmware;
  homed_.fill(options_.homed);
  if (!options_.homed) offset_ = {310, -220, 150};
  place({0, 0, 0.130});
}

std::vector<EmulatedFalcon::Received> EmulatedFalcon::received() const {
  const Lock lock(mutex_);
  return received_;
}

EmulatedFalcon::Received EmulatedFalcon::last() const {
  const Lock lock(mutex_);
  return received_.empty() ? Received() : received_.back();
}

size_t EmulatedFalcon::received_count() const {
  const Lock lock(mutex_);
  return received_.size();
}

bool EmulatedFalcon::pushed(size_t command) const {
  const Lock lock(mutex_);
  return received_.at(command).pushes();
}

size_t EmulatedFalcon::malformed() const {
  const Lock lock(mutex_);
  return malformed_;
}

void EmulatedFalcon::place(glm::dvec3 position) {
  const auto joints = falcon::inverse(position);
  const glm::dvec3 counts = falcon::encoder_counts(joints.value().arm);
  set_counts({int(std::lround(counts.x)), int(std::lround(counts.y)), int(std::lround(counts.z))});
}

void EmulatedFalcon::set_counts(std::array<int, 3> counts) {
  const Lock lock(mutex_);
  counts_ = counts;
}

std::array<int, 3> EmulatedFalcon::counts() const {
  const Lock lock(mutex_);
  return counts_;
}

void EmulatedFalcon::press(int buttons) {
  const Lock lock(mutex_);
  buttons_ = buttons;
}

void EmulatedFalcon::lose_homing() {
  const Lock lock(mutex_);
  homed_.fill(false);
  was_out_.fill(false);
  offset_ = {-400, 90, 260};
}

void EmulatedFalcon::power_cycle() {
  const Lock lock(mutex_);
  running_ = false;
  greeted_ = loading_ = false;
  homed_.fill(false);
  was_out_.fill(false);
  buffer_.clear();
  coming_.clear();
  // Motors without power give no force.
  received_.emplace_back();
}

void EmulatedFalcon::set(Faults faults) {
  change([&](Faults& now) { now = faults; });
}

void EmulatedFalcon::change(const std::function<void(Faults&)>& change) {
  const Lock lock(mutex_);
  change(faults_);
  stuck_at_ = counts_;
  changed();
}

void EmulatedFalcon::delay_next(std::deque<int64_t> delays_ns) {
  const Lock lock(mutex_);
  delays_ns_ = std::move(delays_ns);
}

int EmulatedFalcon::uploads() const {
  const Lock lock(mutex_);
  return uploads_;
}

bool EmulatedFalcon::runs_firmware() const {
  const Lock lock(mutex_);
  return running_;
}

bool EmulatedFalcon::event_character_on() const {
  const Lock lock(mutex_);
  return event_character_ == '>';
}

int EmulatedFalcon::latency_ms() const {
  const Lock lock(mutex_);
  return latency_ms_;
}

void EmulatedFalcon::plugged() {
  baud_ = 0;
  latency_ms_ = 16;
  event_character_ = -1;
  buffer_.clear();
  coming_.clear();
  commands_.clear();
  flush_ = false;
}

int EmulatedFalcon::control(uint8_t type, uint8_t request, uint16_t value, const Bytes& out,
                            Bytes& in) {
  if (type != 0x40) return EmulatedDevice::control(type, request, value, out, in);
  if (faults_.stall_control) return -EPIPE;
  switch (request) {
    case 0:
      if (value == 1) buffer_.clear();
      if (value == 2) commands_.clear();
      return value <= 2 ? 0 : -EPIPE;
    case 1:
      if (value & 0x0100) {
        const bool dtr = value & 1;
        if (dtr && !dtr_ && !running_) greeted_ = loading_ = false;
        dtr_ = dtr;
      }
      return 0;
    case 3:
      baud_ = value;
      return 0;
    case 6:
      if (faults_.no_event_character) return -EPIPE;
      event_character_ = value & 0x0100 ? value & 0xff : -1;
      return 0;
    case 9:
      latency_ms_ = value;
      return value >= 1 ? 0 : -EPIPE;
    case 2:
    case 4:
      return 0;
    default:
      return -EPIPE;
  }
}

int EmulatedFalcon::take(const Bytes& bytes) {
  if (faults_.stall_out) return -EPIPE;
  if (faults_.refuses_commands) return kNever;
  if (!running_) {
    load(bytes);
    return 0;
  }
  // At another rate the bytes are noise.
  if (baud_ != kPacketBaud) return 0;
  commands_.insert(commands_.end(), bytes.begin(), bytes.end());
  obey();
  return 0;
}

void EmulatedFalcon::load(const Bytes& bytes) {
  if (baud_ == kLoaderBaud && bytes == Bytes{0x0a, 0x43, 0x0d} && dtr_) {
    if (faults_.failing_uploads > 0) {
      --faults_.failing_uploads;
      // A real one sends this for wrong bits.
      say({0x00, 0x17}, 0);
      return;
    }
    greeted_ = true;
    say({0x00, 0x0a, 0x44, 0x2c, 0x0d}, 0);
  } else if (baud_ == kImageBaud && greeted_ && !dtr_) {
    if (!loading_ && bytes == Bytes{0x41}) {
      loading_ = true;
      loaded_.clear();
      ++uploads_;
    } else if (loading_) {
      loaded_.insert(loaded_.end(), bytes.begin(), bytes.end());
      if (loaded_ == options_.image) running_ = true;
    }
    say(bytes, 0);
  }
}

void EmulatedFalcon::obey() {
  while (!commands_.empty()) {
    if (commands_[0] != '<') {
      ++malformed_;
      commands_.erase(commands_.begin());
      continue;
    }
    if (commands_.size() < 16) return;
    const bool whole = commands_[15] == '>' && commands_[14] == 'A' &&
                       std::all_of(commands_.begin() + 1, commands_.begin() + 14,
                                   [](uint8_t b) { return b >= 'A' && b <= 'P'; });
    if (!whole) {
      ++malformed_;
      commands_.erase(commands_.begin());
      continue;
    }
    const int flags = commands_[13] - 'A';
    received_.push_back({{number(commands_, 1), number(commands_, 5), number(commands_, 9)},
                         flags & 0xe,
                         (flags & 1) != 0});
    commands_.erase(commands_.begin(), commands_.begin() + 16);
    home(flags & 1);
    if (faults_.silent) continue;
    int64_t delay_ns = options_.answer_delay_ns;
    if (!delays_ns_.empty()) {
      delay_ns += delays_ns_.front();
      delays_ns_.pop_front();
    }
    say(faults_.mangle ? faults_.mangle(answer()) : answer(), delay_ns);
  }
}

/// An index mark is found after the arm was all the way out and then all the way in, with the
/// homing bit in every packet.
void EmulatedFalcon::home(bool homing) {
  for (size_t e = 0; e < 3; ++e) {
    if (homed_[e]) continue;
    if (!homing) was_out_[e] = false;
    if (homing && counts_[e] > kFarOut) was_out_[e] = true;
    if (homing && was_out_[e] && counts_[e] < kFarIn) {
      homed_[e] = true;
      offset_[e] = 0;
    }
  }
}

int EmulatedFalcon::reported(int encoder) const {
  const auto e = size_t(encoder);
  return (faults_.stuck_encoder == encoder ? stuck_at_[e] : counts_[e]) + offset_[e];
}

Bytes EmulatedFalcon::answer() const {
  Bytes bytes = {'<'};
  for (int e = 0; e < 3; ++e) {
    int rest = reported(e) & 0xffff;
    for (int n = 0; n < 4; ++n, rest >>= 4) bytes.push_back(uint8_t('A' + (rest & 0xf)));
  }
  const int homed = (homed_[0] ? 1 : 0) | (homed_[1] ? 2 : 0) | (homed_[2] ? 4 : 0);
  bytes.push_back(uint8_t('A' + buttons_ + (homed << 4)));
  bytes.push_back('A');
  bytes.push_back('>');
  return bytes;
}

void EmulatedFalcon::say(const Bytes& bytes, int64_t delay_ns) {
  coming_.emplace_back(monotonic_ns() + delay_ns, bytes);
}

int64_t EmulatedFalcon::serve(int64_t now_ns) {
  while (!coming_.empty() && coming_.front().first <= now_ns) {
    for (const uint8_t byte : coming_.front().second) {
      // The event character has no effect as the first byte.
      flush_ |= int(byte) == event_character_ && !buffer_.empty();
      buffer_.push_back(byte);
    }
    coming_.pop_front();
  }
  int64_t again = coming_.empty() ? kNoTime : coming_.front().first;
  for (;;) {
    const bool reads = std::any_of(waiting().begin(), waiting().end(),
                                   [](const Urb& urb) { return urb.endpoint == 0x81; });
    if (!reads) return again;
    if (faults_.stall_in || faults_.ends_with_error) {
      complete_read(faults_.stall_in ? -EPIPE : -EPROTO, {});
      continue;
    }
    if (faults_.mute_status) return again;
    const int64_t timer = last_packet_ns_ + int64_t(latency_ms_) * 1'000'000;
    if (!flush_ && buffer_.size() < 62 && now_ns < timer) return std::min(again, timer);
    const size_t count = std::min({buffer_.size(), size_t(62), faults_.packet_limit});
    Bytes packet = {kModemStatus, kLineStatus};
    packet.insert(packet.end(), buffer_.begin(), buffer_.begin() + ptrdiff_t(count));
    buffer_.erase(buffer_.begin(), buffer_.begin() + ptrdiff_t(count));
    if (buffer_.empty()) flush_ = false;
    last_packet_ns_ = now_ns;
    complete_read(0, std::move(packet));
  }
}

void EmulatedFalcon::cleared_halt(uint8_t endpoint) {
  if (faults_.stalls_for_good) return;
  (endpoint & 0x80 ? faults_.stall_in : faults_.stall_out) = false;
}

}  // namespace palpate::devices::test
