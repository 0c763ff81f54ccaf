#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "module/haptics/cause.h"
#include "module/haptics/device.h"
#include "module/haptics/force_ledger.h"
#include "module/scene/playback.h"
#include "module/scene/transform.h"

namespace palpate {

/// The pose of a volume, sent by a graphics frame or the second hand.
struct PoseUpdate {
  int volume = 0;       ///< index in the scene
  Transform transform;  ///< world_from_volume
  int64_t time_ns = 0;  ///< monotonic time at which it holds
};

/// What a person turns while the loop runs.
struct ControlEvent {
  enum class Kind : uint8_t {
    kRate,         ///< index: volume; value: playing rate
    kScrub,        ///< index: volume; value: time of the sequence, s
    kModeOn,       ///< index: mode; value: 0 off, 1 on
    kModeGain,     ///< index: mode; value: factor on all its strengths
    kStiffness,    ///< value: N/m
    kStop,         ///< ramp to zero and stay there
    kRearm,        ///< after a latched cause: start again
    kReleaseTube,  ///< these three: see HandCommand
    kKeepTubes,
    kClearTubes,
  } kind = Kind::kRate;
  int index = 0;
  double value = 0.0;
};

/// All that one haptic frame depends on besides state and scene: plain data, recorded byte for
/// byte, so that a replay gives the same bits.
struct TickInput {
  double dt_s = 1e-3;  ///< since the last tick, as measured
  int64_t now_ns = 0;  ///< monotonic time of this tick
  DeviceReading reading;
  bool late = false;  ///< the watchdog says the loop missed its deadline by too much
  bool stop = false;  ///< end of the program or of another thread
  int pose_count = 0;
  int event_count = 0;
  std::array<PoseUpdate, 4> poses;
  std::array<ControlEvent, 4> events;
};

/// The result of a haptic frame: the command for the device, and what happened, for viewers and
/// logs. Plain data.
struct TickOutput {
  DeviceCommand command;  ///< device space, behind every guard
  /// World: the spring's force with the bridges over its sudden changes, before the guards.
  glm::dvec3 wanted_n{0.0};
  glm::dvec3 probe_m{0.0};  ///< world
  glm::dvec3 proxy_m{0.0};  ///< world
  Cause cause = Cause::kNone;
  DeviceFault fault = DeviceFault::kNone;
  uint8_t substeps = 0;      ///< pieces into which the proxy's path was cut
  uint8_t primitives = 0;    ///< in the last balance
  uint8_t newton_steps = 0;  ///< most of any back-tracking in this frame
  bool frozen = false;       ///< a back-tracking failed: the material point is frozen
  double residual_m = 0.0;   ///< worst back-tracking residual
  /// energy that moving data and transforms put into the spring in this frame
  double scene_energy_j = 0.0;
  double tank_j = 0.0;  ///< what the tank holds
  FramePointer first;   ///< of the first moving volume
  // What follows is not in a recording: a replay computes it again.
  double hand_work_j = 0.0;  ///< that the forces did on the hand since the start
  ForceLedger ledger;        ///< from the spring's force to the command's
};

}  // namespace palpate
