#pragma once

#include <optional>
#include <string>

namespace palpate::bench {

/// How long one exchange with a Falcon takes, command to answer, over the emulated device below the
/// real libusb. The device answers after the time that 16 bytes each way take on its serial wire at
/// 1.5 Mbaud; the emulation of the kernel costs far more than a kernel does, which is why the bare
/// exchange is measured beside ours. Microseconds.
struct UsbTurnaround {
  int exchanges = 0;                     ///< of each kind
  double wire_us = 0.0;                  ///< waited for by the emulated device, as computed
  double median_us = 0.0, p99_us = 0.0;  ///< FalconDevice::exchange()
  double timer_median_us = 0.0;          ///< the same without the event character
  double bare_median_us = 0.0;           ///< the same transfers by libusb's own means, no more
  double usual_median_us = 0.0;          ///< write, then read, as most programs do; latency timer
  /// What our code computes in one exchange (kinematics, protocol, judging), measured by itself.
  double ours_us = 0.0;
};

/// Checks that the exchanges give the position at which the emulated grip is, then times them, kind
/// by kind in turns. Nothing, and a sentence in `why`, if they do not. Takes some seconds; changes
/// the timer slack of the calling thread and TMPDIR, so let it be the last one.
std::optional<UsbTurnaround> usb_turnaround(int exchanges, std::string& why);

}  // namespace palpate::bench
