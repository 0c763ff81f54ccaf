#include "integration/devices/spacemouse.h"

#include <atomic>
#include <mutex>
#include <thread>

#include "integration/devices/spacemouse_protocol.h"
#include "integration/devices/usb_faults.h"
#include "integration/devices/usb_watch.h"
#include "integration/devices/wake.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

using usb::UsbProblem;

constexpr int kLookAgainMs = 500;
constexpr unsigned kReadMs = 50;  // also how long stopping may take
constexpr int kStalls = 3;        // in a row; then it is opened again

bool is_spacemouse(uint16_t vendor, uint16_t product) {
  return spacemouse::model_of(vendor, product) != nullptr;
}

// All six axes in one word, so that readers need no lock to see them together.
constexpr int kAxisBits = 10;
constexpr uint64_t kAxisMask = (1u << kAxisBits) - 1;
static_assert(spacemouse::kFull < 1 << (kAxisBits - 1) && 6 * kAxisBits <= 64);

uint64_t packed(const std::array<int, 6>& axes) noexcept {
  uint64_t word = 0;
  for (size_t a = 0; a < 6; ++a) word |= (uint64_t(axes[a]) & kAxisMask) << (kAxisBits * int(a));
  return word;
}

std::array<int, 6> unpacked(uint64_t word) noexcept {
  std::array<int, 6> axes;
  for (size_t a = 0; a < 6; ++a) {
    const auto bits = int(word >> (kAxisBits * int(a)) & kAxisMask);
    axes[a] = bits < 1 << (kAxisBits - 1) ? bits : bits - (1 << kAxisBits);
  }
  return axes;
}

}  // namespace

/// The thread, and what it leaves for readers.
class SpaceMouse::Listener {
 public:
  explicit Listener(const SpaceMouseOptions& options)
      : options_(options), thread_([this] { run(); }) {}
  ~Listener() {
    stop_ = true;
    wake_.wake();
    thread_.join();
  }

  DeviceInfo info() const {
    DeviceInfo info;
    info.kind = "spacemouse";
    const std::lock_guard lock(info_mutex_);
    info.name = name_;
    info.address = address_;
    info.sensed_dof = 6;
    info.actuated_dof = 0;
    return info;
  }

  SecondHandReading read() const noexcept {
    SecondHandReading reading;
    // In this order: the axes are at least as new as the time and the fault.
    reading.fault = fault_.load(std::memory_order_acquire);
    reading.time_ns = said_ns_.load(std::memory_order_acquire);
    reading.buttons = buttons_.load(std::memory_order_relaxed);
    if (reading.fault != DeviceFault::kNone ||
        monotonic_ns() - reading.time_ns > options_.silence_ns)
      return reading;
    const std::array<int, 6> axes = unpacked(axes_.load(std::memory_order_relaxed));
    const std::span<const int, 6> all(axes);
    reading.linear_m_per_s =
        spacemouse::speed(all.first<3>(), options_.dead_zone, options_.full_speed_m_per_s);
    reading.angular_rad_per_s =
        spacemouse::speed(all.last<3>(), options_.dead_zone, options_.full_turn_rad_per_s);
    return reading;
  }

  SpaceMouseCounts counts() const noexcept { return {reports_, rejected_, opened_}; }

 private:
  void run() {
    usb::Watch watch(usb::kAnyVendor);
    while (!stop_) {
      rest(search());
      if (!stop_) watch.sleep(wake_, kLookAgainMs);
    }
  }

  /// Opens the first that can be opened and listens until it is gone; why there is none now.
  DeviceFault search() {
    const usb::ContextPtr context = usb::make_context();
    DeviceFault reason = opened_ > 0 ? DeviceFault::kUnplugged : DeviceFault::kNotOpened;
    if (!context) return reason;
    bool first = true;
    for (const usb::BusDevice& found : usb::find(context.get(), is_spacemouse)) {
      if (!options_.address.empty() && options_.address != found.address) continue;
      const auto input = usb::hid_input(found.device.get());
      if (!input) continue;
      const usb::ClaimedDevice opened = usb::open(found.device.get(), input->interface);
      if (opened.problem == UsbProblem::kNone) {
        name(found);
        return fault_of(listen(opened.handle.get(), *input));
      }
      if (first) reason = fault_of(opened.problem);
      first = false;
    }
    return reason;
  }

  void name(const usb::BusDevice& found) {
    const std::lock_guard lock(info_mutex_);
    name_ = std::string("3Dconnexion ") + spacemouse::model_of(found.vendor, found.product)->name;
    address_ = found.address;
  }

  UsbProblem listen(libusb_device_handle* handle, const usb::HidInput& input) {
    spacemouse::Reports reports;
    opened_.fetch_add(1, std::memory_order_relaxed);
    fault_.store(DeviceFault::kNone, std::memory_order_release);
    for (int stalls = 0; !stop_;) {
      std::array<uint8_t, 64> report;
      int got = 0;
      const UsbProblem problem = usb::problem_of(libusb_interrupt_transfer(
          handle, input.endpoint, report.data(), int(report.size()), &got, kReadMs));
      // A report may come in while the wait for it is being called off.
      if (problem == UsbProblem::kNone || (problem == UsbProblem::kTimedOut && got > 0)) {
        stalls = 0;
        tell(reports, std::span<const uint8_t>(report).first(size_t(got)));
      } else if (problem == UsbProblem::kStalled && ++stalls <= kStalls) {
        libusb_clear_halt(handle, input.endpoint);
      } else if (problem != UsbProblem::kTimedOut) {
        return problem;
      }
    }
    return UsbProblem::kNone;
  }

  void tell(spacemouse::Reports& reports, std::span<const uint8_t> report) noexcept {
    const bool understood = reports.read(report);
    rejected_.store(reports.rejected(), std::memory_order_relaxed);
    if (!understood) return;
    axes_.store(packed(reports.axes()), std::memory_order_relaxed);
    buttons_.store(reports.buttons(), std::memory_order_relaxed);
    said_ns_.store(monotonic_ns(), std::memory_order_release);
    reports_.fetch_add(1, std::memory_order_relaxed);
  }

  void rest(DeviceFault fault) noexcept {
    if (fault == DeviceFault::kNone) fault = DeviceFault::kNotOpened;  // asked to stop
    fault_.store(fault, std::memory_order_release);
    axes_.store(0, std::memory_order_relaxed);
    buttons_.store(0, std::memory_order_relaxed);
  }

  const SpaceMouseOptions options_;
  mutable std::mutex info_mutex_;  ///< never taken by read()
  std::string name_ = "3Dconnexion SpaceMouse", address_;

  std::atomic<uint64_t> axes_ = 0;
  std::atomic<uint32_t> buttons_ = 0;
  std::atomic<int64_t> said_ns_ = 0;
  std::atomic<DeviceFault> fault_ = DeviceFault::kNotOpened;
  std::atomic<uint64_t> reports_ = 0, rejected_ = 0, opened_ = 0;

  std::atomic<bool> stop_ = false;
  Wake wake_;
  std::thread thread_;
};

SpaceMouse::SpaceMouse(const SpaceMouseOptions& options)
    : listener_(std::make_unique<Listener>(options)) {}

SpaceMouse::~SpaceMouse() = default;

DeviceInfo SpaceMouse::info() const {
  return listener_->info();
}

SecondHandReading SpaceMouse::read() const noexcept {
  return listener_->read();
}

SpaceMouseCounts SpaceMouse::counts() const noexcept {
  return listener_->counts();
}

}  // namespace palpate::devices
