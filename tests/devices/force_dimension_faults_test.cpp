// Faults that are likely with a Force Dimension device in contact, one row per fault, on the whole
// path below dlopen: a simulated library, MailboxDevice, the servo loop, the haptic step, the
// guards. The oracle is that library, which stores the last force.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "integration/devices/force_dimension.h"
#include "tests/devices/fake_dhd.h"
#include "tests/devices/fault_rows.h"
#include "tests/devices/mailbox_rig.h"

namespace palpate::devices::test {
namespace {

constexpr int kPower = 0, kReset = 3, kForce = 5, kBrake = 6, kOffCause = 14;

FakeDhd& library() {
  static FakeDhd* made = [] {
    void* handle = dlopen(PALPATE_FAKE_DHD, RTLD_NOW | RTLD_LOCAL);
    if (!handle) throw std::runtime_error(dlerror());
    return reinterpret_cast<FakeDhd* (*)()>(dlsym(handle, "fake_dhd"))();
  }();
  return *made;
}

/// Resets the library to its state without faults; devices left over from a test have no effect.
void heal_library() {
  FakeDhd& dhd = library();
  dhd.devices = 1;
  dhd.position_returns = dhd.force_returns = dhd.open_returns = dhd.status_returns = 0;
  dhd.error = dhd.position_skips = 0;
  dhd.hangs = dhd.brakes_by_itself = false;
  dhd.has_wrist = dhd.has_active_wrist = dhd.has_gripper = false;
  dhd.wrist_returns = dhd.gripper_returns = 0;
  dhd.status[kPower] = dhd.status[kReset] = 1;
}

class FakeHand final : public EmulatedHand {
 public:
  // The library: x towards the user, y right, z up.
  void place(glm::dvec3 p) override {
    library().x = p.z;
    library().y = p.x;
    library().z = p.y;
  }
  size_t received_count() const override {
    const std::lock_guard lock(library().mutex);
    return library().forces.size();
  }
  bool pushed(size_t command) const override {
    const std::lock_guard lock(library().mutex);
    return library().forces.at(command) != std::array<double, 3>{};
  }
};

ForceDimensionOptions made_library() {
  ForceDimensionOptions options;
  options.library = PALPATE_FAKE_DHD;
  return options;
}

class DhdRig final : public MailboxRig {
 public:
  struct Options {
    MailboxOptions mailbox = patient_mailbox();
  };
  static Options patient() { return {}; }

  explicit DhdRig(const Options& options) {
    heal_library();
    {
      const std::lock_guard lock(library().mutex);
      library().forces.clear();
    }
    hold(hand, glm::dvec3(0.0));
    start_mailbox(make_force_dimension_link(made_library()), options.mailbox);
  }
  ~DhdRig() override { heal_library(); }

  FakeHand hand;
};

using Rig = DhdRig;
using Row = FaultRow<Rig>;

void heal(Rig&) {
  heal_library();
}

/// Positions fail with an error of the library.
std::function<void(Rig&)> error(int number) {
  return [number](Rig&) {
    library().error = number;
    library().position_returns = -1;
  };
}

Row row_of_error(const char* name, int number, DeviceFault fault) {
  return {.name = name, .inject = error(number), .fault = fault, .recover = heal};
}

std::function<void(Rig&)> status(int which, int value) {
  return [which, value](Rig&) { library().status[size_t(which)] = value; };
}

void jump(Rig& rig) {
  rig.holds_grip = false;
  rig.hand.place({0.0, 0.03, 0.03});
}

std::vector<Row> rows() {
  return {
      // Every error of the library.
      row_of_error("ErrorUnspecified", 1, DeviceFault::kTransfer),
      row_of_error("ErrorCommunication", 2, DeviceFault::kTransfer),
      row_of_error("ErrorControllerBusy", 3, DeviceFault::kTimeout),
      row_of_error("ErrorNoDriver", 4, DeviceFault::kNoPermission),
      row_of_error("ErrorNoDevice", 5, DeviceFault::kUnplugged),
      row_of_error("ErrorNotAvailable", 6, DeviceFault::kTransfer),
      row_of_error("ErrorTimeout", 7, DeviceFault::kTimeout),
      row_of_error("ErrorGeometry", 8, DeviceFault::kOutOfReach),
      row_of_error("ErrorExpertModeDisabled", 9, DeviceFault::kTransfer),
      row_of_error("ErrorNotImplemented", 10, DeviceFault::kTransfer),
      row_of_error("ErrorOutOfMemory", 11, DeviceFault::kTransfer),
      row_of_error("ErrorDeviceNotReady", 12, DeviceFault::kStarting),
      row_of_error("ErrorFileNotFound", 13, DeviceFault::kTransfer),
      row_of_error("ErrorConfiguration", 14, DeviceFault::kTransfer),
      row_of_error("ErrorInvalidIndex", 15, DeviceFault::kUnplugged),
      row_of_error("ErrorDeprecated", 16, DeviceFault::kTransfer),
      row_of_error("ErrorNullArgument", 17, DeviceFault::kTransfer),
      row_of_error("ErrorRedundantFail", 18, DeviceFault::kGarbage),
      row_of_error("ErrorNotEnabled", 19, DeviceFault::kForceOff),
      row_of_error("ErrorDeviceInUse", 20, DeviceFault::kBusy),
      row_of_error("ErrorInvalid", 21, DeviceFault::kTransfer),
      row_of_error("ErrorNoRegulation", 22, DeviceFault::kTransfer),
      row_of_error("ErrorThatNobodyKnows", 4711, DeviceFault::kTransfer),
      // The cable.
      {.name = "UnpluggedInContact",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().devices = 0;
             library().error = 5;
             library().position_returns = library().force_returns = -1;
           },
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.run_periods(50);
             heal_library();
             rig.find(rig.hand);
           },
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().opened, 2U); }},
      {.name = "ComesBackHeldByAnotherProgram",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().error = 5;
             library().position_returns = library().force_returns = library().open_returns = -1;
           },
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             library().error = 20;
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.inputs.back().reading.fault == DeviceFault::kBusy; }));
             heal_library();
             rig.find(rig.hand);
           }},
      // Return values that are no errors.
      {.name = "MotorsAreSaturated",
       .inject = [](Rig&) { library().force_returns = 2; },
       .ends = Ends::kTolerated},
      {.name = "TheTimeGuardIsUpTwice",
       .inject = [](Rig&) { library().position_skips = 2; },
       .ends = Ends::kTolerated},
      {.name = "TheTimeGuardIsUpForGood",
       .inject = [](Rig&) { library().position_skips = 1'000'000; },
       .fault = DeviceFault::kTimeout,
       .recover = heal},
      // Status of the device.
      {.name = "ThePowerIsOff",
       .inject = status(kPower, 0),
       .fault = DeviceFault::kStarting,
       .recover = heal},
      {.name = "TheZeroIsLost",
       .inject = status(kReset, 0),
       .fault = DeviceFault::kNotHomed,
       .recover = heal},
      {.name = "ItBrakesForItsSpeed",
       .inject = [](Rig&) { library().brakes_by_itself = true; },
       .fault = DeviceFault::kForceOff,
       .recover = heal,
       .after = [](Rig&) { EXPECT_EQ(library().force_enabled, 1); }},
      {.name = "ThePersonSwitchesTheForceOff",
       .inject =
           [](Rig&) {
             library().status[kForce] = 0;
             library().status[kBrake] = 1;
             library().status[kOffCause] = 1;
           },
       .fault = DeviceFault::kForceOff,
       .recover =
           [](Rig& rig) {
             rig.run_periods(100);
             EXPECT_EQ(library().status[kForce], 0) << "only the user may switch it on";
             library().status[kForce] = 1;
             library().status[kBrake] = 0;
           }},
      // Positions.
      {.name = "ThePositionIsNoNumber",
       .inject =
           [](Rig& rig) {
             rig.holds_grip = false;
             library().x = std::nan("");
           },
       .fault = DeviceFault::kGarbage,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "ThePositionJumps",
       .inject = jump,
       .fault = DeviceFault::kJumped,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "ThePositionStands",
       .inject = [](Rig& rig) { rig.holds_grip = false; },
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      // The library, and the host.
      {.name = "ACallHangs",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().hangs = true;
           },
       .fault = DeviceFault::kTimeout,
       .within = 0,
       .recover =
           [](Rig& rig) {
             // The call that hung returns, with the old force; then zero follows.
             const size_t before = rig.hand.received_count();
             heal_library();
             EXPECT_TRUE(wait_for(
                 [&] { return rig.hand.received_count() > before + 1 && !rig.hand.pushes(); }));
             rig.find(rig.hand);
           },
       .options = {.mailbox = {.away_ns = 5'000'000'000,
                               .silence_ns = 200'000'000,
                               .priority = 0}}},
      {.name = "TheHostIsAwayAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = {.mailbox = {.away_ns = 200'000'000,
                               .silence_ns = 10'000'000'000,
                               .priority = 0}}},
  };
}

class ForceDimensionFault : public testing::TestWithParam<Row> {};

TEST_P(ForceDimensionFault, BringsTheForceDownAndLetsItComeBack) {
  Rig rig(GetParam().options);
  expect_row(rig, GetParam());
}

INSTANTIATE_TEST_SUITE_P(, ForceDimensionFault, testing::ValuesIn(rows()), name_of_row<Rig>);
INSTANTIATE_TEST_SUITE_P(AroundIt, ForceDimensionFault,
                         testing::ValuesIn(host_and_scene_rows<Rig>()), name_of_row<Rig>);

// ---- opening and closing

MailboxOptions quiet() {
  return {.away_ns = 5'000'000'000, .silence_ns = 10'000'000'000, .priority = 0};
}

bool says(MailboxDevice& device, DeviceFault fault) {
  return wait_for([&] { return device.exchange({}).fault == fault; });
}

TEST(ForceDimension, HasPalpatesAxesBothWays) {
  heal_library();
  FakeHand hand;
  hand.place({0.01, 0.02, 0.03});
  MailboxDevice device(make_force_dimension_link(made_library()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  DeviceReading reading;
  ASSERT_TRUE(wait_for([&] {
    reading = device.exchange({{1.0, 2.0, 3.0}, true});
    const std::lock_guard lock(library().mutex);
    // Towards the user, right, up.
    return library().forces.back() == std::array{3.0, 1.0, 2.0};
  }));
  EXPECT_EQ(reading.position_m, glm::dvec3(0.01, 0.02, 0.03));
  const DeviceInfo info = device.info();
  EXPECT_EQ(info.name, "Force Dimension omega.3");
  EXPECT_EQ(info.max_force_n, 12.0);
  EXPECT_EQ(library().max_force, 12.0) << "the library must limit it too";
  EXPECT_EQ(library().gravity, 1);
}

TEST(ForceDimension, TellsHowItsGripIsHeldWhereItHasAWrist) {
  heal_library();
  FakeDhd& dhd = library();
  {
    MailboxDevice device(make_force_dimension_link(made_library()), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    const GripReading grip = device.exchange({}).grip;
    EXPECT_FALSE(grip.turns || grip.opens);
    EXPECT_EQ(device.info().sensed_dof, 3);
  }
  dhd.has_wrist = dhd.has_gripper = true;
  // A quarter about the library's y: its x axis, along the shaft, goes down, its z to the user.
  constexpr std::array kDown{0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0};
  for (size_t n = 0; n < kDown.size(); ++n) dhd.orientation[n] = kDown[n];
  for (size_t n = 0; n < 3; ++n) dhd.spin[n] = double(n + 1);
  dhd.gripper = 0.25;
  MailboxDevice device(make_force_dimension_link(made_library()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  EXPECT_EQ(device.info().sensed_dof, 6);
  DeviceReading reading = device.exchange({});
  EXPECT_TRUE(reading.grip.turns && reading.grip.opens);
  EXPECT_LT(glm::distance(shaft_of(reading.grip), glm::dvec3(0.0, -1.0, 0.0)), 1e-15);
  EXPECT_LT(glm::distance(reading.grip.device_from_grip * glm::dvec3(1.0, 0.0, 0.0),
                          glm::dvec3(1.0, 0.0, 0.0)),
            1e-15)
      << "to the right, as the axis of the turn";
  EXPECT_EQ(reading.grip.angular_velocity_rad_per_s, glm::dvec3(2.0, 3.0, 1.0));
  EXPECT_EQ(reading.grip.opening_rad, 0.25);
  dhd.wrist_returns = dhd.gripper_returns = -1;
  ASSERT_TRUE(wait_for([&] {
    reading = device.exchange({});
    return !reading.grip.turns && !reading.grip.opens;
  }));
  EXPECT_EQ(reading.fault, DeviceFault::kNone);
}

/// The newest torque that the library got, palpate's axes; not finite: none.
glm::dvec3 newest_torque() {
  const std::lock_guard lock(library().mutex);
  if (library().torques.empty()) return glm::dvec3(std::nan(""));
  const auto& t = library().torques.back();
  return {t[1], t[2], t[0]};
}

TEST(ForceDimension, GivesATorqueOnlyToAWristWithMotorsAndNoneAfterAFault) {
  heal_library();
  FakeDhd& dhd = library();
  dhd.has_wrist = true;
  DeviceCommand turning;
  turning.torque_n_m = {0.01, 0.02, -0.03};
  for (const bool active : {false, true}) {
    SCOPED_TRACE(active);
    dhd.has_active_wrist = active;
    {
      const std::lock_guard lock(dhd.mutex);
      dhd.torques.clear();
    }
    MailboxDevice device(make_force_dimension_link(made_library()), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    EXPECT_EQ(device.info().actuated_dof, active ? 6 : 3);
    for (int k = 0; k < 20; ++k) {
      device.exchange(turning);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!active) {
      EXPECT_TRUE(std::isnan(newest_torque().x));
      continue;
    }
    EXPECT_TRUE(wait_for([&] {
      device.exchange(turning);
      return newest_torque() == turning.torque_n_m;
    }));
    // More than the wrist may have keeps its direction.
    DeviceCommand strong;
    strong.torque_n_m = {0.0, 5.0, 0.0};
    EXPECT_TRUE(wait_for([&] {
      device.exchange(strong);
      return newest_torque() == glm::dvec3(0.0, 0.2, 0.0);
    }));
    dhd.status[kPower] = 0;
    EXPECT_TRUE(wait_for([&] {
      device.exchange(turning);
      return newest_torque() == glm::dvec3(0.0);
    }));
    dhd.status[kPower] = 1;
  }
  EXPECT_EQ(newest_torque(), glm::dvec3(0.0)) << "closed";
}

TEST(ForceDimension, NeverSendsMoreThanTheDeviceHas) {
  heal_library();
  MailboxDevice device(make_force_dimension_link(made_library()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  ASSERT_TRUE(wait_for([&] {
    device.exchange({{0.0, 0.0, 1000.0}, true});
    const std::lock_guard lock(library().mutex);
    return library().forces.back() == std::array{12.0, 0.0, 0.0};
  }));
}

TEST(ForceDimension, ClosesWithZeroForceAndBrakesOn) {
  heal_library();
  const int closed = library().closed;
  {
    MailboxDevice device(make_force_dimension_link(made_library()), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    FakeHand hand;
    ASSERT_TRUE(wait_for([&] {
      device.exchange({{0.0, 2.0, 0.0}, true});
      return hand.pushes();
    }));
  }
  EXPECT_FALSE(FakeHand().pushes());
  EXPECT_EQ(library().closed, closed + 1);
  EXPECT_EQ(library().force_enabled, 0);
  EXPECT_EQ(library().status[kBrake], 1);
}

TEST(ForceDimension, SaysWhyItCanNotBeOpenedAndLeavesTheArmAlone) {
  heal_library();
  library().status[kReset] = 0;
  MailboxDevice device(make_force_dimension_link(made_library()), quiet());
  EXPECT_TRUE(says(device, DeviceFault::kNotHomed));
  EXPECT_EQ(library().force_enabled, 0) << "an arm without a known position";
  library().status[kReset] = 1;
  EXPECT_TRUE(says(device, DeviceFault::kNone)) << "must be detected without a request";
}

TEST(ForceDimension, EndsThoughACallNeverComesBack) {
  heal_library();
  {
    MailboxDevice device(make_force_dimension_link(made_library()),
                         {.away_ns = 5'000'000'000, .silence_ns = 50'000'000, .priority = 0});
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    library().hangs = true;
    EXPECT_TRUE(says(device, DeviceFault::kTimeout));
  }
  const int closed = library().closed;
  // The abandoned thread closes the device after all.
  library().hangs = false;
  EXPECT_TRUE(wait_for([&] { return library().closed > closed; }));
  EXPECT_FALSE(FakeHand().pushes());
}

TEST(ForceDimension, IsNotThereWithoutALibraryThatHasWhatIsNeeded) {
  ForceDimensionOptions options;
  options.library = "/nowhere/libdrd.so";
  EXPECT_FALSE(force_dimension_library_is_there(options));
  // A library, but not Force Dimension's.
  options.library = "libm.so.6";
  EXPECT_FALSE(force_dimension_library_is_there(options));
  EXPECT_TRUE(force_dimension_library_is_there(made_library()));
}

}  // namespace
}  // namespace palpate::devices::test
