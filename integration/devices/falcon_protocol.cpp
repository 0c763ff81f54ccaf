#include "integration/devices/falcon_protocol.h"

#include <algorithm>

namespace palpate::devices::falcon {
namespace {

constexpr uint8_t kZero = 0x41;
constexpr uint8_t kHomingFlag = 0x1;
constexpr size_t kNumbers = 3, kNibbles = 4;
constexpr size_t kStatusByte = 13, kSpareByte = 14;
constexpr int kLargestStatus = 0x7f;  // 4 bits of buttons, 3 of homing

void put(int16_t number, uint8_t* bytes) noexcept {
  const auto bits = uint16_t(number);
  for (size_t n = 0; n < kNibbles; ++n) bytes[n] = uint8_t(((bits >> (4 * n)) & 0xf) + kZero);
}

/// False if a byte is not a nibble.
bool get(const uint8_t* bytes, int16_t& number) noexcept {
  unsigned bits = 0;
  for (size_t n = 0; n < kNibbles; ++n) {
    const int nibble = bytes[n] - kZero;
    if (nibble < 0 || nibble > 0xf) return false;
    bits |= unsigned(nibble) << (4 * n);
  }
  number = int16_t(uint16_t(bits));
  return true;
}

}  // namespace

Packet encode(const FalconCommand& command) noexcept {
  Packet packet;
  packet[0] = kFirstByte;
  for (size_t m = 0; m < kNumbers; ++m) put(command.motors[m], &packet[1 + kNibbles * m]);
  const int lights = command.lights & (kGreen | kBlue | kRed);
  packet[kStatusByte] = uint8_t(kZero + lights + (command.homing ? kHomingFlag : 0));
  packet[kSpareByte] = kZero;
  packet[kPacketBytes - 1] = kLastByte;
  return packet;
}

int AnswerStream::read(std::span<const uint8_t> bytes) noexcept {
  int answers = 0;
  for (const uint8_t byte : bytes) {
    window_[buffered_++] = byte;
    if (window_[0] != kFirstByte) {  // only ever a lone first byte: drop_first() keeps it so
      buffered_ = 0;
      ++rejected_bytes_;
    } else if (buffered_ == kPacketBytes) {
      if (accept()) {
        ++answers;
        buffered_ = 0;
      } else {
        drop_first();
      }
    }
  }
  return answers;
}

bool AnswerStream::accept() noexcept {
  if (window_[kPacketBytes - 1] != kLastByte) return false;
  const int status = window_[kStatusByte] - kZero;
  if (status < 0 || status > kLargestStatus) return false;
  FalconAnswer answer;
  for (size_t e = 0; e < kNumbers; ++e)
    if (!get(&window_[1 + kNibbles * e], answer.encoders[e])) return false;
  answer.buttons = uint8_t(status & 0xf);
  answer.homed = uint8_t(status >> 4);
  newest_ = answer;
  return true;
}

/// Gives up the '<' in front, and all up to the next one.
void AnswerStream::drop_first() noexcept {
  const auto end = window_.begin() + ptrdiff_t(buffered_);
  const auto next = std::find(window_.begin() + 1, end, kFirstByte);
  rejected_bytes_ += uint64_t(next - window_.begin());
  buffered_ = size_t(end - next);
  std::copy(next, end, window_.begin());
}

}  // namespace palpate::devices::falcon
