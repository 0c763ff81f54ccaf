// A library with the functions of OpenHaptics' HD that palpate calls, as its reference describes
// them, written independently of the code under test. One device. With FAKE_HD_PRESSES set, the pen
// moves back and forth along the user's line of sight by itself.
#include "tests/devices/fake_hd.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>

using palpate::devices::test::FakeHd;

namespace {

constexpr unsigned kHandle = 7, kNoHandle = 0xffffffff;
constexpr unsigned kInvalidEnum = 0x0100, kInvalidOperation = 0x0102, kBadHandle = 0x0104,
                   kAlreadyInitiated = 0x0301, kCommunicationError = 0x0302, kIllegalBegin = 0x0400,
                   kIllegalEnd = 0x0401;

struct ErrorInfo {
  unsigned code;
  int internal_code;
  unsigned handle;
};

struct Operation {
  unsigned long id;
  unsigned (*callback)(void*);
  void* user;
};

/// What the library alone knows.
struct Inside {
  FakeHd shown;
  std::mutex mutex;  ///< of the three below
  std::vector<unsigned> errors;
  std::vector<Operation> operations;
  unsigned long last_id = 0;
  std::atomic<bool> initialised = false, in_frame = false;
  std::array<double, 3> commanded{};
  std::thread scheduler;
  std::thread::id ticks_on;
};

Inside& inside() {
  static auto* made = new Inside;
  return *made;
}
FakeHd& fake() {
  return inside().shown;
}

void error(unsigned code) {
  if (code == 0) return;
  const std::lock_guard lock(inside().mutex);
  inside().errors.push_back(code);
}

void broken(const char* rule) {
  const std::lock_guard lock(fake().mutex);
  for (const std::string& known : fake().broken_rules)
    if (known == rule) return;
  fake().broken_rules.emplace_back(rule);
}

/// What is current may be asked for within a frame only.
void in_frame(const char* rule) {
  if (!inside().in_frame) broken(rule);
}

/// Back and forth once in two seconds.
double pressed_z() {
  const double t =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  return 17.5 + 15.0 * std::cos(3.14159265 * t);
}

void tick() {
  std::vector<Operation> now;
  {
    const std::lock_guard lock(inside().mutex);
    now = inside().operations;
  }
  for (const Operation& operation : now) {
    if (operation.callback(operation.user) != 0) continue;
    const std::lock_guard lock(inside().mutex);
    std::erase_if(inside().operations, [&](const Operation& o) { return o.id == operation.id; });
  }
}

void run_scheduler() {
  inside().ticks_on = std::this_thread::get_id();
  while (fake().runs) {
    if (!fake().stands) tick();
    std::this_thread::sleep_for(std::chrono::microseconds(fake().period_us));
  }
}

}  // namespace

extern "C" {

FakeHd* fake_hd() {
  return &fake();
}

unsigned hdInitDevice(const char* name) {
  if (inside().initialised) {
    error(kAlreadyInitiated);
    return kNoHandle;
  }
  const std::string asked = name ? name : "";
  {
    const std::lock_guard lock(fake().mutex);
    if (!asked.empty() && asked != fake().configuration) {
      error(0x0303);
      return kNoHandle;
    }
    fake().initialised = asked;
  }
  if (!fake().is_there) error(kCommunicationError);
  error(fake().init_error);
  if (!fake().is_there || fake().init_error != 0) return kNoHandle;
  inside().initialised = true;
  ++fake().opened;
  fake().force_output = false;
  return kHandle;
}
void hdDisableDevice(unsigned handle) {
  if (handle != kHandle || !inside().initialised) broken("a device is disabled that is not open");
  {
    const std::lock_guard lock(inside().mutex);
    if (!inside().operations.empty()) broken("a device is disabled while a callback uses it");
  }
  inside().initialised = false;
  fake().force_output = false;
  ++fake().closed;
}

void hdBeginFrame(unsigned handle) {
  while (fake().hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (fake().frame_us > 0) std::this_thread::sleep_for(std::chrono::microseconds(fake().frame_us));
  if (std::this_thread::get_id() != inside().ticks_on) broken("a frame outside the scheduler");
  if (handle != kHandle || !inside().initialised) error(kBadHandle);
  if (inside().in_frame.exchange(true)) {
    error(kIllegalBegin);
    broken("a frame within a frame");
  }
  inside().commanded = {};
  if (fake().output_off.exchange(false)) fake().force_output = false;
  error(fake().begin_error);
}
void hdEndFrame(unsigned) {
  if (!inside().in_frame.exchange(false)) {
    error(kIllegalEnd);
    broken("a frame ends that did not begin");
  }
  error(fake().frame_error);
  const std::lock_guard lock(fake().mutex);
  if (!fake().loses_forces)
    fake().forces.push_back(fake().force_output ? inside().commanded : std::array<double, 3>{});
}

/// The newest first.
ErrorInfo hdGetError() {
  const std::lock_guard lock(inside().mutex);
  if (inside().errors.empty()) return {0, 0, kNoHandle};
  const unsigned code = inside().errors.back();
  inside().errors.pop_back();
  return {code, -1, kHandle};
}

void hdEnable(unsigned what) {
  if (what == 0x4000)
    fake().force_output = true;
  else if (what == 0x4001)
    fake().clamping = true;
  else
    error(kInvalidEnum);
}
void hdDisable(unsigned what) {
  if (what == 0x4000)
    fake().force_output = false;
  else
    error(kInvalidEnum);
}
unsigned char hdIsEnabled(unsigned what) {
  return what == 0x4000 ? fake().force_output.load() : fake().clamping.load();
}

void hdGetBooleanv(unsigned what, unsigned char* value) {
  in_frame("a switch is read outside a frame");
  if (!fake().knows_switches)
    error(kInvalidOperation);
  else if (what == 0x2001)
    *value = fake().safety_switch;
  else if (what == 0x2002)
    *value = fake().inkwell_switch;
  else
    error(kInvalidEnum);
}
void hdGetIntegerv(unsigned what, int* value) {
  switch (what) {
    case 0x2000:
      in_frame("buttons are read outside a frame");
      *value = fake().buttons;
      return;
    case 0x2553:
      *value = 6;
      return;
    case 0x2554:
      *value = 3;
      return;
    case 0x2555:
      *value = fake().styles;
      return;
    case 0x2600:
      *value = 1000;
      return;
    default:
      error(kInvalidEnum);
  }
}
void hdGetDoublev(unsigned what, double* values) {
  FakeHd& hd = fake();
  switch (what) {
    case 0x2050:
      in_frame("the position is read outside a frame");
      values[0] = hd.x;
      values[1] = hd.y;
      values[2] = std::getenv("FAKE_HD_PRESSES") ? pressed_z() : hd.z.load();
      return;
    case 0x2052:
      in_frame("the transform is read outside a frame");
      if (!hd.knows_rotation) return error(kInvalidOperation);
      for (size_t column = 0; column < 3; ++column) {
        for (size_t row = 0; row < 3; ++row) values[4 * column + row] = hd.axes[3 * column + row];
        values[4 * column + 3] = 0.0;
      }
      values[12] = hd.x;
      values[13] = hd.y;
      values[14] = hd.z;
      values[15] = 1.0;
      return;
    case 0x2053:
      in_frame("the velocity is read outside a frame");
      if (!hd.knows_rotation) return error(kInvalidOperation);
      for (size_t n = 0; n < 3; ++n) values[n] = hd.spin[n];
      return;
    case 0x2551: {
      constexpr double kBox[] = {-80.0, -50.0, -35.0, 80.0, 70.0, 35.0};
      std::memcpy(values, kBox, sizeof kBox);
      return;
    }
    case 0x2602:
      *values = hd.stiffness;
      return;
    case 0x2603:
      *values = hd.max_force;
      return;
    case 0x2604:
      *values = hd.continuous_force;
      return;
    case 0x2605:
      if (!hd.knows_temperatures) return error(kInvalidOperation);
      for (size_t n = 0; n < hd.temperatures.size(); ++n) values[n] = hd.temperatures[n];
      return;
    default:
      error(kInvalidEnum);
  }
}
const char* hdGetString(unsigned what) {
  if (what == 0x2501) return "Touch";
  if (what == 0x2503) return "3D Systems";
  error(kInvalidEnum);
  return nullptr;
}
void hdSetDoublev(unsigned what, const double* values) {
  in_frame("a force is set outside a frame");
  if (what == 0x2700)
    std::memcpy(inside().commanded.data(), values, sizeof inside().commanded);
  else
    error(kInvalidEnum);
}

unsigned hdCheckCalibration() {
  return fake().calibration;
}
void hdUpdateCalibration(unsigned style) {
  if (fake().calibration != 0x5001) broken("a calibration is updated that needs something else");
  if (!(unsigned(fake().styles) & style)) broken("a calibration in a style that it has not");
  fake().updated_style = int(style);
  ++fake().updates;
  fake().calibration = fake().calibration_after_update.load();
}

void hdStartScheduler() {
  if (fake().start_error != 0) return error(fake().start_error);
  if (fake().runs.exchange(true)) return broken("the scheduler is started twice");
  inside().scheduler = std::thread(run_scheduler);
}
void hdStopScheduler() {
  if (!fake().runs.exchange(false)) return broken("the scheduler is stopped and does not run");
  inside().scheduler.join();
}
void hdSetSchedulerRate(unsigned long hz) {
  if (hz != 500 && hz != 1000) error(0x0101);
}
unsigned long hdScheduleAsynchronous(unsigned (*callback)(void*), void* user, unsigned short) {
  if (fake().schedule_error != 0) {
    error(fake().schedule_error);
    return 0;
  }
  const std::lock_guard lock(inside().mutex);
  inside().operations.push_back({++inside().last_id, callback, user});
  return inside().last_id;
}
void hdUnschedule(unsigned long id) {
  const std::lock_guard lock(inside().mutex);
  if (std::erase_if(inside().operations, [&](const Operation& o) { return o.id == id; }) == 0)
    inside().errors.push_back(kInvalidOperation);
}
}
