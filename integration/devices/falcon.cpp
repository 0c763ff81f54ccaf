#include "integration/devices/falcon.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "integration/devices/falcon_judge.h"
#include "integration/devices/falcon_kinematics.h"
#include "integration/devices/falcon_link.h"
#include "integration/devices/usb_faults.h"
#include "integration/devices/usb_watch.h"
#include "integration/devices/wake.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

using falcon::FalconLink;
using usb::UsbProblem;

constexpr int kGuardMs = 10, kPollMs = 500;
constexpr int kFirmwareLadder = 10;
// The images that are known have 8 to 9 thousand bytes.
constexpr size_t kLargestImage = 1 << 20;

Result<std::vector<uint8_t>> read_firmware(const std::string& path) {
  if (path.empty()) return std::vector<uint8_t>();
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes(kLargestImage + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  bytes.resize(size_t(file.gcount()));
  if (bytes.empty())
    return Error{ErrorKind::kBadInput, path +
                                           " can not be read as firmware: it is not there, not "
                                           "readable or empty."};
  if (bytes.size() > kLargestImage)
    return Error{ErrorKind::kBadInput,
                 path + " is too large for a Falcon's firmware, which has about 8 kB."};
  return bytes;
}

bool is_falcon(uint16_t vendor, uint16_t product) {
  return vendor == falcon::kVendor && product == falcon::kProduct;
}

}  // namespace

/// Both halves of a FalconDevice: the thread that makes a link ready, and the servo's use of it.
/// One atomic, user_, says which of them may use the link and the judge.
class FalconDevice::Worker {
 public:
  Worker(FalconOptions options, std::vector<uint8_t> firmware);
  ~Worker();

  DeviceInfo info() const;
  DeviceReading exchange(const DeviceCommand& command) noexcept;
  FalconCounts counts() const noexcept;

 private:
  enum class User : int {
    kWorker,  ///< the link is not there, or being made or put right
    kNobody,  ///< ready: whoever comes first
    kServo,
  };

  // The servo's half.
  bool exchange_owned(const DeviceCommand& command) noexcept;
  falcon::Packet packet(const DeviceCommand& command, glm::dvec3& force_n) const noexcept;
  void cut() noexcept;
  DeviceReading last_;  ///< what the servo was told last

  // The thread's half.
  void run();
  void guard() noexcept;
  void take_link() noexcept;
  void give_link() noexcept;
  void mend();
  void search();
  DeviceFault try_open(usb::ContextPtr& context, const usb::BusDevice& found);
  DeviceFault prepare(usb::HandlePtr& handle, libusb_device* device);
  DeviceFault load(usb::HandlePtr& handle, libusb_device* device);
  void close_link(bool reachable);

  const FalconOptions options_;
  const std::vector<uint8_t> firmware_;
  mutable std::mutex info_mutex_;  ///< never taken by exchange()
  std::string address_;

  std::unique_ptr<falcon::FalconLink> link_;
  falcon::FalconJudge judge_;
  usb::UsbProblem broken_ = usb::UsbProblem::kNone;  ///< why the servo handed the link over
  std::atomic<User> user_ = User::kWorker;
  std::atomic<DeviceFault> absent_ = DeviceFault::kNotOpened;  ///< while there is no link to use
  std::atomic<int64_t> last_exchange_ns_ = 0;
  std::atomic<bool> pushing_ = false;  ///< the motors were told to make a force
  std::atomic<bool> was_cut_ = false;

  std::atomic<uint64_t> exchanges_ = 0, missed_ = 0, rejected_bytes_ = 0, opened_ = 0,
                        repaired_ = 0, cuts_ = 0, uploads_ = 0;
  std::atomic<bool> event_character_ = false;

  falcon::StopFlag stop_ = false;
  Wake wake_;
  std::thread thread_;
};

FalconDevice::Worker::Worker(FalconOptions options, std::vector<uint8_t> firmware)
    : options_(std::move(options)), firmware_(std::move(firmware)) {
  last_.position_m = falcon::kWorkspaceCentre;
  last_.fault = DeviceFault::kNotOpened;
  thread_ = std::thread([this] { run(); });
}

FalconDevice::Worker::~Worker() {
  stop_ = true;
  wake_.wake();
  thread_.join();
}

DeviceInfo FalconDevice::Worker::info() const {
  DeviceInfo info = falcon_info();
  const std::lock_guard lock(info_mutex_);
  info.address = address_;
  return info;
}

FalconCounts FalconDevice::Worker::counts() const noexcept {
  return {exchanges_, missed_, rejected_bytes_, opened_,
          repaired_,  cuts_,   uploads_,        event_character_};
}

// ---- the servo's half -------------------------------------------------------------------------

DeviceReading FalconDevice::Worker::exchange(const DeviceCommand& command) noexcept {
  last_exchange_ns_.store(monotonic_ns(), std::memory_order_relaxed);
  User ready = User::kNobody;
  if (!user_.compare_exchange_strong(ready, User::kServo, std::memory_order_acquire)) {
    last_.fault = absent_.load(std::memory_order_relaxed);
    last_.fresh = false;
    return last_;
  }
  const bool works = exchange_owned(command);
  user_.store(works ? User::kNobody : User::kWorker, std::memory_order_release);
  if (!works) wake_.wake();
  return last_;
}

/// False if the worker has to repair the link.
bool FalconDevice::Worker::exchange_owned(const DeviceCommand& command) noexcept {
  if (was_cut_.exchange(false, std::memory_order_acq_rel)) judge_.fail(DeviceFault::kTimeout);
  const bool trusted = judge_.fault() == DeviceFault::kNone;
  glm::dvec3 force_n(0.0);
  const falcon::Packet bytes = packet(command, force_n);
  pushing_.store(force_n != glm::dvec3(0.0), std::memory_order_relaxed);
  const FalconLink::FalconOutcome outcome = link_->exchange(bytes, options_.answer_wait_ns);
  exchanges_.fetch_add(1, std::memory_order_relaxed);
  if (!outcome.answered) missed_.fetch_add(1, std::memory_order_relaxed);
  rejected_bytes_.store(link_->rejected_bytes(), std::memory_order_relaxed);

  falcon::FalconJudge::FalconExchange seen{std::nullopt, outcome.garbage, monotonic_ns(), force_n};
  if (outcome.answered) seen.answer = link_->newest();
  last_ = judge_.judge(seen);
  if (outcome.problem != UsbProblem::kNone) {
    judge_.fail(fault_of(outcome.problem));
    last_ = judge_.frozen(judge_.fault());
  }
  if (trusted && last_.fault != DeviceFault::kNone) cut();
  broken_ = outcome.problem;
  if (outcome.problem == UsbProblem::kNone && !judge_.hopeless()) return true;
  absent_.store(last_.fault, std::memory_order_relaxed);
  return false;
}

falcon::Packet FalconDevice::Worker::packet(const DeviceCommand& command,
                                            glm::dvec3& force_n) const noexcept {
  falcon::FalconCommand out;
  out.homing = !judge_.homed();
  out.lights = !judge_.homed() ? falcon::kRed : command.in_contact ? falcon::kBlue : falcon::kGreen;
  if (judge_.fault() == DeviceFault::kNone) {
    const auto joints = falcon::inverse(judge_.position());
    const auto rows = joints ? falcon::jacobian(*joints) : std::nullopt;
    if (rows) {
      out.motors = falcon::motor_counts(*rows, command.force_n);
      force_n = falcon::force_of(*rows, out.motors);
    }
  }
  return falcon::encode(out);
}

/// At once, without waiting for the next exchange: there may be none.
void FalconDevice::Worker::cut() noexcept {
  link_->cut();
  pushing_.store(false, std::memory_order_relaxed);
}

// ---- the thread's half ------------------------------------------------------------------------

void FalconDevice::Worker::run() {
  usb::Watch watch(falcon::kVendor);
  while (!stop_) {
    if (!link_) {
      search();
      if (!link_ && !stop_) watch.sleep(wake_, kPollMs);
    } else if (user_.load(std::memory_order_acquire) == User::kWorker) {
      mend();
    } else {
      guard();
      watch.sleep(wake_, kGuardMs);
    }
  }
  if (!link_) return;
  take_link();
  close_link(true);
}

/// Cuts the force if the servo thread no longer calls: the device would keep its last force for
/// ever.
void FalconDevice::Worker::guard() noexcept {
  if (!pushing_.load(std::memory_order_relaxed)) return;
  if (monotonic_ns() - last_exchange_ns_.load(std::memory_order_relaxed) < options_.away_ns) return;
  // Counted before it is sent, so that the count is there when the force has ended.
  was_cut_.store(true, std::memory_order_release);
  cuts_.fetch_add(1, std::memory_order_release);
  cut();
}

void FalconDevice::Worker::take_link() noexcept {
  for (;;) {
    User now = User::kNobody;
    if (user_.compare_exchange_strong(now, User::kWorker, std::memory_order_acq_rel)) return;
    if (now == User::kWorker) return;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

void FalconDevice::Worker::give_link() noexcept {
  user_.store(User::kNobody, std::memory_order_release);
}

/// Repairs a link whose transfers failed: first by clearing halts, then by opening it again.
void FalconDevice::Worker::mend() {
  link_->retire();
  const bool reachable = broken_ != UsbProblem::kGone;
  if (reachable && broken_ != UsbProblem::kNone) {
    UsbProblem problem = falcon::clear_halts(link_->handle());
    if (problem == UsbProblem::kNone) problem = falcon::send_zero(link_->handle());
    if (problem == UsbProblem::kNone) problem = falcon::find_firmware(link_->handle(), stop_);
    if (problem == UsbProblem::kNone) {
      repaired_.fetch_add(1, std::memory_order_relaxed);
      give_link();
      return;
    }
    if (problem == UsbProblem::kGone) absent_ = DeviceFault::kUnplugged;
  }
  close_link(reachable);
}

void FalconDevice::Worker::search() {
  usb::ContextPtr context = usb::make_context();
  if (!context) return;
  DeviceFault reason = opened_ > 0 ? DeviceFault::kUnplugged : DeviceFault::kNotOpened;
  bool first = true;
  for (const usb::BusDevice& found : usb::find(context.get(), is_falcon)) {
    if (!options_.address.empty() && options_.address != found.address) continue;
    const DeviceFault fault = try_open(context, found);
    if (fault == DeviceFault::kNone || stop_) return;
    if (first) reason = fault;
    first = false;
  }
  absent_ = reason;
}

/// kNone: the link is made and given to the servo, and the context has gone with it.
DeviceFault FalconDevice::Worker::try_open(usb::ContextPtr& context, const usb::BusDevice& found) {
  usb::ClaimedDevice opened = usb::open(found.device.get(), 0);
  if (opened.problem != UsbProblem::kNone) return fault_of(opened.problem);
  // Others may have got the same id from the chip's maker. If the chip does not report its
  // name, go on.
  const std::string name = usb::product_name(opened.handle.get());
  if (!name.empty() && name != falcon::kProductName) return DeviceFault::kNotOpened;
  const DeviceFault fault = prepare(opened.handle, found.device.get());
  if (fault != DeviceFault::kNone) return fault;
  falcon::send_zero(opened.handle.get());
  auto link = std::make_unique<FalconLink>(std::move(context), std::move(opened.handle));
  if (!link->usable()) return DeviceFault::kTransfer;
  link_ = std::move(link);
  {
    const std::lock_guard lock(info_mutex_);
    address_ = found.address;
  }
  judge_.restart();
  was_cut_ = false;
  opened_.fetch_add(1, std::memory_order_relaxed);
  give_link();
  return DeviceFault::kNone;
}

DeviceFault FalconDevice::Worker::prepare(usb::HandlePtr& handle, libusb_device* device) {
  // While the link is repaired after a fault, that fault remains the better explanation.
  if (absent_ == DeviceFault::kNotOpened || absent_ == DeviceFault::kUnplugged ||
      absent_ == DeviceFault::kBusy || absent_ == DeviceFault::kNoPermission)
    absent_ = DeviceFault::kStarting;
  const falcon::Settings settings = falcon::set_up(handle.get());
  if (settings.problem != UsbProblem::kNone) return fault_of(settings.problem);
  event_character_ = settings.event_character;
  const UsbProblem problem = falcon::find_firmware(handle.get(), stop_);
  if (problem != UsbProblem::kTimedOut) return fault_of(problem);
  if (firmware_.empty()) return DeviceFault::kNoFirmware;
  return load(handle, device);
}

/// Loading often fails the first few times on real devices; each try starts from a closed one.
DeviceFault FalconDevice::Worker::load(usb::HandlePtr& handle, libusb_device* device) {
  absent_ = DeviceFault::kStarting;
  for (int n = 0; n < kFirmwareLadder && !stop_; ++n) {
    uploads_.fetch_add(1, std::memory_order_relaxed);
    UsbProblem problem = falcon::load_firmware(handle.get(), firmware_, stop_);
    if (problem == UsbProblem::kNone) {
      const falcon::Settings settings = falcon::set_up(handle.get());
      event_character_ = settings.event_character;
      problem = settings.problem;
    }
    if (problem == UsbProblem::kNone) problem = falcon::find_firmware(handle.get(), stop_);
    if (problem == UsbProblem::kNone || problem == UsbProblem::kGone) return fault_of(problem);
    handle.reset();
    usb::ClaimedDevice again = usb::open(device, 0);
    if (again.problem != UsbProblem::kNone) return fault_of(again.problem);
    handle = std::move(again.handle);
  }
  return DeviceFault::kNoFirmware;
}

void FalconDevice::Worker::close_link(bool reachable) {
  link_->retire();
  if (reachable) falcon::send_zero(link_->handle());
  link_.reset();
}

// ---- the device -------------------------------------------------------------------------------

DeviceInfo falcon_info() {
  DeviceInfo info;
  info.kind = "falcon";
  info.name = "Novint Falcon";
  info.max_force_n = falcon::kForceEverywhere;
  // Its maker states nothing. Small motors with their peak force for minutes are not tried here.
  info.continuous_force_n = falcon::kForceEverywhere / 3.0;
  info.max_stiffness_n_per_m = 3000.0;  // what CHAI3D gives it with
  info.workspace_centre_m = falcon::kWorkspaceCentre;
  info.workspace_radius_m = falcon::kWorkspaceRadius;
  info.resolution_m = falcon::kResolutionAtCentre;
  info.buttons = 4;
  return info;
}

bool FalconDevice::is_plugged_in() {
  const usb::ContextPtr context = usb::make_context();
  return context && !usb::find(context.get(), is_falcon).empty();
}

Result<std::unique_ptr<FalconDevice>> FalconDevice::make(const FalconOptions& options) {
  auto firmware = read_firmware(options.firmware_file);
  if (!firmware) return firmware.error();
  return std::unique_ptr<FalconDevice>(
      new FalconDevice(std::make_unique<Worker>(options, std::move(*firmware))));
}

FalconDevice::FalconDevice(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}

FalconDevice::~FalconDevice() = default;

DeviceInfo FalconDevice::info() const {
  return worker_->info();
}

DeviceReading FalconDevice::exchange(const DeviceCommand& command) noexcept {
  return worker_->exchange(command);
}

FalconCounts FalconDevice::counts() const noexcept {
  return worker_->counts();
}

}  // namespace palpate::devices
