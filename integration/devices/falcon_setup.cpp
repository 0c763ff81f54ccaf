#include "integration/devices/falcon_setup.h"

#include <algorithm>
#include <chrono>

#include "integration/devices/falcon_protocol.h"

namespace palpate::devices::falcon {
namespace {

using usb::UsbProblem;
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
// Divisors of 3 MHz in the chip's format.
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

UsbProblem control(libusb_device_handle* handle, Setting setting) noexcept {
  return usb::problem_of(libusb_control_transfer(handle, kToDevice, setting.request, setting.value,
                                                 0, nullptr, 0, kControlTimeoutMs));
}

UsbProblem control_all(libusb_device_handle* handle,
                       std::initializer_list<Setting> settings) noexcept {
  for (const Setting& setting : settings)
    if (const UsbProblem problem = control(handle, setting); problem != UsbProblem::kNone)
      return problem;
  return UsbProblem::kNone;
}

UsbProblem write(libusb_device_handle* handle, std::span<const uint8_t> bytes,
                 milliseconds timeout) noexcept {
  int sent = 0;
  // libusb takes a pointer to bytes it may change, and does not change them.
  const int code = libusb_bulk_transfer(handle, kEndpointOut, const_cast<uint8_t*>(bytes.data()),
                                        int(bytes.size()), &sent, unsigned(timeout.count()));
  if (code != LIBUSB_SUCCESS) return usb::problem_of(code);
  return sent == int(bytes.size()) ? UsbProblem::kNone : UsbProblem::kFailed;
}

/// Reads until enough(bytes) holds. A chip without data sends its status bytes alone.
template <class Enough>
UsbProblem read_until(libusb_device_handle* handle, std::vector<uint8_t>& bytes, Enough enough,
                      milliseconds timeout, const StopFlag& stop) {
  const auto end = Clock::now() + timeout;
  while (!enough(bytes)) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now());
    if (left <= milliseconds(0) || stop) return UsbProblem::kTimedOut;
    std::array<uint8_t, kInBytes> packet;
    int got = 0;
    const int code = libusb_bulk_transfer(handle, kEndpointIn, packet.data(), int(packet.size()),
                                          &got, unsigned(left.count()));
    if (code != LIBUSB_SUCCESS) return usb::problem_of(code);
    if (got > int(kStatusBytes))
      bytes.insert(bytes.end(), packet.begin() + kStatusBytes, packet.begin() + got);
  }
  return UsbProblem::kNone;
}

bool ends_with(const std::vector<uint8_t>& bytes, std::span<const uint8_t> end) {
  return bytes.size() >= end.size() && std::equal(end.rbegin(), end.rend(), bytes.rbegin());
}

/// Wakes the loader. It listens at 9,600 baud after a reset by DTR.
UsbProblem greet(libusb_device_handle* handle, const StopFlag& stop) {
  UsbProblem problem = control_all(handle, {{kReset, kPurgeReceived},
                                            {kReset, kPurgeSent},
                                            {kLatencyTimer, kLoaderLatencyMs},
                                            {kEventCharacter, 0},
                                            {kBaudRate, kBaud9600},
                                            {kDataFormat, kEightDataBits},
                                            {kFlowControl, kNoFlowControl},
                                            {kModemControl, kRtsLow},
                                            {kModemControl, kDtrLow},
                                            {kModemControl, kDtrHigh}});
  if (problem != UsbProblem::kNone) return problem;
  for (int n = 0; n < kHelloTries && !stop; ++n) {
    problem = write(handle, kHello, kLoaderTimeout);
    if (problem != UsbProblem::kNone) return problem;
    // Some hosts show a zero in front, so only the end counts.
    std::vector<uint8_t> bytes;
    problem = read_until(
        handle, bytes, [](const auto& b) { return ends_with(b, kHelloBack); }, kHelloTimeout, stop);
    if (problem != UsbProblem::kTimedOut) return problem;
  }
  return UsbProblem::kTimedOut;
}

/// Sends bytes that the loader must echo.
UsbProblem echo(libusb_device_handle* handle, std::span<const uint8_t> bytes,
                const StopFlag& stop) {
  UsbProblem problem = write(handle, bytes, kLoaderTimeout);
  if (problem != UsbProblem::kNone) return problem;
  std::vector<uint8_t> back;
  problem = read_until(
      handle, back, [&](const auto& b) { return b.size() >= bytes.size(); }, kLoaderTimeout, stop);
  if (problem != UsbProblem::kNone) return problem;
  return std::equal(bytes.begin(), bytes.end(), back.begin(), back.end()) ? UsbProblem::kNone
                                                                          : UsbProblem::kFailed;
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
  if (settings.problem != UsbProblem::kNone) return settings;
  const UsbProblem event = control(handle, {kEventCharacter, uint16_t(kEnable | kLastByte)});
  settings.event_character = event == UsbProblem::kNone;
  if (event == UsbProblem::kGone) settings.problem = event;
  return settings;
}

UsbProblem find_firmware(libusb_device_handle* handle, const StopFlag& stop, FalconAnswer* answer) {
  const Packet zero = encode({});
  for (int n = 0; n < kFirmwareTries && !stop; ++n) {
    UsbProblem problem = write(handle, zero, kPacketTimeout);
    if (problem != UsbProblem::kNone && problem != UsbProblem::kTimedOut) return problem;
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
    if (problem == UsbProblem::kNone && answer) *answer = stream.newest();
    if (problem != UsbProblem::kTimedOut) return problem;
  }
  return UsbProblem::kTimedOut;
}

UsbProblem load_firmware(libusb_device_handle* handle, std::span<const uint8_t> image,
                         const StopFlag& stop) {
  UsbProblem problem = greet(handle, stop);
  if (problem == UsbProblem::kNone)
    problem = control_all(handle, {{kModemControl, kDtrLow}, {kBaudRate, kBaud142857}});
  if (problem == UsbProblem::kNone) problem = echo(handle, kLoad, stop);
  while (problem == UsbProblem::kNone && !image.empty()) {
    const auto chunk = image.first(std::min(image.size(), kOutBytes));
    problem = stop ? UsbProblem::kTimedOut : echo(handle, chunk, stop);
    image = image.subspan(chunk.size());
  }
  return problem;
}

UsbProblem send_zero(libusb_device_handle* handle) noexcept {
  return write(handle, encode({}), milliseconds(50));
}

UsbProblem clear_halts(libusb_device_handle* handle) noexcept {
  UsbProblem problem = usb::problem_of(libusb_clear_halt(handle, kEndpointOut));
  if (problem == UsbProblem::kNone)
    problem = usb::problem_of(libusb_clear_halt(handle, kEndpointIn));
  if (problem == UsbProblem::kNone)
    problem = control_all(handle, {{kReset, kPurgeReceived}, {kReset, kPurgeSent}});
  return problem;
}

}  // namespace palpate::devices::falcon
