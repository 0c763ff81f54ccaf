// Faults that are likely with a Touch in contact, one row per fault, on the whole path below
// dlopen: a simulated library with a scheduler of its own, MailboxDevice, the servo loop, the
// haptic step, the guards. The oracle is that library, which stores the last force.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "integration/devices/touch.h"
#include "tests/devices/fake_hd.h"
#include "tests/devices/fault_rows.h"
#include "tests/devices/mailbox_rig.h"

namespace palpate::devices::test {
namespace {

using Force = std::array<double, 3>;
constexpr unsigned kGood = 0x5000, kNeedsUpdate = 0x5001, kNeedsManualInput = 0x5002;
constexpr int kEncoderReset = 1, kAutomatic = 2, kInkwell = 4;
// The middle of the simulated device's workspace, which is not its origin.
constexpr glm::dvec3 kCentre(0.0, 0.01, 0.0);

FakeHd& library() {
  static FakeHd* made = [] {
    void* handle = dlopen(PALPATE_FAKE_HD, RTLD_NOW | RTLD_LOCAL);
    if (!handle) throw std::runtime_error(dlerror());
    return reinterpret_cast<FakeHd* (*)()>(dlsym(handle, "fake_hd"))();
  }();
  return *made;
}

/// Resets the library to its state without faults; devices left over from a test have no effect.
void heal_library() {
  FakeHd& hd = library();
  hd.is_there = hd.safety_switch = hd.inkwell_switch = true;
  hd.frame_error = hd.begin_error = hd.init_error = hd.start_error = hd.schedule_error = 0;
  hd.loses_forces = hd.stands = hd.hangs = hd.output_off = false;
  hd.frame_us = 0;
  hd.calibration = hd.calibration_after_update = kGood;
  hd.styles = kInkwell;
  for (auto& one : hd.temperatures) one = 0.2;
}

/// As after loading, and nothing recorded. The scheduler is quicker than a real one, which saves
/// most of the tests' time.
void start_over() {
  heal_library();
  FakeHd& hd = library();
  hd.period_us = 200;
  hd.knows_switches = hd.knows_temperatures = hd.knows_rotation = true;
  for (size_t n = 0; n < hd.axes.size(); ++n) hd.axes[n] = n % 4 == 0 ? 1.0 : 0.0;
  hd.max_force = 3.3;
  hd.continuous_force = 0.88;
  hd.stiffness = 0.5;
  const std::lock_guard lock(hd.mutex);
  hd.forces.clear();
  hd.broken_rules.clear();
}

void expect_no_broken_rules() {
  const std::lock_guard lock(library().mutex);
  for (const std::string& rule : library().broken_rules) ADD_FAILURE() << rule;
}

class FakePen final : public EmulatedHand {
 public:
  void place(glm::dvec3 p) override {
    library().x = 1e3 * p.x;
    library().y = 1e3 * p.y;
    library().z = 1e3 * p.z;
  }
  size_t received_count() const override {
    const std::lock_guard lock(library().mutex);
    return library().forces.size();
  }
  bool pushed(size_t command) const override {
    const std::lock_guard lock(library().mutex);
    return library().forces.at(command) != Force{};
  }
};

Force last_force() {
  const std::lock_guard lock(library().mutex);
  return library().forces.empty() ? Force{} : library().forces.back();
}

/// For busy machines: a thread that is late is no fault.
TouchOptions patient_touch() {
  TouchOptions options;
  options.library = PALPATE_FAKE_HD;
  options.opening_wait_ms = 10'000;
  options.answer_wait_ms = 500;
  options.order_ns = 20'000'000'000;
  return options;
}

class TouchRig final : public MailboxRig {
 public:
  struct Options {
    MailboxOptions mailbox = patient_mailbox();
    int answer_wait_ms = patient_touch().answer_wait_ms;
  };
  static Options patient() { return {}; }

  explicit TouchRig(const Options& options) {
    start_over();
    hold(hand, kCentre);
    TouchOptions touch = patient_touch();
    touch.answer_wait_ms = options.answer_wait_ms;
    start_mailbox(make_touch_link(touch), options.mailbox);
  }
  ~TouchRig() override { heal_library(); }

  FakePen hand;
};

using Rig = TouchRig;
using Row = FaultRow<Rig>;

void heal(Rig&) {
  heal_library();
}

/// Each frame ends with an error.
Row row_of_error(const char* name, unsigned code, DeviceFault fault) {
  return {.name = name,
          .inject = [code](Rig&) { library().frame_error = code; },
          .fault = fault,
          .recover = heal};
}

void jump(Rig& rig) {
  rig.holds_grip = false;
  rig.hand.place(kCentre + glm::dvec3(0.0, 0.03, 0.02));
}

void unplug(Rig& rig) {
  rig.watched->lose();
  library().is_there = false;
  library().loses_forces = true;
  library().frame_error = 0x0302;
}

/// For faults that are known by missing frames.
Rig::Options short_wait() {
  Rig::Options options = Rig::patient();
  options.answer_wait_ms = 100;
  return options;
}

std::vector<Row> rows() {
  return {
      // Every error of the library.
      row_of_error("InvalidEnum", 0x0100, DeviceFault::kTransfer),
      row_of_error("InvalidValue", 0x0101, DeviceFault::kTransfer),
      row_of_error("InvalidOperation", 0x0102, DeviceFault::kTransfer),
      row_of_error("InvalidInputType", 0x0103, DeviceFault::kTransfer),
      row_of_error("BadHandle", 0x0104, DeviceFault::kUnplugged),
      row_of_error("WarmMotors", 0x0200, DeviceFault::kHot),
      row_of_error("ExceededMaxForce", 0x0201, DeviceFault::kForceOff),
      row_of_error("ExceededMaxForceImpulse", 0x0202, DeviceFault::kForceOff),
      row_of_error("ExceededMaxVelocity", 0x0203, DeviceFault::kForceOff),
      row_of_error("ForceError", 0x0204, DeviceFault::kForceOff),
      row_of_error("DeviceFaultOfTheLibrary", 0x0300, DeviceFault::kUnplugged),
      row_of_error("DeviceAlreadyInitiated", 0x0301, DeviceFault::kBusy),
      row_of_error("CommunicationError", 0x0302, DeviceFault::kTransfer),
      row_of_error("CommunicationConfigurationError", 0x0303, DeviceFault::kTransfer),
      row_of_error("TimerError", 0x0304, DeviceFault::kTimeout),
      row_of_error("IllegalBegin", 0x0400, DeviceFault::kTransfer),
      row_of_error("IllegalEnd", 0x0401, DeviceFault::kTransfer),
      row_of_error("FrameError", 0x0402, DeviceFault::kTransfer),
      row_of_error("InvalidPriority", 0x0500, DeviceFault::kTransfer),
      row_of_error("SchedulerFull", 0x0501, DeviceFault::kTransfer),
      row_of_error("InvalidLicence", 0x0600, DeviceFault::kNoPermission),
      row_of_error("ErrorThatNobodyKnows", 0x4711, DeviceFault::kTransfer),
      {.name = "TheWorstOfTwoErrorsCounts",
       .inject =
           [](Rig&) {
             library().begin_error = 0x0200;
             library().frame_error = 0x0302;
           },
       .fault = DeviceFault::kTransfer,
       .recover = heal},
      // The cable.
      {.name = "UnpluggedInContact",
       .inject = unplug,
       .fault = DeviceFault::kTransfer,
       .then = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.run_periods(50);
             heal_library();
             rig.find(rig.hand);
           },
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().opened, 2U); }},
      {.name = "ComesBackHeldByAnotherProgram",
       .inject = unplug,
       .fault = DeviceFault::kTransfer,
       .then = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             library().is_there = true;
             library().init_error = 0x0301;
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.inputs.back().reading.fault == DeviceFault::kBusy; }));
             heal_library();
             rig.find(rig.hand);
           }},
      // Its motors.
      {.name = "TheMotorsGetWarmAndOnlyCoolOnesMayPush",
       .inject = [](Rig&) { library().temperatures[2] = 0.96; },
       .fault = DeviceFault::kHot,
       .within = 0,
       .recover =
           [](Rig& rig) {
             library().temperatures[2] = 0.9;
             rig.run_periods(300);
             EXPECT_EQ(rig.inputs.back().reading.fault, DeviceFault::kHot);
             library().temperatures[2] = 0.8;
           }},
      {.name = "TheForceIsSwitchedOffByItself",
       .inject = [](Rig&) { library().output_off = true; },
       .fault = DeviceFault::kForceOff,
       .recover = heal,
       .after = [](Rig&) { EXPECT_TRUE(library().force_output); }},
      // Its calibration, and the hand.
      {.name = "TheCalibrationIsLostAndTheInkwellBringsItBack",
       .inject = [](Rig&) { library().calibration = kNeedsManualInput; },
       .fault = DeviceFault::kNotHomed,
       .within = 0,
       .recover =
           [](Rig&) {
             // The pen is in the inkwell now.
             library().calibration = kNeedsUpdate;
           },
       .after = [](Rig&) { EXPECT_EQ(library().updated_style, kInkwell); }},
      {.name = "ACalibrationInContactWaitsForTheForceToEnd",
       .inject =
           [](Rig&) {
             library().updates = 0;
             library().calibration = kNeedsUpdate;
           },
       .ends = Ends::kTolerated,
       .after = [](Rig&) { EXPECT_EQ(library().updates, 0); }},
      {.name = "ThePenIsLetGo",
       .inject = [](Rig&) { library().safety_switch = false; },
       .fault = DeviceFault::kNoHand,
       .recover = heal},
      {.name = "ThePenIsPutIntoItsInkwell",
       .inject = [](Rig&) { library().inkwell_switch = false; },
       .fault = DeviceFault::kNoHand,
       .recover = heal},
      // Positions.
      {.name = "ThePositionIsNoNumber",
       .inject =
           [](Rig& rig) {
             rig.holds_grip = false;
             library().x = std::nan("");
           },
       .fault = DeviceFault::kGarbage,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "ThePositionIsInfinite",
       .inject =
           [](Rig& rig) {
             rig.holds_grip = false;
             library().z = INFINITY;
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
      // The library's thread, and the host.
      {.name = "FramesAreLongButInTime",
       .inject = [](Rig&) { library().frame_us = 2000; },
       .ends = Ends::kTolerated},
      {.name = "FramesAreTooLong",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().frame_us = 400'000;
           },
       .fault = DeviceFault::kTimeout,
       .recover =
           [](Rig& rig) {
             heal_library();
             EXPECT_TRUE(wait_for([&] { return !rig.hand.pushes(); }));
             rig.find(rig.hand);
           },
       .options = short_wait()},
      {.name = "TheSchedulerStands",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().stands = true;
           },
       .fault = DeviceFault::kTimeout,
       .recover =
           [](Rig& rig) {
             heal_library();
             EXPECT_TRUE(wait_for([&] { return !rig.hand.pushes(); }));
             rig.find(rig.hand);
           },
       .options = short_wait()},
      {.name = "ACallHangs",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             library().hangs = true;
           },
       .fault = DeviceFault::kTimeout,
       .recover =
           [](Rig& rig) {
             heal_library();
             EXPECT_TRUE(wait_for([&] { return !rig.hand.pushes(); }));
             rig.find(rig.hand);
           },
       .options = short_wait()},
      {.name = "TheHostIsAwayAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = {.mailbox = {.away_ns = 200'000'000,
                               .silence_ns = 10'000'000'000,
                               .priority = 0}}},
  };
}

class TouchFault : public testing::TestWithParam<Row> {};

TEST_P(TouchFault, BringsTheForceDownAndLetsItComeBack) {
  {
    Rig rig(GetParam().options);
    expect_row(rig, GetParam());
  }
  EXPECT_FALSE(FakePen().pushes());
  expect_no_broken_rules();
}

INSTANTIATE_TEST_SUITE_P(, TouchFault, testing::ValuesIn(rows()), name_of_row<Rig>);
INSTANTIATE_TEST_SUITE_P(AroundIt, TouchFault, testing::ValuesIn(host_and_scene_rows<Rig>()),
                         name_of_row<Rig>);

// ---- opening and closing

MailboxOptions quiet() {
  return {.away_ns = 5'000'000'000, .silence_ns = 10'000'000'000, .priority = 0};
}

bool says(MailboxDevice& device, DeviceFault fault) {
  return wait_for([&] { return device.exchange({}).fault == fault; });
}

TEST(Touch, HasPalpatesAxesBothWaysAndTellsWhatItCan) {
  start_over();
  FakePen().place({0.01, 0.02, 0.03});
  library().buttons = 3;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  DeviceReading reading;
  ASSERT_TRUE(wait_for([&] {
    reading = device.exchange({{0.5, 1.0, 1.5}, true});
    return last_force() == Force{0.5, 1.0, 1.5};
  }));
  EXPECT_LT(glm::distance(reading.position_m, glm::dvec3(0.01, 0.02, 0.03)), 1e-15);
  EXPECT_EQ(reading.buttons, 3U);
  library().buttons = 0;
  const DeviceInfo info = device.info();
  EXPECT_EQ(info.kind, "touch");
  EXPECT_EQ(info.name, "3D Systems Touch");
  EXPECT_EQ(info.address, "");
  EXPECT_EQ(info.max_force_n, 3.3);
  EXPECT_EQ(info.continuous_force_n, 0.88);
  EXPECT_EQ(info.max_stiffness_n_per_m, 500.0);
  EXPECT_LT(glm::distance(info.workspace_centre_m, kCentre), 1e-15);
  EXPECT_DOUBLE_EQ(info.workspace_radius_m, 0.035) << "the largest ball in its box";
  EXPECT_DOUBLE_EQ(info.delay_s, 2e-3);
  EXPECT_EQ(info.sensed_dof, 6);
  EXPECT_EQ(info.actuated_dof, 3);
  EXPECT_TRUE(library().clamping) << "the library must limit the force too";
}

TEST(Touch, TellsHowItsPenIsHeld) {
  start_over();
  FakeHd& hd = library();
  // The shaft points up, the pen's x to the right: its y goes away from the user.
  constexpr std::array kUp{1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0};
  for (size_t n = 0; n < kUp.size(); ++n) hd.axes[n] = kUp[n];
  for (size_t n = 0; n < 3; ++n) hd.spin[n] = 0.1 * double(n + 1);
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  DeviceReading reading = device.exchange({});
  EXPECT_TRUE(reading.grip.turns);
  EXPECT_FALSE(reading.grip.opens);
  EXPECT_LT(glm::distance(shaft_of(reading.grip), glm::dvec3(0.0, 1.0, 0.0)), 1e-15);
  EXPECT_LT(glm::distance(reading.grip.device_from_grip * glm::dvec3(0.0, 1.0, 0.0),
                          glm::dvec3(0.0, 0.0, -1.0)),
            1e-15);
  EXPECT_EQ(reading.grip.angular_velocity_rad_per_s, glm::dvec3(0.1, 0.2, 0.1 * 3.0));
  // A rotation that is none is no reason to end the force.
  hd.axes[4] = std::nan("");
  ASSERT_TRUE(wait_for([&] { return !(reading = device.exchange({})).grip.turns; }));
  EXPECT_EQ(reading.fault, DeviceFault::kNone);
}

TEST(Touch, WorksWithoutARotation) {
  start_over();
  library().knows_rotation = false;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  EXPECT_FALSE(device.exchange({}).grip.turns);
}

TEST(Touch, BelievesNoNumberThatCanNotBe) {
  start_over();
  library().max_force = std::nan("");
  library().continuous_force = -1.0;
  library().stiffness = 0.0;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  EXPECT_EQ(device.info().max_force_n, 3.3);
  EXPECT_EQ(device.info().continuous_force_n, 0.88);
  EXPECT_EQ(device.info().max_stiffness_n_per_m, 500.0);
}

TEST(Touch, NeverSendsMoreThanTheDeviceHas) {
  start_over();
  library().max_force = 2.0;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, DeviceFault::kNone));
  ASSERT_TRUE(wait_for([&] {
    device.exchange({{0.0, 0.0, 1000.0}, true});
    return last_force() == Force{0.0, 0.0, 2.0};
  }));
}

TEST(Touch, WorksWithoutSwitchesAndTemperatures) {
  start_over();
  library().knows_switches = library().knows_temperatures = false;
  library().safety_switch = library().inkwell_switch = false;
  for (auto& one : library().temperatures) one = 1.0;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  EXPECT_TRUE(says(device, DeviceFault::kNone));
}

TEST(Touch, HeedsNoSwitchThatWasNeverOn) {
  start_over();
  library().safety_switch = library().inkwell_switch = false;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  EXPECT_TRUE(says(device, DeviceFault::kNone)) << "a device may have no such switch";
}

TEST(Touch, IsTheOneOfThatName) {
  start_over();
  TouchOptions options = patient_touch();
  options.configuration = "Left hand";
  {
    MailboxDevice device(make_touch_link(options), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    EXPECT_EQ(device.info().address, "Left hand");
    const std::lock_guard lock(library().mutex);
    EXPECT_EQ(library().initialised, "Left hand");
  }
  options.configuration = "Nobody";
  const int opened = library().opened;
  const auto link = make_touch_link(options);
  EXPECT_EQ(link->open(), DeviceFault::kNotOpened);
  EXPECT_EQ(library().opened, opened);
}

TEST(Touch, ClosesWithZeroForceAndNoOutput) {
  start_over();
  const int closed = library().closed;
  {
    MailboxDevice device(make_touch_link(patient_touch()), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    ASSERT_TRUE(wait_for([&] {
      device.exchange({{0.0, 2.0, 0.0}, true});
      return FakePen().pushes();
    }));
  }
  EXPECT_FALSE(FakePen().pushes());
  EXPECT_EQ(library().closed, closed + 1);
  EXPECT_FALSE(library().force_output);
  EXPECT_FALSE(library().runs);
  expect_no_broken_rules();
}

TEST(Touch, SaysWhyItCanNotBeOpenedAndLeavesNothingOpen) {
  start_over();
  const auto link = make_touch_link(patient_touch());
  const auto reason = [&](std::atomic<unsigned>& where, unsigned code) {
    const int left_open = library().opened - library().closed;
    where = code;
    const DeviceFault fault = link->open();
    heal_library();
    EXPECT_EQ(library().opened - library().closed, left_open);
    EXPECT_FALSE(library().runs);
    return fault;
  };
  FakeHd& hd = library();
  EXPECT_EQ(reason(hd.init_error, 0x0300), DeviceFault::kNotOpened);
  EXPECT_EQ(reason(hd.init_error, 0x0303), DeviceFault::kNotOpened);
  EXPECT_EQ(reason(hd.init_error, 0x0301), DeviceFault::kBusy);
  EXPECT_EQ(reason(hd.init_error, 0x0600), DeviceFault::kNoPermission);
  EXPECT_EQ(reason(hd.start_error, 0x0304), DeviceFault::kTimeout);
  EXPECT_EQ(reason(hd.schedule_error, 0x0501), DeviceFault::kTransfer);
  EXPECT_EQ(reason(hd.begin_error, 0x0104), DeviceFault::kUnplugged);
  ASSERT_EQ(link->open(), DeviceFault::kNone);
  link->close();
  expect_no_broken_rules();
}

TEST(Touch, SaysThatASchedulerRunsNoFrame) {
  start_over();
  TouchOptions options = patient_touch();
  options.opening_wait_ms = 50;
  const auto link = make_touch_link(options);
  library().stands = true;
  EXPECT_EQ(link->open(), DeviceFault::kTimeout);
  library().stands = false;
  EXPECT_EQ(link->open(), DeviceFault::kNone) << "the callback of before must be gone";
  link->close();
  expect_no_broken_rules();
}

/// What a device that is not calibrated says, and becomes.
struct CalibrationRow {
  const char* name;
  int styles;
  unsigned calibration;
  unsigned after_update;
  DeviceFault fault;
  int updated_style;
};

void PrintTo(const CalibrationRow& row, std::ostream* out) {
  *out << row.name;
}

class TouchCalibration : public testing::TestWithParam<CalibrationRow> {};

TEST_P(TouchCalibration, IsUpdatedOnlyWhereThatNeedsNobody) {
  const CalibrationRow& row = GetParam();
  start_over();
  FakeHd& hd = library();
  hd.styles = row.styles;
  hd.calibration = row.calibration;
  hd.calibration_after_update = row.after_update;
  hd.updated_style = 0;
  MailboxDevice device(make_touch_link(patient_touch()), quiet());
  ASSERT_TRUE(says(device, row.fault));
  // Nobody calls in vain: no force reaches an arm whose position is not known.
  const size_t before = FakePen().received_count();
  while (FakePen().received_count() < before + 300) device.exchange({{0.0, 0.5, 0.0}, true});
  EXPECT_EQ(device.exchange({}).fault, row.fault);
  EXPECT_EQ(hd.updated_style, row.updated_style);
  if (row.fault == DeviceFault::kNone) return;
  EXPECT_FALSE(hd.force_output);
  hd.calibration = kGood;
  EXPECT_TRUE(says(device, DeviceFault::kNone)) << "must be detected without a request";
  EXPECT_TRUE(hd.force_output);
}

INSTANTIATE_TEST_SUITE_P(
    , TouchCalibration,
    testing::Values(CalibrationRow{"Good", kInkwell, kGood, kGood, DeviceFault::kNone, 0},
                    CalibrationRow{"InkwellWaits", kInkwell, kNeedsManualInput, kGood,
                                   DeviceFault::kNotHomed, 0},
                    CalibrationRow{"InkwellUpdates", kInkwell, kNeedsUpdate, kGood,
                                   DeviceFault::kNone, kInkwell},
                    CalibrationRow{"AutomaticUpdates", kAutomatic | kEncoderReset, kNeedsUpdate,
                                   kGood, DeviceFault::kNone, kAutomatic},
                    CalibrationRow{"AutomaticFails", kAutomatic, kNeedsUpdate, kNeedsManualInput,
                                   DeviceFault::kNotHomed, kAutomatic},
                    CalibrationRow{"EncoderResetNeedsAPerson", kEncoderReset, kNeedsUpdate, kGood,
                                   DeviceFault::kNotHomed, 0},
                    CalibrationRow{"NoStyleNeedsAPerson", 0, kNeedsUpdate, kGood,
                                   DeviceFault::kNotHomed, 0},
                    CalibrationRow{"AnAnswerThatNobodyKnows", kInkwell, 0x1234, kGood,
                                   DeviceFault::kNotHomed, 0}),
    [](const auto& row) { return row.param.name; });

TEST(Touch, EndsAForceThatNobodyRenews) {
  start_over();
  TouchOptions options = patient_touch();
  options.order_ns = 200'000'000;
  const auto link = make_touch_link(options);
  ASSERT_EQ(link->open(), DeviceFault::kNone);
  ASSERT_TRUE(wait_for([&] {
    link->exchange(glm::dvec3(0.0));
    return library().force_output.load();
  }));
  ASSERT_TRUE(wait_for([&] {
    link->exchange({0.0, 1.0, 0.0});
    return FakePen().pushes();
  }));
  EXPECT_TRUE(wait_for([] { return !FakePen().pushes(); }));
  // It must not come back as a step.
  EXPECT_EQ(link->exchange({0.0, 1.0, 0.0}).said, DeviceFault::kTimeout);
  EXPECT_FALSE(FakePen().pushes());
  EXPECT_EQ(link->exchange(glm::dvec3(0.0)).said, DeviceFault::kNone);
  EXPECT_EQ(link->exchange({0.0, 1.0, 0.0}).said, DeviceFault::kNone);
  EXPECT_TRUE(FakePen().pushes());
  link->close();
  EXPECT_FALSE(FakePen().pushes());
}

TEST(Touch, EndsThoughACallNeverComesBack) {
  start_over();
  TouchOptions options = patient_touch();
  options.answer_wait_ms = 20;
  {
    MailboxDevice device(make_touch_link(options), quiet());
    ASSERT_TRUE(says(device, DeviceFault::kNone));
    library().hangs = true;
    EXPECT_TRUE(says(device, DeviceFault::kTimeout));
  }
  const int closed = library().closed;
  // The abandoned thread closes the device after all.
  library().hangs = false;
  EXPECT_TRUE(wait_for([&] { return library().closed > closed; }));
  EXPECT_FALSE(FakePen().pushes());
  EXPECT_FALSE(library().runs);
}

TEST(Touch, IsNotThereWithoutALibraryThatHasWhatIsNeeded) {
  TouchOptions options;
  options.library = "/nowhere/libHD.so";
  EXPECT_FALSE(touch_library_is_there(options));
  EXPECT_EQ(make_touch_link(options)->open(), DeviceFault::kNoLibrary);
  // A library, but not OpenHaptics'; and one of its kind that lacks a function.
  for (const char* file : {"libm.so.6", PALPATE_OLD_HD}) {
    options.library = file;
    EXPECT_FALSE(touch_library_is_there(options)) << file;
    EXPECT_EQ(make_touch_link(options)->open(), DeviceFault::kNoLibrary) << file;
  }
  EXPECT_TRUE(touch_library_is_there(patient_touch()));
}

}  // namespace
}  // namespace palpate::devices::test
