#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace palpate::devices::test {

using Bytes = std::vector<uint8_t>;

/// The bus on which emulated devices live: /sys, /dev and uevents as umockdev shows them to this
/// process, so that the real libusb finds the devices and talks to them. One for the whole process.
class EmulatedBus {
 public:
  static EmulatedBus& get();
  UMockdevTestbed* testbed() const { return testbed_; }
  std::string root() const;
  int next_address() { return ++address_; }

 private:
  EmulatedBus();
  UMockdevTestbed* testbed_;
  int address_ = 1;
};

/// What a device says of itself.
struct Descriptors {
  uint16_t vendor = 0, product = 0;
  std::string product_name;
  uint8_t interface_class = 0xff;
  uint8_t in_endpoint = 0x81, out_endpoint = 0x02;  ///< out 0: none
  bool interrupt = false;                           ///< else bulk
  uint8_t packet_bytes = 64;
};

/// A transfer as the kernel would hold it. The caller's memory is touched while it submits and
/// while it reaps, as the kernel does it; never between, when it may be gone.
struct Urb {
  UMockdevIoctlClient* client = nullptr;
  usbdevfs_urb* user = nullptr;
  uint8_t type = 0, endpoint = 0;
  size_t length = 0;
  Bytes out;  ///< what the host sent
  Bytes in;   ///< what the device sends
  int status = 0;
};

/// A device below libusb: answers usbfs requests as the kernel and the device would. Derived
/// classes are the devices themselves. All virtual functions run under the lock.
class EmulatedDevice {
 public:
  explicit EmulatedDevice(Descriptors descriptors, int port);
  virtual ~EmulatedDevice();
  EmulatedDevice(const EmulatedDevice&) = delete;
  EmulatedDevice& operator=(const EmulatedDevice&) = delete;

  void plug();
  /// What is in flight ends as when a cable is pulled.
  void unplug();
  /// Whether this user may open it.
  void permit(bool allowed);
  /// A driver of the kernel that holds the interface.
  void bind_kernel_driver(const std::string& name);
  std::string kernel_driver() const;
  /// Another program has claimed it.
  void claim_elsewhere(bool claimed);
  std::string place() const { return "usb 1-" + std::to_string(port_); }
  int resets_of_halts() const;

 protected:
  using Lock = std::unique_lock<std::mutex>;
  /// 0, or a negative errno. `in` is what a read gives.
  virtual int control(uint8_t type, uint8_t request, uint16_t value, const Bytes& out, Bytes& in);
  /// Bytes for an OUT endpoint: 0, a negative errno, or kNever to leave it without an answer.
  virtual int take(const Bytes& bytes) = 0;
  /// Completes what reads it can; returns the time at which it wants to be called again.
  virtual int64_t serve(int64_t now_ns) = 0;
  virtual void cleared_halt(uint8_t endpoint) = 0;
  virtual void plugged() {}
  static constexpr int kNever = 1;
  static constexpr int64_t kNoTime = INT64_MAX;

  std::deque<Urb>& waiting() { return waiting_; }
  /// Ends the oldest waiting read with these bytes.
  void complete_read(int status, Bytes bytes);
  void changed();  ///< serve() again
  /// To be called by the destructors of derived classes: their virtual functions end there.
  void stop();

  mutable std::mutex mutex_;

 private:
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  static void on_vanished(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  gboolean ioctl(UMockdevIoctlClient* client);
  void submit(UMockdevIoctlClient* client, usbdevfs_urb* user);
  void submit_control(Urb urb);
  void reap(UMockdevIoctlClient* client, void** user, bool here);
  int discard(UMockdevIoctlClient* client, usbdevfs_urb* user);
  int claim(UMockdevIoctlClient* client);
  int driver_ioctl(const usbdevfs_ioctl& request);
  void finish(Urb urb, int status);
  void show_ready();
  void run();
  std::string node() const;

  const Descriptors descriptors_;
  const int port_;
  int address_ = 0;
  UMockdevIoctlBase* handler_ = nullptr;
  /// Of former plugs: who still has such a node open goes on asking and is told that it is gone.
  std::vector<std::pair<std::string, UMockdevIoctlBase*>> old_handlers_;
  int ready_file_ = -1;
  bool ready_ = true;
  bool present_ = false, claimed_elsewhere_ = false;
  UMockdevIoctlClient* owner_ = nullptr;
  std::string driver_, detached_driver_;
  int halts_cleared_ = 0;
  std::deque<Urb> waiting_, finished_;

  std::condition_variable changed_;
  int64_t due_ns_ = kNoTime;
  bool stopping_ = false;
  std::thread thread_;
};

int64_t monotonic_ns();

}  // namespace palpate::devices::test
