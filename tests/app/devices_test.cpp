// The program as a user runs it with a force device. Each device is emulated at the end of its
// maker's interface: a service's socket, a library, a serial port. A hand moves back and forth. No
// test here measures time: the machine may be busy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <signal.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "tests/app/program.h"
#include "tests/app/ticks.h"
#include "tests/devices/emulated_haply.h"
#include "tests/devices/emulated_polhem.h"

namespace palpate::app {
namespace {

using devices::test::EmulatedHand;
using devices::test::EmulatedHaply;
using devices::test::EmulatedPolhem;
using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A hand that moves along the user's line of sight, from the front of the reach to its middle and
/// back in two seconds, during the object's life.
class PressingHand {
 public:
  PressingHand(EmulatedHand& hand, double front_m)
      : thread_([this, &hand, front_m] {
          for (int ms = 0; !stop_; ++ms) {
            hand.place({0.0, 0.0, front_m * (0.54 + 0.46 * std::cos(3.14159e-3 * ms))});
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
        }) {}
  ~PressingHand() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// Sets an environment variable during the object's life.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Environment() { unsetenv(name_); }

 private:
  const char* name_;
};

/// Whether a line of the program reports contact and a force: "... 1.14 N ... touching".
bool says_touched(const std::string& said) {
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    const size_t unit = line.find(" N ");
    if (unit == std::string::npos || line.find("touching") == std::string::npos) continue;
    if (std::strtod(line.c_str() + line.rfind(' ', unit - 1), nullptr) > 0.2) return true;
  }
  return false;
}

/// Feels the shell until there is a force, at most a minute. On a busy machine the hand is slow,
/// and a late device must not trigger the watchdog.
Outcome feel_shell(const TemporaryFolder& folder, const std::string& device) {
  Program program({"feel", "shell", "--device", device, "--seconds", "60", "--watchdog", "1000",
                   "--csv", folder / "ticks.csv", "--black-box", folder / "."});
  while (!program.ended() && !says_touched(program.said()))
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  program.signal(SIGINT);
  return program.wait();
}

/// The force during contact is the scene's, and it ends at zero.
void expect_felt(const TemporaryFolder& folder, const Outcome& outcome) {
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  const Table ticks(folder / "ticks.csv");
  ASSERT_GT(ticks.size(), 100u);
  double most = 0.0;
  bool touched = false;
  for (size_t k = 0; k < ticks.size(); ++k) {
    most = std::max(most, ticks.force(k));
    touched |= ticks.text(k, "contact") == "1";
  }
  EXPECT_TRUE(touched) << outcome.out;
  EXPECT_GT(most, 0.2) << outcome.out;
  EXPECT_EQ(ticks.force(ticks.size() - 1), 0.0);
}

nlohmann::json listed(const std::string& kind) {
  const Outcome outcome = run({"devices", "--json"});
  const nlohmann::json all = outcome.json();
  for (const auto& hand : all.at("hands"))
    if (hand.at("kind") == kind) return hand;
  return nullptr;
}

TEST(HaplyProgram, IsFeltThroughAService) {
  const TemporaryFolder folder;
  EmulatedHaply service;
  const PressingHand hand(service, 0.07);
  const std::string place =
      "127.0.0.1:" + std::to_string(service.port()) + ":" + std::to_string(service.events_port());
  const Outcome outcome = feel_shell(folder, "haply@" + place);
  expect_felt(folder, outcome);
  EXPECT_THAT(outcome.out, HasSubstr("Device    Haply Inverse3, 049D, as asked."));
  EXPECT_EQ(service.profile(), "palpate");
  EXPECT_GT(service.received_count(), 100u);
  EXPECT_FALSE(service.pushes()) << "the last force is zero";
  for (const std::string& rule : service.broken_rules()) ADD_FAILURE() << rule;
}

TEST(HaplyProgram, IsFoundAndListedWhereTheServiceUsuallyIs) {
  std::unique_ptr<EmulatedHaply> service;
  try {
    service = std::make_unique<EmulatedHaply>(
        EmulatedHaply::Options{.port = 10001, .events_port = 10020});
  } catch (const std::exception&) {
    GTEST_SKIP() << "Something else listens on port 10001 or 10020 here.";
  }
  EXPECT_EQ(listed("haply").value("usable", false), true);
  EXPECT_EQ(listed("haply").value("place", ""), "049D");
  service->change([](auto& options) { options.calibrated = false; });
  EXPECT_THAT(listed("haply").value("notes", ""), HasSubstr("Calibrate it"));
  service->change([](auto& options) { options.calibrated = options.in_use = true; });
  EXPECT_THAT(listed("haply").value("wrong", ""), HasSubstr("Another program"));
  service->change([](auto& options) { options.connected = false; });
  EXPECT_THAT(listed("haply").value("wrong", ""), HasSubstr("plug it in"));
  service->change([](auto& options) {
    options.connected = true;
    options.in_use = false;
  });
  const TemporaryFolder folder;
  const PressingHand hand(*service, 0.07);
  const Outcome outcome = feel_shell(folder, "auto");
  expect_felt(folder, outcome);
  EXPECT_THAT(outcome.out, HasSubstr("Device    Haply Inverse3, 049D, which is there."));
}

TEST(ForceDimensionProgram, IsFoundByItsLibraryAndFelt) {
  const Environment sdk("FDSDK", PALPATE_FAKE_SDK), presses("FAKE_DHD_PRESSES", "1");
  const auto device = listed("force-dimension");
  ASSERT_FALSE(device.is_null());
  EXPECT_EQ(device.value("usable", false), true) << device;
  EXPECT_EQ(device.value("name", ""), "Force Dimension omega.3");
  const TemporaryFolder folder;
  const Outcome outcome = feel_shell(folder, "force-dimension");
  expect_felt(folder, outcome);
  EXPECT_THAT(outcome.out, HasSubstr("Device    Force Dimension omega.3, 0, as asked."));
}

TEST(TouchProgram, IsFoundByItsLibraryAndFelt) {
  const Environment sdk("OH_SDK_BASE", PALPATE_FAKE_OPENHAPTICS), presses("FAKE_HD_PRESSES", "1");
  const auto device = listed("touch");
  ASSERT_FALSE(device.is_null());
  EXPECT_EQ(device.value("usable", false), true) << device;
  EXPECT_EQ(device.value("name", ""), "3D Systems Touch");
  EXPECT_EQ(device.value("max_force_n", 0.0), 3.3);
  const TemporaryFolder folder;
  const Outcome outcome = feel_shell(folder, "touch@Left hand");
  expect_felt(folder, outcome);
  EXPECT_THAT(outcome.out, HasSubstr("Device    3D Systems Touch, Left hand, as asked."));
}

TEST(PolhemProgram, IsFeltThroughItsPort) {
  const TemporaryFolder folder;
  EmulatedPolhem polhem;
  const PressingHand hand(polhem, 0.045);
  const Outcome outcome = feel_shell(folder, "polhem@" + polhem.port());
  expect_felt(folder, outcome);
  EXPECT_THAT(outcome.out, HasSubstr("Device    Polhem, " + polhem.port() + ", as asked."));
  EXPECT_EQ(polhem.malformed(), 0u);
  EXPECT_FALSE(polhem.pushes()) << "the last force is zero";
}

TEST(DeviceOption, SaysWhatIsWrongWithIt) {
  EXPECT_THAT(run({"feel", "molecule", "--device", "haply@here:there"}).err,
              AllOf(HasSubstr("no address of a Haply device"), HasSubstr("localhost:10001")));
  EXPECT_THAT(run({"feel", "molecule", "--device", "force-dimension@first"}).err,
              HasSubstr("no address of a Force Dimension device"));
  EXPECT_THAT(run({"feel", "molecule", "--device", "mouse@1"}).err,
              HasSubstr("only a real device has an address"));
  EXPECT_THAT(run({"feel", "molecule", "--device", "happly"}).err, HasSubstr("haply"));
}

}  // namespace
}  // namespace palpate::app
