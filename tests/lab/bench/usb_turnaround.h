#pragma once

#include <optional>
#include <string>

namespace palpate::bench {

/// The time of one exchange with a Falcon, from command to answer, on the emulated device below the
/// real libusb. The device answers after the time that 16 bytes each way take on its serial line at
/// 1.5 Mbaud. The emulation of the kernel takes far more time than a kernel does, so the bare
/// exchange is measured for comparison. Microseconds.
struct UsbTurnaround {
  int exchanges = 0;  ///< of each kind
  /// The waiting time of the emulated device, as computed.
  double wire_us = 0.0;
  double median_us = 0.0, p99_us = 0.0;  ///< FalconDevice::exchange()
  double timer_median_us = 0.0;          ///< the same without the event character
  /// The same transfers with libusb's own functions only.
  double bare_median_us = 0.0;
  double usual_median_us = 0.0;  ///< write, then read, as most programs do; latency timer
  /// The computation in one exchange (kinematics, protocol, checks), measured alone.
  double ours_us = 0.0;
};

/// Checks that the exchanges give the position of the emulated grip, then times them, alternating
/// between the kinds. Returns nothing, and a message in `why`, if the check fails. Takes some
/// seconds; changes the timer slack of the calling thread and TMPDIR, so call it last.
std::optional<UsbTurnaround> usb_turnaround(int exchanges, std::string& why);

}  // namespace palpate::bench
