#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "integration/devices/falcon.h"
#include "integration/devices/falcon_judge.h"
#include "integration/devices/falcon_link.h"
#include "integration/devices/usb_watch.h"
#include "integration/devices/wake.h"

namespace palpate::devices {

/// Both halves of a FalconDevice: the thread that makes a link ready, and the servo's use of it.
/// Who may touch the link and the judge is said by one atomic, user_.
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
  void look();
  DeviceFault try_open(usb::Context& context, const usb::Found& found);
  DeviceFault prepare(usb::Handle& handle, libusb_device* device);
  DeviceFault load(usb::Handle& handle, libusb_device* device);
  void close_link(bool reachable);

  const FalconOptions options_;
  const std::vector<uint8_t> firmware_;
  mutable std::mutex info_mutex_;  ///< never taken by exchange()
  std::string place_;

  std::unique_ptr<falcon::FalconLink> link_;
  falcon::FalconJudge judge_;
  usb::Problem broken_ = usb::Problem::kNone;  ///< what the servo handed the link over for
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

}  // namespace palpate::devices
