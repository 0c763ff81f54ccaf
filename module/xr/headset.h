#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "module/xr/colocation.h"
#include "module/xr/display_rate.h"
#include "module/xr/picture_source.h"
#include "module/xr/problem.h"

namespace palpate::xr {

/// The state of the headset's life cycle. What leads out of each state: docs/decisions/xr.md.
enum class HeadsetState {
  kNoRuntime,  ///< there is nothing to talk to; look_again() starts over
  /// not tried yet, or the runtime is down, the headset off, or a call was refused: tried again
  /// (Report says when)
  kWaiting,
  kIdle,     ///< a session is there; the runtime wants no frames (headset laid down)
  kHidden,   ///< frames run but are not displayed
  kVisible,  ///< displayed, but input goes elsewhere (a menu of the runtime)
  kFocused,  ///< displayed, with input
  kEnded,    ///< the person or the program ended it; look_again() starts over
};
const char* name(HeadsetState state);

enum class BlendMode { kOpaque, kAdditive, kAlpha };
/// Where the base space has its origin. kStage: it stays in the room. kLocal: at the head of the
/// person; kLocalFloor: below it, on the floor (XR_EXT_local_floor): both move when the person
/// recentres. kView: in the head, always.
enum class Origin { kStage, kLocal, kView, kLocalFloor };
const char* name(Origin origin);

struct HeadsetOptions {
  bool validation = false;  ///< Vulkan validation layers, if installed
  /// kLocalFloor falls back to kStage, and kStage to kLocal, where there is none.
  Origin origin = Origin::kStage;
  BlendMode blend = BlendMode::kOpaque;  ///< used where offered, else the runtime's first choice
  /// Above the picture of another OpenXR program that runs at the same time, on runtimes that can
  /// (XR_EXTX_overlay); of several overlays the higher number is in front. None: palpate is the
  /// program that runs.
  std::optional<uint32_t> overlay;
  /// Picture size as a fraction of what the runtime recommends.
  double view_scale = 1.0;
  /// Rate of the display, Hz, where the runtime lets programs choose it: the next one that it
  /// offers. 0: the highest at which the source's pictures are good enough; as an overlay, none.
  double refresh_hz = 0.0;
  uint64_t memory_cap_bytes = 0;  ///< for vulkan::ContextOptions
};

/// What there is to know after a step.
struct Report {
  HeadsetState state = HeadsetState::kWaiting;
  std::string sentence;            ///< for a person, whenever it changes; empty: nothing new
  Problem problem;                 ///< the last one; `call` is empty if there was none
  std::string runtime;             ///< name and version
  std::string system;              ///< name of the headset
  Origin origin = Origin::kStage;  ///< as it is
  BlendMode blend = BlendMode::kOpaque;
  bool depth = false;  ///< the depth layer is handed over
  /// The room, or the program below an overlay, is visible where the picture does not cover it.
  bool see_through = false;
  /// Hands without controllers are looked for by their joints, or one is the runtime's input now.
  bool hand_tracking = false;
  std::string no_hand_tracking;      ///< the call that was refused for them; empty: none
  bool controller_models = false;    ///< the runtime gives the shapes of its controllers
  std::string no_controller_models;  ///< the call that was refused for them; empty: none
  /// The call that was refused for what hangs beside the picture; empty: none.
  std::string no_panel;
  DisplayRate display;
  bool main_visible = true;  ///< an overlay's: the program below is seen
  /// As of the last frame; at rest in every state but kFocused. Read here what must end when frames
  /// stop, such as the dead-man: a PictureSource is not called then.
  Hands hands;
  uint64_t frames = 0;    ///< ended with xrEndFrame since the program's start
  uint64_t drawn = 0;     ///< of these with a picture
  uint64_t sessions = 0;  ///< begun since the program's start
};

/// A picture in a headset through whatever OpenXR runtime there is, for as long as the program
/// lives: finds the runtime, opens a new session after each one that ended, and recovers from every
/// loss. Owns the Vulkan device that goes with it. One thread (the render thread), never the servo
/// thread.
class Headset {
 public:
  /// `source` must outlive it.
  Headset(HeadsetOptions options, PictureSource& source);
  ~Headset();
  Headset(const Headset&) = delete;
  Headset& operator=(const Headset&) = delete;

  /// Does what is due at now_ns (monotonic): polls the runtime's events and, if it wants one, draws
  /// one frame, which waits for the display (xrWaitFrame). Without a running session it returns at
  /// once: the caller's desktop view goes on at its own pace. Throws nothing.
  const Report& step(int64_t now_ns);
  /// As of the last step.
  const Report& report() const;

  /// After kNoRuntime or kEnded: starts over at the next step.
  void look_again();

  /// Asks the runtime to end the session, as the rules of OpenXR have it; step() is to be called
  /// until the state is kEnded. A runtime that does not answer within two seconds of now_ns is
  /// abandoned.
  void end(int64_t now_ns);

  /// Lets controller `hand` (0 left, 1 right) vibrate, 0 to 1, for about two frames: call it once
  /// per frame with vibration() of the force. Nothing happens while not focused.
  void vibrate(int hand, double amplitude);

  /// Where the device of the hand stands in the room; see colocation.h.
  Colocation& colocation();

  /// The headset's Vulkan device; null before there was one. It outlives sessions and runtimes: the
  /// desktop view may go on using it. PictureSource::use and drop tell when it changes.
  std::shared_ptr<vulkan::Context> context() const;

 private:
  class Story;
  std::unique_ptr<Story> story_;
};

}  // namespace palpate::xr
