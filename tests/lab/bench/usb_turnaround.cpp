#include "tests/lab/bench/usb_turnaround.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "integration/devices/falcon.h"
#include "integration/devices/falcon_judge.h"
#include "integration/devices/falcon_kinematics.h"
#include "integration/devices/falcon_protocol.h"
#include "tests/devices/bare_exchange.h"
#include "tests/devices/emulated_falcon.h"

namespace palpate::bench {
namespace {

namespace falcon = devices::falcon;
using devices::test::BareExchange, devices::test::EmulatedFalcon;
using Clock = std::chrono::steady_clock;

constexpr glm::dvec3 kPlace{0.010, -0.005, 0.140};
constexpr double kCount_m = 60e-6;  // half a count of each encoder
// 16 bytes of ten bits each way.
constexpr double kWire_us = 2 * 16 * 10 / 1.5;
// Alternating, because the load by other programs changes.
constexpr int kWarm = 100, kRounds = 8;

double since_us(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

double share(std::vector<double>& times_us, double of) {
  const auto n = ptrdiff_t(of * double(times_us.size() - 1));
  std::nth_element(times_us.begin(), times_us.begin() + n, times_us.end());
  return times_us[size_t(n)];
}

EmulatedFalcon::Options emulated(int port) {
  EmulatedFalcon::Options options;
  options.port = port;
  options.answer_delay_ns = int64_t(1e3 * kWire_us);
  return options;
}

/// Times of exchanges of one kind; empty if one had no answer.
std::vector<double> timed(int exchanges, const std::function<bool()>& exchange) {
  std::vector<double> times_us;
  for (int n = 0; n < kWarm + exchanges; ++n) {
    const auto start = Clock::now();
    if (!exchange()) return {};
    if (n >= kWarm) times_us.push_back(since_us(start));
  }
  return times_us;
}

/// A device that gives the right position.
std::unique_ptr<devices::FalconDevice> opened(const EmulatedFalcon& emulated_falcon) {
  devices::FalconOptions options;
  options.address = emulated_falcon.place();
  options.answer_wait_ns = 50'000'000;
  options.away_ns = 60'000'000'000;
  auto device = devices::FalconDevice::make(options);
  if (!device) return nullptr;
  for (int n = 0; n < 5000; ++n) {
    const DeviceReading reading = (*device)->exchange({});
    if (reading.fault == DeviceFault::kNone && glm::distance(reading.position_m, kPlace) < kCount_m)
      return std::move(*device);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return nullptr;
}

std::vector<double> of_device(int port, bool event_character, int exchanges) {
  EmulatedFalcon emulated_falcon(emulated(port));
  emulated_falcon.place(kPlace);
  EmulatedFalcon::Faults faults;
  faults.no_event_character = !event_character;
  emulated_falcon.set(faults);
  emulated_falcon.plug();
  const auto device = opened(emulated_falcon);
  if (!device) return {};
  return timed(exchanges, [&] {
    const DeviceReading reading = device->exchange({});
    return reading.fresh && glm::distance(reading.position_m, kPlace) < kCount_m;
  });
}

std::vector<double> of_libusb(int port, bool event_character, BareExchange::Way way,
                              int exchanges) {
  EmulatedFalcon emulated_falcon(emulated(port));
  emulated_falcon.place(kPlace);
  emulated_falcon.plug();
  BareExchange bare(emulated_falcon.place(), event_character);
  if (!bare.valid()) return {};
  return timed(exchanges, [&] { return bare.exchange(way); });
}

/// The computation for one exchange, with a grip that moves.
double computing_us(int exchanges) {
  std::vector<falcon::Packet> answers;
  for (int n = 0; n < 64; ++n) {
    const auto joints = falcon::inverse(kPlace + glm::dvec3(0.0, 1e-5 * n, 0.0));
    const glm::dvec3 counts = falcon::encoder_counts(joints->arm);
    // An answer has the layout of a command, except for one byte of flags.
    falcon::FalconCommand command;
    for (int e = 0; e < 3; ++e) command.motors[size_t(e)] = int16_t(std::lround(counts[e]));
    falcon::Packet packet = falcon::encode(command);
    packet[13] = uint8_t('A' + (falcon::kAllHomed << 4));
    answers.push_back(packet);
  }
  falcon::FalconJudge judge;
  falcon::AnswerStream stream;
  glm::dvec3 position = kPlace;
  int64_t sum = 0;
  const auto start = Clock::now();
  for (int n = 0; n < exchanges; ++n) {
    const auto joints = falcon::inverse(position);
    const auto rows = joints ? falcon::jacobian(*joints) : std::nullopt;
    falcon::FalconCommand command;
    if (rows) command.motors = falcon::motor_counts(*rows, {0.5, -0.2, 2.0 - 1e-3 * (n & 63)});
    const glm::dvec3 force_n = rows ? falcon::force_of(*rows, command.motors) : glm::dvec3(0.0);
    sum += falcon::encode(command)[3];
    stream.read(answers[size_t(n) % answers.size()]);
    const DeviceReading reading =
        judge.judge({stream.newest(), false, int64_t(n) * 1'000'000, force_n});
    position = reading.position_m;
  }
  const double each_us = since_us(start) / exchanges;
  return sum > 0 && glm::distance(position, kPlace) < 1e-3 ? each_us : 0.0;
}

}  // namespace

std::optional<UsbTurnaround> usb_turnaround(int exchanges, std::string& why) {
  UsbTurnaround result;
  result.exchanges = exchanges;
  result.wire_us = kWire_us;
  std::vector<double> ours, bare, timer, usual;
  const auto add = [](std::vector<double>& all, const std::vector<double>& some) {
    all.insert(all.end(), some.begin(), some.end());
    return !some.empty();
  };
  bool answered = true;
  for (int round = 0; round < kRounds && answered; ++round) {
    const int part = std::max(1, exchanges / kRounds);
    answered = add(ours, of_device(1, true, part)) &&
               add(bare, of_libusb(2, true, BareExchange::Way::kTogether, part)) &&
               add(timer, of_device(3, false, part)) &&
               add(usual, of_libusb(4, false, BareExchange::Way::kOneAfterTheOther, part));
  }
  result.ours_us = computing_us(100 * exchanges);
  if (!answered || result.ours_us == 0.0) {
    why = "The emulated Falcon did not answer with its position: run tests/devices/usb_test.";
    return std::nullopt;
  }
  result.median_us = share(ours, 0.5);
  result.p99_us = share(ours, 0.99);
  result.bare_median_us = share(bare, 0.5);
  result.timer_median_us = share(timer, 0.5);
  result.usual_median_us = share(usual, 0.5);
  return result;
}

}  // namespace palpate::bench
