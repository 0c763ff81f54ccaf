#pragma once

#include <cstdint>
#include <optional>

#include "module/haptics/device.h"
#include "module/haptics/scene/scene_snapshot.h"
#include "module/haptics/tick.h"

namespace palpate {

/// What a hand asks for besides moving: by a button of its device, or by a ControlEvent. The loop
/// only passes it on, with the tick in which it was asked; no force depends on it.
struct HandCommand {
  enum class Kind : uint8_t {
    kReleaseTube,  ///< a stream tube at the proxy
    kKeepTubes,    ///< those that are there stay until all are cleared
    kClearTubes,   ///< those that are not kept; all of them if there are only kept ones
  } kind = Kind::kReleaseTube;
  SceneSnapshot snapshot;
};

/// The command of an event, if it is one. Real-time safe.
constexpr std::optional<HandCommand::Kind> command_of(const ControlEvent& event) noexcept {
  switch (event.kind) {
    case ControlEvent::Kind::kReleaseTube:
      return HandCommand::Kind::kReleaseTube;
    case ControlEvent::Kind::kKeepTubes:
      return HandCommand::Kind::kKeepTubes;
    case ControlEvent::Kind::kClearTubes:
      return HandCommand::Kind::kClearTubes;
    default:
      return std::nullopt;
  }
}

/// Turns buttons of a device into commands: a press lays a tube; a second press soon after keeps
/// the tubes; held for a second, tubes are cleared. A button that was down when the device was
/// first read is ignored until it is released. A value; real-time safe, and the same readings give
/// the same commands.
class CommandButton {
 public:
  static constexpr int64_t kHold_ns = 1'000'000'000;
  static constexpr int64_t kTwice_ns = 500'000'000;  ///< from a press to the next one

  /// mask: which buttons count; 0: none.
  explicit CommandButton(uint32_t mask = 0) : mask_(mask) {}

  std::optional<HandCommand::Kind> step(const DeviceReading& reading, int64_t now_ns) noexcept {
    if (reading.fault != DeviceFault::kNone) {
      known_ = false;
      may_keep_ = false;
      return std::nullopt;
    }
    const bool down = (reading.buttons & mask_) != 0;
    const bool pressed = known_ && down && !down_;
    // A button that was down already can not be held either, until it is released.
    if (!known_ || !down) hold_told_ = true;
    known_ = true;
    down_ = down;
    if (pressed && may_keep_ && now_ns - pressed_ns_ < kTwice_ns) {
      may_keep_ = false;
      return HandCommand::Kind::kKeepTubes;  // if it is held now, it clears nothing
    }
    if (pressed) {
      may_keep_ = true;
      pressed_ns_ = now_ns;
      hold_told_ = false;
      return HandCommand::Kind::kReleaseTube;
    }
    if (hold_told_ || now_ns - pressed_ns_ < kHold_ns) return std::nullopt;
    may_keep_ = false;
    hold_told_ = true;
    return HandCommand::Kind::kClearTubes;
  }

 private:
  uint32_t mask_;
  bool known_ = false, down_ = false;
  bool hold_told_ = true;  ///< the command for this hold was given, or there is no hold
  bool may_keep_ = false;  ///< the last press laid a tube
  int64_t pressed_ns_ = 0;
};

}  // namespace palpate
