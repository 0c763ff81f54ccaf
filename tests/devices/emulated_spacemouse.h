#pragma once

#include <array>

#include "tests/devices/emulated_usb.h"

namespace palpate::devices::test {

/// A SpaceMouse as its reports describe it, written independently of the code under test: while the
/// puck is pushed or turned it repeats its report, and after release it sends zero once. Reports
/// that are not read are lost, except the newest few.
class EmulatedSpaceMouse : public EmulatedDevice {
 public:
  struct Options {
    uint16_t vendor = 0x046d, product = 0xc626;
    std::string product_name = "SpaceNavigator";
    int port = 4;
    /// Newer models: the rotation is in report 1.
    bool six_axes_in_one = false;
  };
  explicit EmulatedSpaceMouse(const Options& options);
  EmulatedSpaceMouse() : EmulatedSpaceMouse(Options()) {}
  ~EmulatedSpaceMouse() override { stop(); }

  /// x y z and rotations about x y z, in counts of 350, in the puck's own axes. All zero: released.
  void push(std::array<int, 6> axes);
  void press(uint32_t buttons);
  /// As if the receiver had lost it: it does not even send zero.
  void fall_silent();
  /// Sends any bytes, once.
  void say(Bytes report);
  void stall();  ///< until the halt is cleared
  /// Clearing the halt does not help.
  void stall_ever();

 protected:
  int take(const Bytes&) override { return -EPIPE; }
  int64_t serve(int64_t now_ns) override;
  void cleared_halt(uint8_t endpoint) override;
  void plugged() override;

 private:
  void say_motion();
  void queue(Bytes report);

  const Options options_;
  std::array<int, 6> axes_{};
  bool repeats_ = false;
  int64_t next_ns_ = 0;
  std::deque<Bytes> reports_;
  bool stalled_ = false, stalled_ever_ = false;
};

}  // namespace palpate::devices::test
