#include "module/haptics/cause.h"

#include "module/haptics/device.h"

namespace palpate {

const char* word(Cause cause) noexcept {
  switch (cause) {
    case Cause::kNone:
      return "none";
    case Cause::kStarting:
      return "starting";
    case Cause::kDeadMan:
      return "dead-man";
    case Cause::kDevice:
      return "device";
    case Cause::kNotFinite:
      return "not-finite";
    case Cause::kLate:
      return "late";
    case Cause::kClock:
      return "clock";
    case Cause::kTooFast:
      return "too-fast";
    case Cause::kWorkspaceEdge:
      return "workspace-edge";
    case Cause::kFirstContact:
      return "first-contact";
    case Cause::kOscillation:
      return "oscillation";
    case Cause::kHot:
      return "hot";
    case Cause::kEnergy:
      return "energy";
    case Cause::kField:
      return "field";
    case Cause::kConfidence:
      return "confidence";
    case Cause::kSceneEmpty:
      return "scene-empty";
    case Cause::kStopped:
      return "stopped";
    case Cause::kUnseen:
      return "unseen";
    case Cause::kSudden:
      return "sudden";
    case Cause::kReturn:
      return "return";
    case Cause::kShaking:
      return "shaking";
  }
  return "unknown";
}

const char* sentence(Cause cause) noexcept {
  switch (cause) {
    case Cause::kNone:
      return "The force is the scene's.";
    case Cause::kStarting:
      return "Move the hand to free space: the force comes up slowly once nothing is touched.";
    case Cause::kDeadMan:
      return "Hold a button of the device to feel.";
    case Cause::kDevice:
      return "The device has a fault.";
    case Cause::kNotFinite:
      return "A position or a force was not finite.";
    case Cause::kLate:
      return "The loop was late: this machine is too busy for haptics.";
    case Cause::kClock:
      return "The clock jumped.";
    case Cause::kTooFast:
      return "The hand moves too fast.";
    case Cause::kWorkspaceEdge:
      return "The hand is at the edge of the device's reach.";
    case Cause::kFirstContact:
      return "The force of the first touch rises slowly.";
    case Cause::kOscillation:
      return "The force buzzes: lower the stiffness, or hold the grip more firmly.";
    case Cause::kHot:
      return "The motors are hot: the force is reduced to what they can sustain.";
    case Cause::kEnergy:
      return "The scene would give more energy to the hand than is allowed.";
    case Cause::kField:
      return "The motion field can not be inverted here: the point is frozen and the force "
             "fades.";
    case Cause::kConfidence:
      return "The motion field is not reliable here: the force fades.";
    case Cause::kSceneEmpty:
      return "There is nothing to feel in this scene.";
    case Cause::kStopped:
      return "The loop was asked to stop.";
    case Cause::kUnseen:
      return "There is no picture in the headset: the force comes back with it.";
    case Cause::kSudden:
      return "The surface under the hand ended or changed suddenly: the force follows slowly.";
    case Cause::kReturn:
      return "After a fast touch the hand gets back only the energy that it put in.";
    case Cause::kShaking:
      return "The scene shakes the hand: its motion or its values change too quickly.";
  }
  return "An unknown cause.";
}

const char* sentence(DeviceFault fault) noexcept {
  switch (fault) {
    case DeviceFault::kNone:
      return "The device works.";
    case DeviceFault::kNotOpened:
      return "No device was found yet: plug it in.";
    case DeviceFault::kNoPermission:
      return "The device may not be opened by this user: install the udev rule and plug it in "
             "again.";
    case DeviceFault::kNoFirmware:
      return "The device needs its maker's firmware: give the file with `falcon_firmware`.";
    case DeviceFault::kStarting:
      return "The device is being started.";
    case DeviceFault::kNotHomed:
      return "The device has to find its zero: a Falcon's grip goes all the way out, then all the "
             "way in; a Touch's pen goes into its inkwell; others are calibrated with their "
             "maker's "
             "program.";
    case DeviceFault::kUnplugged:
      return "The device was unplugged.";
    case DeviceFault::kTimeout:
      return "The device did not answer in time.";
    case DeviceFault::kTransfer:
      return "The USB bus refused a transfer.";
    case DeviceFault::kGarbage:
      return "The device's answers are invalid.";
    case DeviceFault::kOutOfReach:
      return "The device reports a place that its arms can not reach.";
    case DeviceFault::kJumped:
      return "The position jumped further than a hand can move.";
    case DeviceFault::kStuck:
      return "The position is stuck.";
    case DeviceFault::kBusy:
      return "Another program holds the device: close it.";
    case DeviceFault::kForceOff:
      return "The device has switched its force off: move slowly, let go of its brake, or press "
             "its force button.";
    case DeviceFault::kNoHand:
      return "No hand is there: take the pen or a controller, pinch with thumb and forefinger, or "
             "bring the tracked tool into view.";
    case DeviceFault::kHot:
      return "The device's motors are too warm: let them cool down.";
    case DeviceFault::kNoLibrary:
      return "The library of the device's maker is missing or too old: install the maker's SDK.";
  }
  return "An unknown fault.";
}

}  // namespace palpate
