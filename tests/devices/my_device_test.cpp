// The example force device of the documentation, used as a user would: its row, its datagrams, and
// faults in contact, on the whole path: a socket, MailboxDevice, the servo loop, the haptic step,
// the guards. The oracle is the emulated device, which stores the last force.
#include "docs/examples/my_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <functional>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/devices/fault_rows.h"
#include "tests/devices/mailbox_rig.h"

namespace palpate::devices::test {
namespace {

/// The other end, written from the description of its datagrams alone.
class EmulatedMyDevice final : public EmulatedHand {
 public:
  EmulatedMyDevice() { plug(); }
  ~EmulatedMyDevice() override {
    if (thread_.joinable()) unplug();
  }

  std::string place_name() const { return "127.0.0.1:" + std::to_string(port_); }
  sockaddr_in address() const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port_);
    return address;
  }

  /// The first time on any free port, then on the same one.
  void plug() {
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in at = address();
    socklen_t size = sizeof at;
    if (::bind(socket_, (const sockaddr*)&at, size) != 0 ||
        ::getsockname(socket_, (sockaddr*)&at, &size) != 0)
      throw std::runtime_error("no port to listen on");
    port_ = ntohs(at.sin_port);
    stop_ = false;
    thread_ = std::thread([this] { serve(); });
  }
  void unplug() {
    stop_ = true;
    thread_.join();
    ::close(socket_);
  }

  void place(glm::dvec3 position_m) override {
    const std::lock_guard lock(mutex_);
    place_m_ = position_m;
  }
  size_t received_count() const override {
    const std::lock_guard lock(mutex_);
    return received_.size();
  }
  bool pushed(size_t command) const override {
    const std::lock_guard lock(mutex_);
    return received_.at(command) != glm::ivec3(0);
  }
  size_t malformed() const {
    const std::lock_guard lock(mutex_);
    return malformed_;
  }
  /// Changes each answer; an empty one is not sent. Stays until it is changed.
  void mangle(std::function<std::string(std::string)> how) {
    const std::lock_guard lock(mutex_);
    mangle_ = std::move(how);
  }

 private:
  void serve() {
    while (!stop_) {
      pollfd file{socket_, POLLIN, 0};
      if (::poll(&file, 1, 5) <= 0) continue;
      char bytes[256] = {};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      if (::recvfrom(socket_, bytes, sizeof bytes - 1, 0, (sockaddr*)&from, &size) < 0) continue;
      const std::string text = answer(bytes);
      if (!text.empty())
        ::sendto(socket_, text.data(), text.size(), 0, (const sockaddr*)&from, size);
    }
  }
  std::string answer(const char* command) {
    const std::lock_guard lock(mutex_);
    unsigned number = 0;
    glm::ivec3 force(0);
    int end = 0;
    if (std::sscanf(command, "%u %d %d %d%n", &number, &force.x, &force.y, &force.z, &end) != 4 ||
        command[end] != '\0') {
      ++malformed_;
      return "";
    }
    received_.push_back(force);
    const glm::dvec3 mm = 1e3 * place_m_;
    char text[128];
    std::snprintf(text, sizeof text, "%u %.4f %.4f %.4f 0", number, mm.x, -mm.z, mm.y);
    return mangle_ ? mangle_(text) : text;
  }

  mutable std::mutex mutex_;
  glm::dvec3 place_m_{0.0};
  std::vector<glm::ivec3> received_;
  size_t malformed_ = 0;
  std::function<std::string(std::string)> mangle_;
  int socket_ = -1;
  uint16_t port_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

// ---- its row

TEST(MyDevice, IsAKindLikeTheOthersOnceItIsAdded) {
  ASSERT_EQ(force_device_kind("my-device"), nullptr);
  my_device::add();
  const ForceDeviceKind* const kind = force_device_kind("my-device");
  ASSERT_NE(kind, nullptr);
  EXPECT_EQ(&force_device_kinds().back(), kind);
  EXPECT_NE(force_device_kind("falcon"), nullptr);
  EXPECT_FALSE(kind->may_be_there({}));

  EmulatedMyDevice far_end;
  far_end.place({0.01, 0.02, -0.03});
  ForceDeviceOptions options;
  options.real_time = false;
  options.address = far_end.place_name();
  EXPECT_TRUE(kind->may_be_there(options));
  const auto made = kind->make(options);
  ASSERT_TRUE(made) << made.error().message;
  DeviceReading reading;
  ASSERT_TRUE(wait_for([&] {
    reading = (*made)->exchange({});
    return reading.fault == DeviceFault::kNone;
  })) << sentence(reading.fault);
  EXPECT_LT(glm::distance(reading.position_m, glm::dvec3(0.01, 0.02, -0.03)), 1e-6);

  for (const char* place : {"", "my desk", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:70000", ":4711",
                            "127.0.0.1:4711:4712", "1.2.3:4711"}) {
    options.address = place;
    const auto none = kind->make(options);
    ASSERT_FALSE(none) << place;
    EXPECT_THAT(none.error().message, ::testing::HasSubstr("give its address and port"));
  }
}

// ---- its datagrams

TEST(MyDevice, ConvertsItsAxesBothWays) {
  // Palpate: x right, y up, z towards the user. The device: x right, y away, z up; mN and mm.
  EXPECT_EQ(my_device::command(7, {0.25, -1.5, 3.0}), "7 250 -3000 -1500");
  const LinkAnswer answer = my_device::answer_of(7, "7 10.5 20 -30 1");
  ASSERT_TRUE(answer.answered);
  EXPECT_LT(glm::distance(answer.position_m, glm::dvec3(0.0105, -0.03, -0.02)), 1e-12);
  EXPECT_EQ(answer.buttons, 1U);
}

TEST(MyDevice, BelievesNoDatagramThatIsWrong) {
  for (const char* text : {"", "7", "7 1 2 3", "7 1 2 3 0 0", "7 1 2 x 0", "7 nan 2 3 0",
                           "7 1 inf 3 0", "7 1 2 1e400 0", "7 1000 2 3 0", "seven 1 2 3 0"}) {
    const LinkAnswer answer = my_device::answer_of(7, text);
    EXPECT_TRUE(answer.garbage && !answer.answered) << text;
  }
  const LinkAnswer late = my_device::answer_of(7, "6 1 2 3 0");
  EXPECT_FALSE(late.answered || late.garbage);
}

// ---- its faults

class MyDeviceRig final : public MailboxRig {
 public:
  struct Options {
    MailboxOptions mailbox = patient_mailbox();
    int64_t answer_wait_ns = 250'000'000;
  };
  static Options patient() { return {}; }

  explicit MyDeviceRig(const Options& options) {
    hold(far_end, glm::dvec3(0.0));
    start_mailbox(std::make_unique<my_device::Link>(far_end.address(), options.answer_wait_ns),
                  options.mailbox);
  }
  EmulatedMyDevice far_end;
};

using Rig = MyDeviceRig;
using Row = FaultRow<Rig>;

std::function<void(Rig&)> mangle(const std::function<std::string(std::string)>& how) {
  return [how](Rig& rig) { rig.far_end.mangle(how); };
}

void heal(Rig& rig) {
  rig.far_end.mangle(nullptr);
}

/// Another number instead of x.
std::function<std::string(std::string)> with_x(const std::string& x) {
  return [x](const std::string& text) {
    const size_t begin = text.find(' ') + 1;
    return text.substr(0, begin) + x + text.substr(text.find(' ', begin));
  };
}

std::string nothing(const std::string&) {
  return "";
}

/// For faults that need many missing answers. Still longer than a busy machine takes to run the
/// other end's thread.
Rig::Options less_patient() {
  Rig::Options options = Rig::patient();
  options.answer_wait_ns = 100'000'000;
  return options;
}

std::vector<Row> rows() {
  return {
      {.name = "ItsProgramEnds",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             rig.far_end.unplug();
           },
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.far_end.plug();
             rig.find(rig.far_end);
           }},
      {.name = "FallsSilent",
       .inject = mangle(nothing),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      {.name = "OneAnswerIsLost",
       .inject = mangle([left = 1](const std::string& text) mutable {
         return left-- > 0 ? std::string() : text;
       }),
       .ends = Ends::kTolerated},
      {.name = "EveryAnswerIsToAnOlderCommand",
       .inject = mangle([](const std::string& text) { return "0" + text.substr(text.find(' ')); }),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      {.name = "EveryAnswerIsNoise",
       .inject = mangle([](const std::string&) { return std::string(40, '\xfe'); }),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "ThePositionIsNotFinite",
       .inject = mangle(with_x("nan")),
       .fault = DeviceFault::kGarbage,
       .recover = heal},
      {.name = "ThePositionJumps",
       .inject = mangle(with_x("90.0")),
       .fault = DeviceFault::kJumped,
       .recover = heal},
      {.name = "ThePositionStands",
       .inject = [](Rig& rig) { rig.holds_grip = false; },
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "TheHostIsAwayAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = {.mailbox = {.away_ns = 200'000'000,
                               .silence_ns = 10'000'000'000,
                               .priority = 0}}},
  };
}

class MyDeviceFault : public testing::TestWithParam<Row> {};

TEST_P(MyDeviceFault, BringsTheForceDownAndLetsItComeBack) {
  Rig rig(GetParam().options);
  expect_row(rig, GetParam());
  EXPECT_EQ(rig.far_end.malformed(), 0U);
}

INSTANTIATE_TEST_SUITE_P(, MyDeviceFault, testing::ValuesIn(rows()), name_of_row<Rig>);

}  // namespace
}  // namespace palpate::devices::test
