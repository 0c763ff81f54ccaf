#include "integration/devices/falcon_setup.h"

#include <algorithm>
#include <chrono>

#include "integration/devices/falcon_protocol.h"

namespace palpate::devices::falcon {
namespace {

using usb::Problem;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// The converter's control requests. None carries data.
constexpr uint8_t kToDevice = 0x40;
constexpr unsigned kControlTimeoutMs = 300;
enum Request : uint8_t {
  kReset = 0,
  kModemControl = 1,
  kFlowControl = 2,
  kBaudRate = 3,
  kDataFormat = 4,
  kEventCharacter = 6,
  kLatencyTimer = 9,
};
constexpr uint16_t kPurgeReceived = 1, kPurgeSent = 2;
constexpr uint16_t kDtrLow = 0x0100, kDtrHigh = 0x0101, kRtsLow = 0x0200;
constexpr uint16_t kNoFlowControl = 0, kEightDataBits = 8;
constexpr uint16_t kEnable = 0x0100;
// Divisors of 3 MHz as the chip wants them.
constexpr uint16_t kBaud1500000 = 0x0002, kBaud142857 = 0x0015, kBaud9600 = 0x4138;

constexpr int kFirmwareTries = 100;
constexpr milliseconds kPacketTimeout{10};

// The loader checks with "often fails" at the shortest latency; at this one it does not.
constexpr uint16_t kLoaderLatencyMs = 16;
constexpr int kHelloTries = 100;
constexpr milliseconds kLoaderTimeout{200}, kHelloTimeout{40};
constexpr std::array<uint8_t, 3> kHello{0x0a, 0x43, 0x0d};
constexpr std::array<uint8_t, 4> kHelloBack{0x0a, 0x44, 0x2c, 0x0d};
constexpr std::array<uint8_t, 1> kLoad{0x41};

struct Setting {
  Request request;
  uint16_t value;
};

Problem control(libusb_device_handle* handle, Setting setting) noexcept {
  return usb::problem_of(libusb_control_transfer(handle, kToDevice, setting.request, setting.value,
                                                 0, nullptr, 0, kControlTimeoutMs));
}

Problem control_all(libusb_device_handle* handle,
                    std::initializer_list<Setting> settings) noexcept {
  for (const Setting& setting : settings)
    if (const Problem problem = control(handle, setting); problem != Problem::kNone) return problem;
  return Problem::kNone;
}

Problem write(libusb_device_handle* handle, std::span<const uint8_t> bytes,
              milliseconds timeout) noexcept {
  int sent = 0;
  // libusb takes a pointer to bytes it may change, and does not change them.
  const int code = libusb_bulk_transfer(handle, kEndpointOut, const_cast<uint8_t*>(bytes.data()),
                                        int(bytes.size()), &sent, unsigned(timeout.count()));
  if (code != LIBUSB_SUCCESS) return usb::problem_of(code);
  return sent == int(bytes.size()) ? Problem::kNone : Problem::kFailed;
}

/// Reads until enough(bytes) holds. A chip with nothing to say sends its status bytes alone.
template <class Enough>
Problem read_until(libusb_device_handle* handle, std::vector<uint8_t>& bytes, Enough enough,
                   milliseconds timeout, const StopFlag& stop) {
  const auto end = Clock::now() + timeout;
  while (!enough(bytes)) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now());
    if (left <= milliseconds(0) || stop) return Problem::kTimedOut;
    std::array<uint8_t, kInBytes> packet;
    int got = 0;
    const int code = libusb_bulk_transfer(handle, kEndpointIn, packet.data(), int(packet.size()),
                                          &got, unsigned(left.count()));
    if (code != LIBUSB_SUCCESS) return usb::problem_of(code);
    if (got > int(kStatusBytes))
      bytes.insert(bytes.end(), packet.begin() + kStatusBytes, packet.begin() + got);
  }
  return Problem::kNone;
}

bool ends_with(const std::vector<uint8_t>& bytes, std::span<const uint8_t> end) {
  return bytes.size() >= end.size() && std::equal(end.rbegin(), end.rend(), bytes.rbegin());
}

/// Wakes the loader. It listens at 9,600 baud after a reset by DTR.
Problem greet(libusb_device_handle* handle, const StopFlag& stop) {
  Problem problem = control_all(handle, {{kReset, kPurgeReceived},
                                         {kReset, kPurgeSent},
                                         {kLatencyTimer, kLoaderLatencyMs},
                                         {kEventCharacter, 0},
                                         {kBaudRate, kBaud9600},
                                         {kDataFormat, kEightDataBits},
                                         {kFlowControl, kNoFlowControl},
                                         {kModemControl, kRtsLow},
                                         {kModemControl, kDtrLow},
                                         {kModemControl, kDtrHigh}});
  if (problem != Problem::kNone) return problem;
  for (int n = 0; n < kHelloTries && !stop; ++n) {
    problem = write(handle, kHello, kLoaderTimeout);
    if (problem != Problem::kNone) return problem;
    // Some hosts show a zero in front, so only the end counts.
    std::vector<uint8_t> bytes;
    problem = read_until(
        handle, bytes, [](const auto& b) { return ends_with(b, kHelloBack); }, kHelloTimeout, stop);
    if (problem != Problem::kTimedOut) return problem;
  }
  return Problem::kTimedOut;
}

/// Sends bytes that the loader must say back.
Problem echo(libusb_device_handle* handle, std::span<const uint8_t> bytes, const StopFlag& stop) {
  Problem problem = write(handle, bytes, kLoaderTimeout);
  if (problem != Problem::kNone) return problem;
  std::vector<uint8_t> back;
  problem = read_until(
      handle, back, [&](const auto& b) { return b.size() >= bytes.size(); }, kLoaderTimeout, stop);
  if (problem != Problem::kNone) return problem;
  return std::equal(bytes.begin(), bytes.end(), back.begin(), back.end()) ? Problem::kNone
                                                                          : Problem::kFailed;
}

}  // namespace

Settings set_up(libusb_device_handle* handle) {
  Settings settings;
  settings.problem = control_all(handle, {{kReset, kPurgeReceived},
                                          {kReset, kPurgeSent},
                                          {kLatencyTimer, 1},
                                          {kBaudRate, kBaud1500000},
                                          {kReset, kPurgeReceived},
                                          {kReset, kPurgeSent}});
  if (settings.problem != Problem::kNone) return settings;
  const Problem event = control(handle, {kEventCharacter, uint16_t(kEnable | kLastByte)});
  settings.event_character = event == Problem::kNone;
  if (event == Problem::kGone) settings.problem = event;
  return settings;
}

Problem find_firmware(libusb_device_handle* handle, const StopFlag& stop, Answer* answer) {
  const Packet zero = encode({});
  for (int n = 0; n < kFirmwareTries && !stop; ++n) {
    Problem problem = write(handle, zero, kPacketTimeout);
    if (problem != Problem::kNone && problem != Problem::kTimedOut) return problem;
    AnswerStream stream;
    size_t read = 0;
    std::vector<uint8_t> bytes;
    problem = read_until(
        handle, bytes,
        [&](const auto& b) {
          const bool answered = stream.read(std::span(b).subspan(read)) > 0;
          read = b.size();
          return answered;
        },
        kPacketTimeout, stop);
    if (problem == Problem::kNone && answer) *answer = stream.newest();
    if (problem != Problem::kTimedOut) return problem;
  }
  return Problem::kTimedOut;
}

Problem load_firmware(libusb_device_handle* handle, std::span<const uint8_t> image,
                      const StopFlag& stop) {
  Problem problem = greet(handle, stop);
  if (problem == Problem::kNone)
    problem = control_all(handle, {{kModemControl, kDtrLow}, {kBaudRate, kBaud142857}});
  if (problem == Problem::kNone) problem = echo(handle, kLoad, stop);
  while (problem == Problem::kNone && !image.empty()) {
    const auto chunk = image.first(std::min(image.size(), kOutBytes));
    problem = stop ? Problem::kTimedOut : echo(handle, chunk, stop);
    image = image.subspan(chunk.size());
  }
  return problem;
}

Problem send_zero(libusb_device_handle* handle) noexcept {
  return write(handle, encode({}), milliseconds(50));
}

Problem clear_halts(libusb_device_handle* handle) noexcept {
  Problem problem = usb::problem_of(libusb_clear_halt(handle, kEndpointOut));
  if (problem == Problem::kNone) problem = usb::problem_of(libusb_clear_halt(handle, kEndpointIn));
  if (problem == Problem::kNone)
    problem = control_all(handle, {{kReset, kPurgeReceived}, {kReset, kPurgeSent}});
  return problem;
}

}  // namespace palpate::devices::falcon
