#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "integration/files/scene/calibration_file.h"
#include "integration/headset/gated_device.h"
#include "integration/headset/headset_event.h"
#include "integration/headset/probe_hand.h"
#include "integration/headset/room_panel.h"
#include "integration/headset/scene_hands.h"
#include "module/haptics/servo/position_source.h"
#include "module/session/live_slices.h"
#include "module/session/scene_picture.h"
#include "module/xr/headset.h"
#include "module/xr/volume_source.h"

namespace palpate::headset {

/// What is asked of a headset, before there is one.
struct HeadsetLoopOptions {
  bool pass_through = false;  ///< the room is seen behind the volume, where the headset offers that
  std::optional<uint32_t> overlay;  ///< as xr::HeadsetOptions::overlay
  bool panel = true;                ///< text and slices hang beside the volume
  double refresh_hz = 0.0;          ///< as xr::HeadsetOptions::refresh_hz
  /// HeadsetScene will have a calibration: the world stays in the room. Otherwise it follows the
  /// person who recentres, where the runtime has a local floor.
  bool calibrated = false;
  /// Sentences about what fails also say why in the words of OpenXR: for those who look for the
  /// cause.
  bool details = false;
};

/// Inputs of the headset loop. All borrowed until end(). session and gate must not be null.
struct HeadsetScene {
  Session* session = nullptr;
  GatedDevice* gate = nullptr;  ///< around the session's device; see GatedDevice::guard()
  /// The probe: moved by a controller, which vibrates in contact; or, without a controller, by a
  /// bare finger that pinches, with colour and sound in contact. Null if there is a force device.
  PositionSource* controller = nullptr;
  double max_force_n = 4.0;
  ViewChoices view;
  bool sound = true;      ///< sound of contact for a bare finger
  bool dead_man = false;  ///< a dead-man is asked for
  /// Place of the force device in the room; empty: the world is placed in front of the person.
  std::optional<files::StoredCalibration> calibration;
  glm::dvec3 device_centre_m{0.0};  ///< of its workspace, world
};

/// Shows the running scene in a headset and handles the hands there, on a thread of its own, until
/// the object is destroyed; starts again after every loss of the headset.
class HeadsetLoop {
 public:
  /// Starts to search for a runtime and a headset at once; shows nothing before begin().
  explicit HeadsetLoop(const HeadsetLoopOptions& options = {});
  /// As end().
  ~HeadsetLoop();
  HeadsetLoop(const HeadsetLoop&) = delete;
  HeadsetLoop& operator=(const HeadsetLoop&) = delete;

  /// The result of the first search for a headset. Waits for it.
  struct Availability {
    bool runtime = false, headset = false;
    bool can_never = false;  ///< the runtime lacks something that was asked for
    std::string sentence;
  };
  Availability found();

  void begin(const HeadsetScene& scene);
  /// Ends the OpenXR session and the thread; waits for at most a few seconds. Then stop the
  /// session: one that goes on has no picture, and its force ends within two seconds (cause:
  /// unseen).
  void end();

  /// What has happened since the last call, in order. Any thread.
  std::vector<HeadsetEvent> news();
  /// The person ended the session in the headset, or the loop failed and force without a picture
  /// was not asked for. Any thread.
  bool ended() const { return ended_; }
  /// For the summary; after end().
  struct Numbers {
    uint64_t frames = 0, drawn = 0, sessions = 0;
    double picture_ms = 0.0;         ///< time for the last picture on the device
    std::vector<PictureSize> sizes;  ///< of its views, as HeadsetFrame::eyes
    bool depth = false;
    std::string system, runtime;
  };
  const Numbers& numbers() const { return numbers_; }

 private:
  class Run;
  void fail(const Error& error);
  void tell(HeadsetEvent event);
  void tell(std::string sentence) { tell({HeadsetEvent::Kind::kNote, std::move(sentence)}); }

  /// guards the members below except the atomics, numbers_ and the thread
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Availability> found_;
  std::optional<HeadsetScene> scene_;
  std::vector<HeadsetEvent> news_;
  std::atomic<bool> ended_{false};
  Numbers numbers_;
  std::jthread thread_;
};

}  // namespace palpate::headset
