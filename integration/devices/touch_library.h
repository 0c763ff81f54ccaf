#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "module/haptics/device.h"

/// The library below a Touch: HD, the lower half of OpenHaptics 3, as public programs and bindings
/// use it. Names and numbers are from there; neither its headers nor its reference were at hand.
namespace palpate::devices::hd {

// Types of its functions, on Linux with 64 bits.
using HdHandle = unsigned;
using HdCallback = unsigned (*)(void* user);

/// What its function hdGetError returns.
struct HdError {
  unsigned code;
  int internal_code;
  HdHandle device;
};

inline constexpr HdHandle kNoDevice = 0xffffffff;
inline constexpr unsigned kCallbackDone = 0, kCallbackContinue = 1;
inline constexpr unsigned short kFirstInTick = 0xffff;  ///< the highest priority of a callback

/// What can be asked for.
enum HdQuery : unsigned {
  kButtons = 0x2000,
  kSafetySwitch = 0x2001,
  kInkwellSwitch = 0x2002,
  kPosition = 0x2050,
  kTransform = 0x2052,  ///< of the pen's end, 16 numbers by columns
  kAngularVelocity = 0x2053,
  kModel = 0x2501,
  kVendor = 0x2503,
  kWorkspace = 0x2551,  ///< usable: the least x, y, z, then the most
  kInputDof = 0x2553,
  kOutputDof = 0x2554,
  kCalibrationStyles = 0x2555,
  kUpdateRate = 0x2600,
  kMaxStiffness = 0x2602,
  kMaxForce = 0x2603,
  kMaxContinuousForce = 0x2604,
  kMotorTemperatures = 0x2605,  ///< 0 is coldest, 1 is warmest
  kForce = 0x2700,
};

/// What can be switched on and off.
enum HdSwitch : unsigned { kForceOutput = 0x4000, kForceClamping = 0x4001 };

enum HdCalibration : unsigned {
  kCalibrated = 0x5000,
  kNeedsUpdate = 0x5001,
  kNeedsManualInput = 0x5002,
};

/// Bits of kCalibrationStyles.
enum HdCalibrationStyle : int { kEncoderReset = 1, kAutomatic = 2, kInkwell = 4 };

enum HdErrorCode : unsigned {
  kSuccess = 0x0000,
  kBadHandle = 0x0104,
  kWarmMotors = 0x0200,
  kExceededMaxForce = 0x0201,
  kExceededMaxForceImpulse = 0x0202,
  kExceededMaxVelocity = 0x0203,
  kForceError = 0x0204,
  kDeviceBroken = 0x0300,
  kAlreadyInitiated = 0x0301,
  kCommunication = 0x0302,
  kConfiguration = 0x0303,
  kTimer = 0x0304,
  kInvalidLicence = 0x0600,
};

/// What an error means here.
struct HdVerdict {
  DeviceFault fault = DeviceFault::kNone;
  bool positions = true;  ///< the frame's position is good all the same
  bool lost = false;      ///< the device has to be opened again
};
HdVerdict verdict_of(unsigned code) noexcept;
/// The one that says more about what is wrong; of equals the first.
HdVerdict worse(const HdVerdict& first, const HdVerdict& second) noexcept;

/// The functions that are used, with the library they come from, which stays loaded: its thread may
/// be in it. Gets and sets are for the current device: the one that began a frame last.
struct HdLibrary {
  HdHandle (*init_device)(const char* configuration) = nullptr;
  void (*disable_device)(HdHandle) = nullptr;
  void (*begin_frame)(HdHandle) = nullptr;
  void (*end_frame)(HdHandle) = nullptr;
  HdError (*get_error)() = nullptr;
  void (*enable)(unsigned) = nullptr;
  void (*disable)(unsigned) = nullptr;
  unsigned char (*is_enabled)(unsigned) = nullptr;
  void (*get_booleans)(unsigned, unsigned char*) = nullptr;
  void (*get_integers)(unsigned, int*) = nullptr;
  void (*get_doubles)(unsigned, double*) = nullptr;
  const char* (*get_string)(unsigned) = nullptr;
  void (*set_doubles)(unsigned, const double*) = nullptr;
  unsigned (*check_calibration)() = nullptr;
  void (*update_calibration)(unsigned style) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  void (*set_scheduler_rate)(unsigned long hz) = nullptr;
  unsigned long (*schedule)(HdCallback, void* user, unsigned short priority) = nullptr;
  void (*unschedule)(unsigned long operation) = nullptr;

  /// False if there is no such file, or something in it is missing.
  bool load(const std::string& file);
  /// The worst of the errors since the last call, which are forgotten.
  HdVerdict take_errors() const noexcept;
};

/// The scheduler of a library: one thread for all of its devices. It runs while there are any.
class HdScheduler {
 public:
  explicit HdScheduler(const HdLibrary& library) : library_(library) {}

  /// Has `callback` run 1,000 times a second until it returns kCallbackDone. The fault if it can
  /// not.
  DeviceFault add(HdCallback callback, void* user, unsigned long& operation);
  /// Ends it, if it has not ended by itself. `user` lives on until no callback can run any more.
  void remove(unsigned long operation, bool has_ended, std::shared_ptr<void> user) noexcept;

 private:
  const HdLibrary& library_;
  std::mutex mutex_;
  int running_ = 0;
  std::vector<std::shared_ptr<void>> removed_;
};

/// A library that was loaded, with its scheduler.
struct LoadedHd {
  HdLibrary functions;
  HdScheduler scheduler{functions};
};

/// The library in that file, or if the name is empty in the places where it usually is; loaded at
/// the first call. Null if there is none with all that is needed. Later calls look again.
LoadedHd* loaded_hd(const std::string& file);

}  // namespace palpate::devices::hd
