#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <string>
#include <string_view>

#include "integration/devices/force_devices.h"
#include "integration/files/text.h"
#include "module/haptics/servo/monotonic.h"

/// A force device of your own, on UDP: each exchange is one datagram to the device and one back.
/// palpate provides the thread, the check of positions, the reaction to silence, and all limits of
/// the force.
///   to the device:    NUMBER FX FY FZ         mN
///   from the device:  NUMBER X Y Z BUTTONS    mm; NUMBER is that of the datagram it answers
/// The device's axes: x right, y away from the user, z up. palpate's: x right, y up, z towards the
/// user.
namespace my_device {

using namespace palpate::devices;
using palpate::DeviceFault;

/// The datagram for a force (N, palpate's axes).
inline std::string command(unsigned number, glm::dvec3 force_n) {
  std::string text = std::to_string(number);
  for (const double n : {force_n.x, -force_n.z, force_n.y})
    text += ' ' + std::to_string(std::lround(1e3 * n));
  return text;
}

/// Parses a datagram: the answer to `number` (m, palpate's axes), garbage, or nothing if it answers
/// another number. Uses no socket, so that tests can call it without a device.
inline LinkAnswer answer_of(unsigned number, std::string_view text) {
  LinkAnswer answer;
  const auto n = palpate::files::to_numbers(text);
  answer.garbage = !n || n->size() != 5;
  // Positions of 1 m and more are invalid: no arm is so long. A NaN fails the comparison, too.
  for (int axis = 1; !answer.garbage && axis <= 3; ++axis)
    answer.garbage = !(std::abs((*n)[axis]) < 1e3);
  if (answer.garbage || (*n)[0] != double(number)) return answer;
  answer.answered = true;
  answer.position_m = 1e-3 * glm::dvec3((*n)[1], (*n)[3], -(*n)[2]);
  answer.buttons = (*n)[4] == 1.0 ? 1 : 0;
  return answer;
}

/// The link to the device. All functions are called by one thread, which may wait.
class Link final : public DeviceLink {
 public:
  /// wait_ns: the longest wait for an answer. With the default three missing answers take 10 ms.
  explicit Link(const sockaddr_in& place, int64_t wait_ns = 3'300'000)
      : place_(place), wait_ns_(wait_ns) {}
  ~Link() override { shut(); }

  DeviceFault open() override {
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    // A connected socket gets no datagrams from others, and reports if nothing listens there.
    ::connect(socket_, (const sockaddr*)&place_, sizeof place_);
    const LinkAnswer first = exchange(glm::dvec3(0.0));
    if (first.answered) return DeviceFault::kNone;
    shut();
    return first.garbage ? DeviceFault::kGarbage : DeviceFault::kNotOpened;
  }

  palpate::DeviceInfo info() const override {
    palpate::DeviceInfo info;
    info.kind = "my-device";
    info.name = "My device";
    // Replace these by the values that the device's maker publishes, or smaller ones. Use no value
    // that you have not read or measured.
    info.max_force_n = 3.0;
    info.max_stiffness_n_per_m = 800.0;
    info.workspace_radius_m = 0.05;
    info.delay_s = 1e-3;  // a position is read in one period of the loop and used in the next
    return info;
  }

  LinkAnswer exchange(glm::dvec3 force_n) override {
    LinkAnswer answer;
    answer.lost = !send(force_n);
    const int64_t end_ns = palpate::monotonic_ns() + wait_ns_;
    // A late answer to an older command is skipped.
    while (!answer.answered && !answer.garbage && !answer.lost) {
      const int64_t left_ns = end_ns - palpate::monotonic_ns();
      if (left_ns <= 0) break;
      pollfd file{socket_, POLLIN, 0};
      const timespec time{time_t(left_ns / 1'000'000'000), long(left_ns % 1'000'000'000)};
      if (::ppoll(&file, 1, &time, nullptr) <= 0) continue;
      char bytes[256];
      const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
      if (got >= 0) answer = answer_of(number_, {bytes, size_t(got)});
      answer.lost = got < 0 && errno != EAGAIN && errno != EINTR;
    }
    return answer;
  }

  void close() noexcept override {
    send(glm::dvec3(0.0));
    shut();
  }

 private:
  bool send(glm::dvec3 force_n) {
    const std::string text = command(++number_, force_n);
    return ::send(socket_, text.data(), text.size(), 0) == ssize_t(text.size());
  }
  void shut() noexcept {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  sockaddr_in place_;
  int64_t wait_ns_;
  int socket_ = -1;
  unsigned number_ = 0;
};

/// Parses an address and port, as in "127.0.0.1:4711". kBadInput with a sentence if it is neither.
inline palpate::Result<sockaddr_in> place_of(const std::string& text) {
  const auto parts = palpate::files::cells(text, ':');
  const auto port = palpate::files::to_integer(parts.back());
  sockaddr_in place{};
  place.sin_family = AF_INET;
  if (parts.size() != 2 || !port || *port < 1 || *port > 65535 ||
      ::inet_pton(AF_INET, std::string(parts.front()).c_str(), &place.sin_addr) != 1)
    return palpate::Error{palpate::ErrorKind::kBadInput,
                          "'" + text +
                              "' is no address of my device: give its address and port "
                              "(127.0.0.1:4711)"};
  place.sin_port = htons(uint16_t(*port));
  return place;
}

inline palpate::Result<std::unique_ptr<palpate::ForceDevice>> make(
    const ForceDeviceOptions& options) {
  const auto place = place_of(options.address);
  if (!place) return place.error();
  return device_of_link(std::make_unique<Link>(*place), options);
}

/// Call once, before palpate searches for devices.
inline void add() {
  add_force_device_kind({"my-device", "My device", "127.0.0.1:4711", "Move the grip to its middle.",
                         // Without an address no device can be there.
                         [](const ForceDeviceOptions& options) { return !options.address.empty(); },
                         make, true});
}

}  // namespace my_device
