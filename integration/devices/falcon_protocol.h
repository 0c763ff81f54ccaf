#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace palpate::devices::falcon {

/// A Novint Falcon speaks in packets of 16 bytes, '<' first and '>' last; the host sends one, the
/// device answers with one and sends nothing by itself. Numbers are 16 bits in two's complement,
/// four nibbles with the least significant first, each plus 0x41, so that neither '<' nor '>' can
/// stand inside a packet.
inline constexpr size_t kPacketBytes = 16;
inline constexpr uint8_t kFirstByte = '<';
inline constexpr uint8_t kLastByte = '>';
using Packet = std::array<uint8_t, kPacketBytes>;

/// Lights in the grip's ring; they may be added up.
enum Light : uint8_t { kDark = 0x0, kGreen = 0x2, kBlue = 0x4, kRed = 0x8 };

/// What the host says.
struct FalconCommand {
  std::array<int16_t, 3> motors{};  ///< counts of torque
  uint8_t lights = kDark;           ///< Light, added up
  bool homing = false;              ///< look for the encoders' zero marks
};

/// What the device answers.
struct FalconAnswer {
  std::array<int16_t, 3> encoders{};  ///< counts from the zero mark
  uint8_t buttons = 0;                ///< bit 0 plus, 1 forward, 2 centre, 3 minus
  uint8_t homed = 0;                  ///< bit 0 top, 1 right, 2 left encoder has seen its zero mark

  bool operator==(const FalconAnswer&) const = default;
};
inline constexpr uint8_t kAllHomed = 0x7;

/// The command as bytes for the wire. Any thread, real-time safe.
Packet encode(const FalconCommand& command) noexcept;

/// Finds answers in a stream of bytes that may be cut anywhere and may hold anything. A '<' with a
/// '>' 15 bytes later and only legal bytes between is an answer; every other byte is thrown away
/// and counted. What may still become an answer is kept for the next call. Real-time safe.
class AnswerStream {
 public:
  /// Reads all bytes; returns how many answers they completed. The newest is in newest().
  int read(std::span<const uint8_t> bytes) noexcept;
  const FalconAnswer& newest() const noexcept { return newest_; }
  /// Bytes that belonged to no answer, since the stream was made.
  uint64_t rejected_bytes() const noexcept { return rejected_bytes_; }
  /// Forgets a half-read answer, without counting it.
  void drop_rest() noexcept { buffered_ = 0; }

 private:
  bool accept() noexcept;
  void drop_first() noexcept;

  Packet window_{};      ///< the last bytes, starting with '<' if there are any
  size_t buffered_ = 0;  ///< how many of them
  FalconAnswer newest_{};
  uint64_t rejected_bytes_ = 0;
};

}  // namespace palpate::devices::falcon
