#pragma once

#include <cstdint>
#include <memory>
#include <thread>

#include "integration/devices/device_link.h"
#include "module/haptics/device.h"

namespace palpate::devices {

struct MailboxOptions {
  /// The force is cut after so long without an exchange.
  int64_t away_ns = 20'000'000;
  /// It is a fault if the device's thread has not responded for so long: it waits in a call that
  /// does not return.
  int64_t silence_ns = 20'000'000;
  /// The thread's priority in SCHED_FIFO, where the system grants it; 0: not asked for.
  int priority = 79;
};

/// What happened, since the object was made.
struct MailboxCounts {
  uint64_t served = 0;     ///< commands of the servo thread that have been dealt with
  uint64_t exchanges = 0;  ///< with the device
  uint64_t missed = 0;     ///< of those, without an answer in time
  uint64_t opened = 0;     ///< times the device became ready
  uint64_t cuts = 0;       ///< times the force was cut because the servo thread did not call
};

/// A ForceDevice of a DeviceLink: a thread of its own finds, opens, exchanges and opens again; the
/// servo's exchange() puts the force into one mailbox and takes the newest reading from another. So
/// a position is as old as the last exchange with the device, about a period of the servo loop.
///
/// Force reaches the device only while its answers are trusted (AnswerJudge) and the servo thread
/// has been told so. With any fault, the device is told zero at once, before the servo thread gets
/// to know. If exchange() is not called for away_ns while there is a force, it is cut.
class MailboxDevice final : public ForceDevice {
 public:
  explicit MailboxDevice(std::unique_ptr<DeviceLink> link, const MailboxOptions& options = {});
  /// Force zero and closed, within two seconds. If the link is in a call that does not return, its
  /// thread is left waiting in it, since nothing can end that call.
  ~MailboxDevice() override;

  DeviceInfo info() const override;
  /// Real-time safe: no lock, no allocation, one system call that wakes the thread.
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

  /// Any thread.
  MailboxCounts counts() const noexcept;

 private:
  class Worker;
  std::shared_ptr<Worker> worker_;  ///< shared with a thread that may be left behind
  std::thread thread_;
  DeviceReading last_;  ///< what the servo was told last
};

}  // namespace palpate::devices
