#include "integration/devices/touch_library.h"

#include <cstdlib>
#include <type_traits>
#include <utility>

#include "integration/files/shared_library.h"

namespace palpate::devices::hd {
namespace {

constexpr unsigned long kRate_hz = 1000;
// The stack of errors has no stated depth; a library that never runs out of them ends here.
constexpr int kMostErrors = 64;

std::vector<std::string> places_of_hd(const std::string& file) {
  if (!file.empty()) return {file};
#ifdef _WIN32
  // Its installer puts it where Windows looks.
  return {"hd.dll"};
#else
  std::vector<std::string> places;
  if (const char* sdk = std::getenv("OH_SDK_BASE"))
    for (const char* folder : {"/lib/", "/lib64/"}) places.push_back(sdk + std::string(folder));
  places.emplace_back();  // where the loader looks
  if (const char* home = std::getenv("HOME")) places.push_back(std::string(home) + "/.local/lib/");
  places.emplace_back("/usr/local/lib/");
  for (std::string& place : places) place += "libHD.so";
  return places;
#endif
}

int weight_of(const HdVerdict& verdict) noexcept {
  if (verdict.fault == DeviceFault::kNone) return 0;
  return 1 + (verdict.positions ? 0 : 1) + (verdict.lost ? 2 : 0);
}

}  // namespace

HdVerdict worse(const HdVerdict& first, const HdVerdict& second) noexcept {
  return weight_of(second) > weight_of(first) ? second : first;
}

HdVerdict verdict_of(unsigned code) noexcept {
  switch (code) {
    case kSuccess:
      return {};
    case kWarmMotors:
      return {.fault = DeviceFault::kHot};
    // The library has ended the force by itself, and ramps it up again by itself.
    case kExceededMaxForce:
    case kExceededMaxForceImpulse:
    case kExceededMaxVelocity:
    case kForceError:
      return {.fault = DeviceFault::kForceOff};
    case kBadHandle:
    case kDeviceBroken:
      return {.fault = DeviceFault::kUnplugged, .positions = false, .lost = true};
    case kAlreadyInitiated:
      return {.fault = DeviceFault::kBusy, .positions = false};
    case kTimer:
      return {.fault = DeviceFault::kTimeout, .positions = false};
    case kInvalidLicence:
      return {.fault = DeviceFault::kNoPermission, .positions = false};
    default:
      return {.fault = DeviceFault::kTransfer, .positions = false};
  }
}

bool HdLibrary::load(const std::string& file) {
  files::SharedLibrary library(file);
  const auto find = [&](auto*& function, const char* name) {
    function =
        library.find<std::remove_pointer_t<std::remove_reference_t<decltype(function)>>>(name);
    return function != nullptr;
  };
  const bool all =
      find(init_device, "hdInitDevice") && find(disable_device, "hdDisableDevice") &&
      find(begin_frame, "hdBeginFrame") && find(end_frame, "hdEndFrame") &&
      find(get_error, "hdGetError") && find(enable, "hdEnable") && find(disable, "hdDisable") &&
      find(is_enabled, "hdIsEnabled") && find(get_booleans, "hdGetBooleanv") &&
      find(get_integers, "hdGetIntegerv") && find(get_doubles, "hdGetDoublev") &&
      find(get_string, "hdGetString") && find(set_doubles, "hdSetDoublev") &&
      find(check_calibration, "hdCheckCalibration") &&
      find(update_calibration, "hdUpdateCalibration") &&
      find(start_scheduler, "hdStartScheduler") && find(stop_scheduler, "hdStopScheduler") &&
      find(set_scheduler_rate, "hdSetSchedulerRate") && find(schedule, "hdScheduleAsynchronous") &&
      find(unschedule, "hdUnschedule");
  if (!all) library.close();
  return all;
}

HdVerdict HdLibrary::take_errors() const noexcept {
  HdVerdict worst;
  for (int n = 0; n < kMostErrors; ++n) {
    const HdVerdict next = verdict_of(get_error().code);
    if (next.fault == DeviceFault::kNone) break;
    worst = worse(worst, next);
  }
  return worst;
}

DeviceFault HdScheduler::add(HdCallback callback, void* user, unsigned long& operation) {
  const std::lock_guard lock(mutex_);
  operation = library_.schedule(callback, user, kFirstInTick);
  DeviceFault fault = library_.take_errors().fault;
  if (fault != DeviceFault::kNone) return fault;
  if (running_++ > 0) return DeviceFault::kNone;
  // A library that can not run at this rate keeps its own.
  library_.set_scheduler_rate(kRate_hz);
  library_.take_errors();
  library_.start_scheduler();
  fault = library_.take_errors().fault;
  if (fault == DeviceFault::kNone) return fault;
  --running_;
  library_.unschedule(operation);
  library_.take_errors();
  return fault;
}

void HdScheduler::remove(unsigned long operation, bool has_ended,
                         std::shared_ptr<void> user) noexcept {
  const std::lock_guard lock(mutex_);
  removed_.push_back(std::move(user));
  if (!has_ended) library_.unschedule(operation);
  if (--running_ == 0) {
    library_.stop_scheduler();
    removed_.clear();
  }
  library_.take_errors();
}

LoadedHd* loaded_hd(const std::string& file) {
  static std::mutex mutex;
  static std::vector<std::pair<std::string, std::unique_ptr<LoadedHd>>> all;
  const std::lock_guard lock(mutex);
  for (const std::string& place : places_of_hd(file)) {
    for (const auto& [known, loaded] : all)
      if (known == place) return loaded.get();
    auto fresh = std::make_unique<LoadedHd>();
    if (!fresh->functions.load(place)) continue;
    all.emplace_back(place, std::move(fresh));
    return all.back().second.get();
  }
  return nullptr;
}

}  // namespace palpate::devices::hd
