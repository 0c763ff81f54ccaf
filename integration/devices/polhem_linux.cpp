#include "integration/devices/polhem.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "integration/devices/polhem_protocol.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTerminals = "/sys/class/tty";
constexpr const char* kVendor = "16c0";
constexpr const char* kProduct = "0483";

// HAPI's values. Its maker publishes no largest force; the arm's motors hold more than this.
constexpr double kPolhemForce_n = 3.0, kPolhemStiffness_n_per_m = 1500.0;
constexpr double kRadius_m = 0.05;  // on the safe side: its reach was not measured
// a position is taken in one period of the loop, used in the next
constexpr double kPolhemDelay_s = 1e-3;

std::string first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

class PolhemLink final : public DeviceLink {
 public:
  explicit PolhemLink(const PolhemOptions& options) : options_(options) {}
  ~PolhemLink() override { shut(); }

  DeviceFault open() override {
    std::vector<std::string> ports{options_.port};
    if (options_.port.empty()) ports = polhem_ports();
    DeviceFault reason = DeviceFault::kNotOpened;
    for (const std::string& port : ports) {
      const DeviceFault fault = open_port(port);
      if (fault == DeviceFault::kNone) {
        port_ = port;
        return fault;
      }
      shut();
      if (reason == DeviceFault::kNotOpened) reason = fault;
    }
    return reason;
  }

  DeviceInfo info() const override {
    DeviceInfo info;
    info.kind = "polhem";
    info.name = "Polhem";
    info.address = port_;
    info.max_force_n = kPolhemForce_n;
    info.max_stiffness_n_per_m = kPolhemStiffness_n_per_m;
    info.workspace_radius_m = kRadius_m;
    info.delay_s = kPolhemDelay_s;
    return info;
  }

  LinkAnswer exchange(glm::dvec3 force_n) override {
    lines_.count = 0;
    lines_.garbage = false;
    hear();  // what came since the last exchange is too late to answer this one
    owed_ = std::max(0, owed_ - lines_.count);
    lines_.take();
    lines_.count = 0;
    return exchanged(force_n, options_.answer_wait_ns);
  }

  void close() noexcept override {
    try {
      exchange(glm::dvec3(0.0));
      flush_until(monotonic_ns() + options_.answer_wait_ns);
    } catch (...) {
    }
    shut();
  }

 private:
  DeviceFault open_port(const std::string& port) {
    file_ = ::open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) {
      if (errno == EACCES || errno == EPERM) return DeviceFault::kNoPermission;
      return errno == EBUSY ? DeviceFault::kBusy : DeviceFault::kNotOpened;
    }
    // One program at a time: whoever comes second is refused.
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) return DeviceFault::kBusy;
    ioctl(file_, TIOCEXCL);
    termios settings{};
    if (tcgetattr(file_, &settings) != 0) return DeviceFault::kNotOpened;
    cfmakeraw(&settings);
    cfsetspeed(&settings, B115200);
    if (tcsetattr(file_, TCSANOW, &settings) != 0) return DeviceFault::kTransfer;
    tcflush(file_, TCIOFLUSH);
    lines_ = {};
    out_.clear();
    owed_ = 0;
    lost_ = false;
    // A line of zero force also wakes the firmware.
    const LinkAnswer first = exchanged(glm::dvec3(0.0), options_.open_wait_ns);
    if (first.answered) return first.said;
    return first.lost      ? DeviceFault::kUnplugged
           : first.garbage ? DeviceFault::kGarbage
                           : DeviceFault::kNotOpened;
  }

  LinkAnswer exchanged(glm::dvec3 force_n, int64_t wait_ns) {
    LinkAnswer answer;
    const int64_t end_ns = monotonic_ns() + wait_ns;
    // A line that is partly sent must be ended first; a newer force then waits for the next
    // exchange, but zero is sent at once.
    const bool full = !out_.empty() && force_n != glm::dvec3(0.0);
    if (!full) {
      out_ += polhem::force_line(force_n);
      ++owed_;
    }
    send();
    while (!lost_ && lines_.count < owed_) {
      const int64_t left_ns = end_ns - monotonic_ns();
      if (left_ns <= 0) break;
      wait(left_ns);
      send();
      hear();
    }
    answer.garbage = lines_.garbage;
    answer.lost = lost_;
    const auto newest = lines_.take();
    if (newest && !lines_.garbage && lines_.count >= owed_) {
      answer.answered = true;
      answer.position_m = newest->position_m;
      if (newest->info == 1) answer.said = DeviceFault::kNotHomed;
    }
    // Some came and the rest did not within the time: they are lost, or taken for that. A device
    // that does not answer must not get more than it can buffer.
    if (lines_.count > 0) owed_ = 0;
    owed_ = std::min(owed_, kMostOwed);
    return answer;
  }

  void wait(int64_t left_ns) {
    pollfd file{file_, short(POLLIN | (out_.empty() ? 0 : POLLOUT)), 0};
    const timespec time{time_t(left_ns / 1'000'000'000), long(left_ns % 1'000'000'000)};
    ppoll(&file, 1, &time, nullptr);
    // A port whose device is gone hangs up; its last bytes are read first.
    if ((file.revents & (POLLHUP | POLLERR | POLLNVAL)) && !(file.revents & POLLIN)) lost_ = true;
  }

  void send() {
    while (!out_.empty()) {
      const ssize_t sent = write(file_, out_.data(), out_.size());
      if (sent > 0) {
        out_.erase(0, size_t(sent));
        continue;
      }
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && errno != EAGAIN) lost_ = true;
      return;
    }
  }

  void hear() {
    char bytes[1024];
    for (int n = 0; n < kMostReads; ++n) {
      const ssize_t got = read(file_, bytes, sizeof bytes);
      if (got > 0) {
        lines_.read({bytes, size_t(got)});
        continue;
      }
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && errno != EAGAIN) lost_ = true;
      return;
    }
  }

  void flush_until(int64_t end_ns) {
    while (!out_.empty() && !lost_ && monotonic_ns() < end_ns) {
      wait(end_ns - monotonic_ns());
      send();
    }
  }

  void shut() noexcept {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }

  static constexpr int kMostOwed = 4;
  static constexpr int kMostReads = 64;  // of 1 kB at a time, so that a flood is not read for ever

  const PolhemOptions options_;
  std::string port_;
  int file_ = -1;
  polhem::LineSplitter lines_;
  std::string out_;  ///< not yet taken by the port
  int owed_ = 0;     ///< lines without an answer yet
  bool lost_ = false;
};

}  // namespace

std::unique_ptr<DeviceLink> make_polhem_link(const PolhemOptions& options) {
  return std::make_unique<PolhemLink>(options);
}

std::vector<std::string> polhem_ports() {
  std::vector<std::string> ports;
  std::error_code error;
  for (const fs::directory_entry& terminal : fs::directory_iterator(kTerminals, error)) {
    const std::string name = terminal.path().filename().string();
    if (!name.starts_with("ttyACM")) continue;
    // The terminal's device is an interface; what the interface belongs to has the ids.
    const fs::path device = fs::canonical(terminal.path() / "device", error).parent_path();
    if (error) continue;
    if (first_line(device / "idVendor") != kVendor || first_line(device / "idProduct") != kProduct)
      continue;
    const std::string words =
        first_line(device / "manufacturer") + " " + first_line(device / "product");
    if (words.find("Haply") != std::string::npos || words.find("Inverse") != std::string::npos)
      continue;
    ports.push_back("/dev/" + name);
  }
  std::sort(ports.begin(), ports.end());
  return ports;
}

}  // namespace palpate::devices
