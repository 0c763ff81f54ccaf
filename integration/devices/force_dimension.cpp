#include "integration/devices/force_dimension.h"

#include <array>
#include <cstdlib>
#include <mutex>
#include <type_traits>
#include <vector>

#include "integration/files/shared_library.h"

namespace palpate::devices {
namespace {

// What functions return.
constexpr int kOk = 0, kTimeGuard = 1, kSaturated = 2;
// Places in the array of dhdGetStatus. Libraries have 15 to 17 of them; more room does no harm.
constexpr size_t kStatusPower = 0, kStatusReset = 3, kStatusForce = 5, kStatusBrake = 6,
                 kStatusError = 9, kStatusForceOffCause = 14;
using DhdStatus = std::array<int, 32>;
// Why the device itself switched its force off: a person did.
constexpr int kOffByButton = 1, kOffByDeadMan = 6;

// Errors, as dhdErrorGetLast numbers them.
enum ErrorCode : int {
  kCom = 2,
  kControllerBusy = 3,
  kNoDriver = 4,
  kNoDevice = 5,
  kTimeout = 7,
  kGeometry = 8,
  kNotReady = 12,
  kInvalidIndex = 15,
  kRedundantFail = 18,
  kNotEnabled = 19,
  kInUse = 20,
};

/// What a device of a type can do.
struct DeviceModel {
  int first, last;  ///< types, both included
  double force_n, stiffness_n_per_m, radius_m;
};
/// Of a wrist with motors: CHAI3D's limit for the delta.6.
constexpr double kWristTorque_n_m = 0.2;
// With CHAI3D's limits for each. Where it has none, the smallest of all.
constexpr DeviceModel kSmallest{0, 0, 8.0, 3000.0, 0.04};
constexpr std::array kModels{
    DeviceModel{33, 37, 12.0, 5000.0, 0.075},                      // omega
    DeviceModel{60, 60, 8.0, 3000.0, 0.04},                        // Falcon
    DeviceModel{63, 64, 20.0, kSmallest.stiffness_n_per_m, 0.15},  // delta
    DeviceModel{104, 105, 12.0, 4000.0, kSmallest.radius_m},       // sigma
    DeviceModel{108, 109, 12.0, 8000.0, 0.1125},                   // lambda
};

DeviceModel model_of(int type) {
  for (const DeviceModel& model : kModels)
    if (type >= model.first && type <= model.last) return model;
  return kSmallest;
}

// The library: x towards the user, y right, z up.
glm::dvec3 from_library(glm::dvec3 v) {
  return {v.y, v.z, v.x};
}
glm::dvec3 to_library(glm::dvec3 v) {
  return {v.z, v.x, v.y};
}

/// The functions that are used, with the library they come from, which stays loaded: a thread may
/// be waiting in it.
struct Library {
  int (*get_device_count)() = nullptr;
  int (*open_id)(char) = nullptr;
  int (*close)(char) = nullptr;
  int (*get_system_type)(char) = nullptr;
  const char* (*get_system_name)(char) = nullptr;
  int (*enable_force)(unsigned char, char) = nullptr;
  int (*get_position)(double*, double*, double*, char) = nullptr;
  int (*set_force)(double, double, double, char) = nullptr;
  unsigned (*get_button_mask)(char) = nullptr;
  int (*get_status)(int*, char) = nullptr;
  int (*error_get_last)() = nullptr;
  // Optional: not every version of the library has them.
  int (*set_gravity_compensation)(int, char) = nullptr;
  int (*set_max_force)(double, char) = nullptr;
  int (*set_brakes)(int, char) = nullptr;
  // With a wrist, with motors in it, and with a gripper: all of them or none.
  bool (*has_wrist)(char) = nullptr;
  bool (*has_active_wrist)(char) = nullptr;
  int (*set_force_and_torque)(double, double, double, double, double, double, char) = nullptr;
  int (*get_orientation)(double matrix[3][3], char) = nullptr;  ///< by rows
  int (*get_angular_velocity)(double*, double*, double*, char) = nullptr;
  bool (*has_gripper)(char) = nullptr;
  int (*get_gripper_angle)(double*, char) = nullptr;

  /// False if something that is needed is missing.
  bool load(const std::string& file) {
    files::SharedLibrary library(file);
    const auto find = [&](auto*& function, const char* name) {
      function =
          library.find<std::remove_pointer_t<std::remove_reference_t<decltype(function)>>>(name);
      return function != nullptr;
    };
    find(set_gravity_compensation, "dhdSetGravityCompensation");
    find(set_max_force, "dhdSetMaxForce");
    find(set_brakes, "dhdSetBrakes");
    if (!(find(has_wrist, "dhdHasWrist") && find(get_orientation, "dhdGetOrientationFrame") &&
          find(get_angular_velocity, "dhdGetAngularVelocityRad")))
      has_wrist = nullptr;
    if (!(find(has_active_wrist, "dhdHasActiveWrist") &&
          find(set_force_and_torque, "dhdSetForceAndTorque")))
      has_active_wrist = nullptr;
    if (!(find(has_gripper, "dhdHasGripper") && find(get_gripper_angle, "dhdGetGripperAngleRad")))
      has_gripper = nullptr;
    const bool all = find(get_device_count, "dhdGetDeviceCount") && find(open_id, "dhdOpenID") &&
                     find(close, "dhdClose") && find(get_system_type, "dhdGetSystemType") &&
                     find(get_system_name, "dhdGetSystemName") &&
                     find(enable_force, "dhdEnableForce") && find(get_position, "dhdGetPosition") &&
                     find(set_force, "dhdSetForce") && find(get_button_mask, "dhdGetButtonMask") &&
                     find(get_status, "dhdGetStatus") && find(error_get_last, "dhdErrorGetLast");
    if (!all) library.close();
    return all;
  }
};

std::vector<std::string> places_of_library(const std::string& file) {
  if (!file.empty()) return {file};
#ifdef _WIN32
  // Its installer puts them where Windows looks.
  return {"drd64.dll", "dhd64.dll"};
#else
  std::vector<std::string> folders;
  if (const char* sdk = std::getenv("FDSDK"))
    folders.push_back(std::string(sdk) + "/lib/release/lin-x86_64-gcc/");
  folders.emplace_back();  // where the loader looks
  if (const char* home = std::getenv("HOME")) folders.push_back(std::string(home) + "/.local/lib/");
  folders.emplace_back("/usr/local/lib/");
  std::vector<std::string> places;
  for (const std::string& folder : folders)
    for (const char* name : {"libdrd.so", "libdhd.so"}) places.push_back(folder + name);
  return places;
#endif
}

/// The library, loaded at the first call; null if there is none. Later calls look again.
const Library* library_of(const ForceDimensionOptions& options) {
  static std::mutex mutex;
  static std::vector<std::pair<std::string, Library>> loaded;
  const std::lock_guard lock(mutex);
  loaded.reserve(16);  // who has a pointer keeps it
  for (const std::string& place : places_of_library(options.library)) {
    for (const auto& [file, library] : loaded)
      if (file == place) return &library;
    Library library;
    if (loaded.size() == loaded.capacity() || !library.load(place)) continue;
    loaded.emplace_back(place, library);
    return &loaded.back().second;
  }
  return nullptr;
}

class ForceDimensionLink final : public DeviceLink {
 public:
  explicit ForceDimensionLink(const ForceDimensionOptions& options) : options_(options) {
    info_.kind = "force-dimension";
    info_.name = "Force Dimension device";
    tell(kSmallest);
  }

  DeviceFault open() override {
    library_ = library_of(options_);
    if (!library_) return DeviceFault::kNoLibrary;
    const int count = library_->get_device_count();
    if (count < 0) return force_dimension_fault(library_->error_get_last());
    DeviceFault reason = DeviceFault::kNotOpened;
    for (int index = 0; index < count && index < 64; ++index) {
      if (options_.index >= 0 && options_.index != index) continue;
      const DeviceFault fault = open_one(index);
      if (fault == DeviceFault::kNone) return fault;
      if (reason == DeviceFault::kNotOpened) reason = fault;
    }
    return reason;
  }

  DeviceInfo info() const override { return info_; }

  void set_torque(glm::dvec3 torque_n_m) override { torque_n_m_ = torque_n_m; }

  LinkAnswer exchange(glm::dvec3 force_n) override {
    LinkAnswer answer;
    const int sent = push(force_n, torque_n_m_);
    // Motors at their limit give a smaller force in the right direction.
    if (sent != kOk && sent != kTimeGuard && sent != kSaturated) heed_error(answer);
    glm::dvec3 p(0.0);
    const int got = library_->get_position(&p.x, &p.y, &p.z, id_);
    if (got == kOk) {
      answer.answered = true;
      answer.position_m = from_library(p);
    } else if (got != kTimeGuard) {  // the position of before is none
      heed_error(answer);
    }
    if (answer.lost) return answer;
    answer.buttons = library_->get_button_mask(id_);
    if (answer.answered) answer.grip = grip();
    DhdStatus status{};
    if (library_->get_status(status.data(), id_) != kOk) {
      heed_error(answer);
    } else if (answer.said == DeviceFault::kNone) {
      answer.said = fault_of(status);
      if (answer.said == DeviceFault::kForceOff) let_force_come_back(status, force_n);
    }
    return answer;
  }

  void close() noexcept override {
    push(glm::dvec3(0.0), glm::dvec3(0.0));
    library_->enable_force(0, id_);  // the brakes take hold where there are any
    library_->close(id_);
  }

 private:
  int push(glm::dvec3 force_n, glm::dvec3 torque_n_m) {
    const glm::dvec3 f = to_library(force_n), t = to_library(torque_n_m);
    return info_.max_torque_n_m > 0.0
               ? library_->set_force_and_torque(f.x, f.y, f.z, t.x, t.y, t.z, id_)
               : library_->set_force(f.x, f.y, f.z, id_);
  }

  DeviceFault open_one(int index) {
    const int id = library_->open_id(char(index));
    if (id < 0) return force_dimension_fault(library_->error_get_last());
    id_ = char(id);
    tell(model_of(library_->get_system_type(id_)));
    const char* name = library_->get_system_name(id_);
    info_.name = name && *name ? std::string("Force Dimension ") + name : "Force Dimension device";
    info_.address = std::to_string(index);
    has_wrist_ = library_->has_wrist && library_->has_wrist(id_);
    has_gripper_ = library_->has_gripper && library_->has_gripper(id_);
    info_.sensed_dof = has_wrist_ ? 6 : 3;
    const bool turns = has_wrist_ && library_->has_active_wrist && library_->has_active_wrist(id_);
    info_.max_torque_n_m = turns ? kWristTorque_n_m : 0.0;
    info_.actuated_dof = turns ? 6 : 3;
    const DeviceFault fault = make_ready();
    if (fault != DeviceFault::kNone) close();
    return fault;
  }

  /// How the grip is held. What the library refuses is not sensed: nothing is felt by it.
  GripReading grip() const {
    GripReading grip;
    double rows[3][3] = {};
    glm::dvec3 spin(0.0);
    if (has_wrist_ && library_->get_orientation(rows, id_) >= 0 &&
        library_->get_angular_velocity(&spin.x, &spin.y, &spin.z, id_) >= 0) {
      // Its columns are the grip's axes. At rest these are the library's, and so palpate's are,
      // too.
      const auto column = [&](int c) { return from_library({rows[0][c], rows[1][c], rows[2][c]}); };
      grip.device_from_grip = glm::quat_cast(glm::dmat3(column(1), column(2), column(0)));
      grip.angular_velocity_rad_per_s = from_library(spin);
      grip.turns = true;
    }
    grip.opens = has_gripper_ && library_->get_gripper_angle(&grip.opening_rad, id_) >= 0;
    return grip;
  }

  DeviceFault make_ready() {
    DhdStatus status{};
    if (library_->get_status(status.data(), id_) != kOk)
      return force_dimension_fault(library_->error_get_last());
    if (!status[kStatusPower] || status[kStatusError]) return DeviceFault::kStarting;
    if (!status[kStatusReset]) return DeviceFault::kNotHomed;
    if (library_->set_max_force) library_->set_max_force(info_.max_force_n, id_);
    // Compensation of the arm's weight; it works only while forces (zero too) are sent.
    if (library_->set_gravity_compensation) library_->set_gravity_compensation(1, id_);
    if (push(glm::dvec3(0.0), glm::dvec3(0.0)) < 0 || !release())
      return force_dimension_fault(library_->error_get_last());
    return DeviceFault::kNone;
  }

  /// Brakes off, force on.
  bool release() {
    if (library_->set_brakes) library_->set_brakes(0, id_);
    return library_->enable_force(1, id_) >= 0;
  }

  static DeviceFault fault_of(const DhdStatus& status) {
    if (!status[kStatusPower] || status[kStatusError]) return DeviceFault::kStarting;
    if (!status[kStatusReset]) return DeviceFault::kNotHomed;
    if (!status[kStatusForce] || status[kStatusBrake]) return DeviceFault::kForceOff;
    return DeviceFault::kNone;
  }

  /// Enables forces again that the device itself ended (too fast, its watchdog), once zero is asked
  /// for. What a person switched off, only a person switches on.
  void let_force_come_back(const DhdStatus& status, glm::dvec3 force_n) {
    const int cause = status[kStatusForceOffCause];
    const bool asks_for_none = force_n == glm::dvec3(0.0) && torque_n_m_ == glm::dvec3(0.0);
    if (cause != kOffByButton && cause != kOffByDeadMan && asks_for_none) release();
  }

  void heed_error(LinkAnswer& answer) {
    const int error = library_->error_get_last();
    answer.answered = false;
    // An error that may pass by itself counts as a missing answer.
    if (error == kTimeout || error == kControllerBusy) return;
    answer.said = force_dimension_fault(error);
    answer.lost = error == kCom || error == kNoDevice || error == kInvalidIndex;
  }

  void tell(const DeviceModel& model) {
    info_.max_force_n = model.force_n;
    info_.max_stiffness_n_per_m = model.stiffness_n_per_m;
    info_.workspace_radius_m = model.radius_m;
    info_.delay_s = 1e-3;  // a position is taken in one period of the servo loop, used in the next
    info_.buttons = 1;
  }

  const ForceDimensionOptions options_;
  const Library* library_ = nullptr;
  DeviceInfo info_;
  char id_ = -1;
  bool has_wrist_ = false, has_gripper_ = false;
  glm::dvec3 torque_n_m_{0.0};
};

}  // namespace

std::unique_ptr<DeviceLink> make_force_dimension_link(const ForceDimensionOptions& options) {
  return std::make_unique<ForceDimensionLink>(options);
}

bool force_dimension_library_is_there(const ForceDimensionOptions& options) {
  return library_of(options) != nullptr;
}

DeviceFault force_dimension_fault(int error) noexcept {
  switch (error) {
    case kNoDriver:
      return DeviceFault::kNoPermission;
    case kNoDevice:
    case kInvalidIndex:
      return DeviceFault::kUnplugged;
    case kTimeout:
      return DeviceFault::kTimeout;
    case kGeometry:
      return DeviceFault::kOutOfReach;
    case kNotReady:
      return DeviceFault::kStarting;
    case kRedundantFail:
      return DeviceFault::kGarbage;
    case kNotEnabled:
      return DeviceFault::kForceOff;
    case kInUse:
      return DeviceFault::kBusy;
    default:
      return DeviceFault::kTransfer;
  }
}

}  // namespace palpate::devices
