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

/// The bus of emulated devices: /sys, /dev and uevents, which umockdev replaces for this process.
/// So the real libusb finds the devices and exchanges data with them. One for the whole process.
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

/// The descriptors of a device.
struct Descriptors {
  uint16_t vendor = 0, product = 0;
  std::string product_name;
  uint8_t interface_class = 0xff;
  /// Out 0: there is none.
  uint8_t in_endpoint = 0x81, out_endpoint = 0x02;
  bool interrupt = false;  ///< else bulk
  uint8_t packet_bytes = 64;
};

/// A transfer as the kernel stores it. The caller's memory is used during submit and reap only, as
/// the kernel does; never in between, when it may be freed.
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
/// classes are the devices themselves. All virtual functions are called under the lock.
class EmulatedDevice {
 public:
  explicit EmulatedDevice(Descriptors descriptors, int port);
  virtual ~EmulatedDevice();
  EmulatedDevice(const EmulatedDevice&) = delete;
  EmulatedDevice& operator=(const EmulatedDevice&) = delete;

  void plug();
  /// Transfers in flight end as when the cable is pulled.
  void unplug();
  /// Whether this user may open it.
  void permit(bool allowed);
  /// A kernel driver that has claimed the interface.
  void bind_kernel_driver(const std::string& name);
  std::string kernel_driver() const;
  /// Another program has claimed it.
  void claim_elsewhere(bool claimed);
  std::string place() const { return "usb 1-" + std::to_string(port_); }
  int resets_of_halts() const;

 protected:
  using Lock = std::unique_lock<std::mutex>;
  /// Returns 0, or a negative errno. `in` is the data of a read.
  virtual int control(uint8_t type, uint8_t request, uint16_t value, const Bytes& out, Bytes& in);
  /// Bytes for an OUT endpoint: 0, a negative errno, or kNever to leave it without an answer.
  virtual int take(const Bytes& bytes) = 0;
  /// Completes the reads that it can; returns the time at which to call it again.
  virtual int64_t serve(int64_t now_ns) = 0;
  virtual void cleared_halt(uint8_t endpoint) = 0;
  virtual void plugged() {}
  static constexpr int kNever = 1;
  static constexpr int64_t kNoTime = INT64_MAX;

  std::deque<Urb>& waiting() { return waiting_; }
  /// Ends the oldest waiting read with these bytes.
  void complete_read(int status, Bytes bytes);
  /// Calls serve() again.
  void changed();
  /// The destructors of derived classes must call this: after it no virtual function is called.
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
  /// Of earlier plugs: a program that still has such a node open goes on with requests and gets
  /// ENODEV.
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
