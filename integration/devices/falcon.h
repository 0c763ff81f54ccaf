#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "compute/volume/result.h"
#include "module/haptics/device.h"

namespace palpate::devices {

struct FalconOptions {
  /// The user's own firmware image; empty: none. palpate has none to give.
  std::string firmware_file;
  /// Only the device that is plugged in at this address ("usb 1-2"); empty: the first that can be
  /// opened.
  std::string address;
  /// How long exchange() waits for an answer. Longer only for tests on machines that are busy.
  int64_t answer_wait_ns = 1'000'000;
  /// The force is cut after so long without an exchange.
  int64_t away_ns = 20'000'000;
};

/// What happened on the wire, since the object was made.
struct FalconCounts {
  uint64_t exchanges = 0;        ///< commands sent and waited for
  uint64_t missed = 0;           ///< of those, without an answer in time
  uint64_t rejected_bytes = 0;   ///< that belonged to no answer
  uint64_t opened = 0;           ///< times the device became ready
  uint64_t repaired = 0;         ///< times its transfers were repaired without opening it again
  uint64_t cuts = 0;             ///< times the force was cut because the servo thread did not call
  uint64_t uploads = 0;          ///< attempts to load firmware
  bool event_character = false;  ///< the fast turnaround is on; else the latency timer's pace
};

/// What every Falcon is like; address is empty. Its delay_s is 0 because nobody has measured it.
DeviceInfo falcon_info();

/// A Novint Falcon (USB 0403:cb48), without its maker's driver.
///
/// A thread of its own looks for the device, opens it, loads firmware if it has none and the user
/// gave a file, puts transfers right when they fail, and looks for the device again when it is
/// unplugged. The servo thread's exchange() uses what that thread has made ready, or answers at
/// once with the fault.
///
/// Force is zero until the encoders have found their zero marks and for a settling time after, and
/// as long as there is any fault. It is cut at once, not along a ramp, since the position that it
/// depended on is not to be trusted. If exchange() is not called for away_ns while there is a
/// force, the thread cuts it. Lights: red not homed, green homed, blue in contact.
class FalconDevice final : public ForceDevice {
 public:
  /// kBadInput if the firmware file can not be read or can not be firmware. Not finding a device is
  /// no error: the search goes on.
  static Result<std::unique_ptr<FalconDevice>> make(const FalconOptions& options);
  /// Whether something with the Falcon's ids is on the bus now: reads the bus, without opening
  /// anything.
  static bool is_plugged_in();

  /// Sends zero force and closes the device. No exchange() may be running.
  ~FalconDevice() override;

  DeviceInfo info() const override;
  /// Waits answer_wait_ns at most. One CAS and no lock of ours; libusb allocates one block and
  /// takes its own mutexes per transfer, two transfers per exchange (more only where the answer
  /// comes in pieces). The device keeps the force until the next call.
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

  /// Any thread.
  FalconCounts counts() const noexcept;

 private:
  class Worker;
  explicit FalconDevice(std::unique_ptr<Worker> worker);
  std::unique_ptr<Worker> worker_;
};

}  // namespace palpate::devices
