// A library with the functions of Force Dimension's that palpate calls, as their documents describe
// them, written independently of the code under test. With FAKE_DHD_PRESSES set, the grip moves
// back and forth along the user's line of sight by itself, and yields to the force.
#include "tests/devices/fake_dhd.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

using palpate::devices::test::FakeDhd;

namespace {

constexpr int kPower = 0, kConnected = 1, kReset = 3, kForce = 5, kBrake = 6, kOffCause = 14;
constexpr int kTooFast = 2;

FakeDhd& fake() {
  static FakeDhd* made = [] {
    auto* dhd = new FakeDhd;
    dhd->status[kPower] = dhd->status[kConnected] = dhd->status[kReset] = 1;
    dhd->status[kBrake] = 1;
    return dhd;
  }();
  return *made;
}

/// Back and forth once in two seconds.
double pressed_x() {
  const double t =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  return 0.0375 + 0.0325 * std::cos(3.14159265 * t);
}

}  // namespace

extern "C" {

FakeDhd* fake_dhd() {
  return &fake();
}

int dhdGetDeviceCount() {
  return fake().devices;
}
int dhdOpenID(char index) {
  if (fake().open_returns < 0 || index >= fake().devices) return -1;
  ++fake().opened;
  return index;
}
int dhdClose(char) {
  ++fake().closed;
  return 0;
}
int dhdGetSystemType(char) {
  return fake().type;
}
const char* dhdGetSystemName(char) {
  return "omega.3";
}
int dhdEnableForce(unsigned char on, char) {
  fake().force_enabled = on;
  fake().status[kForce] = on;
  fake().status[kBrake] = !on;
  if (on) fake().status[kOffCause] = 0;
  return 0;
}
int dhdGetPosition(double* x, double* y, double* z, char) {
  FakeDhd& dhd = fake();
  *x = std::getenv("FAKE_DHD_PRESSES") ? pressed_x() : dhd.x.load();
  *y = dhd.y;
  *z = dhd.z;
  if (dhd.position_skips > 0) {
    --dhd.position_skips;
    return 1;
  }
  return dhd.position_returns;
}
int dhdSetForce(double fx, double fy, double fz, char) {
  FakeDhd& dhd = fake();
  while (dhd.hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (dhd.brakes_by_itself && dhd.status[kForce]) {
    dhd.status[kForce] = 0;
    dhd.status[kBrake] = 1;
    dhd.status[kOffCause] = kTooFast;
  }
  const std::lock_guard lock(dhd.mutex);
  if (dhd.force_returns >= 0) dhd.forces.push_back({fx, fy, fz});
  return dhd.force_returns;
}
int dhdSetForceAndTorque(double fx, double fy, double fz, double tx, double ty, double tz,
                         char id) {
  const int returns = dhdSetForce(fx, fy, fz, id);
  const std::lock_guard lock(fake().mutex);
  if (returns >= 0) fake().torques.push_back({tx, ty, tz});
  return returns;
}
bool dhdHasActiveWrist(char) {
  return fake().has_active_wrist;
}
unsigned dhdGetButtonMask(char) {
  return fake().buttons;
}
int dhdGetStatus(int status[], char) {
  for (size_t n = 0; n < fake().status.size(); ++n) status[n] = fake().status[n];
  return fake().status_returns;
}
int dhdErrorGetLast() {
  return fake().error;
}
bool dhdHasWrist(char) {
  return fake().has_wrist;
}
int dhdGetOrientationFrame(double matrix[3][3], char) {
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column)
      matrix[row][column] = fake().orientation[3 * row + column];
  return fake().wrist_returns;
}
int dhdGetAngularVelocityRad(double* wx, double* wy, double* wz, char) {
  *wx = fake().spin[0];
  *wy = fake().spin[1];
  *wz = fake().spin[2];
  return fake().wrist_returns;
}
bool dhdHasGripper(char) {
  return fake().has_gripper;
}
int dhdGetGripperAngleRad(double* angle, char) {
  *angle = fake().gripper;
  return fake().gripper_returns;
}
int dhdSetGravityCompensation(int on, char) {
  fake().gravity = on;
  return 0;
}
int dhdSetMaxForce(double force, char) {
  fake().max_force = force;
  return 0;
}
int dhdSetBrakes(int on, char) {
  fake().status[kBrake] = on;
  return 0;
}
}
