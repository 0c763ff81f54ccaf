#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "integration/app/headset/gated_device.h"
#include "integration/app/headset/probe_hand.h"
#include "integration/app/headset/scene_hands.h"
#include "integration/desktop/mouse_probe.h"
#include "integration/files/calibration_file.h"
#include "module/session/scene_picture.h"
#include "module/xr/headset.h"
#include "module/xr/volume_source.h"

namespace palpate::app {

/// What happens to the force when the picture in the headset is lost.
enum class OnHeadsetLoss { kRamp, kGoOn };

/// Inputs of the headset loop. All borrowed until end().
struct HeadsetScene {
  Session* session = nullptr;
  GatedDevice* gate = nullptr;
  /// The probe: moved by a controller, which vibrates in contact; or, without a controller, by a
  /// bare finger that pinches, with colour and sound in contact. Null if there is a force device.
  desktop::MouseProbe* controller = nullptr;
  double max_force_n = 4.0;
  ViewChoices view;
  bool sound = true;  ///< sound of contact for a bare finger
  OnHeadsetLoss on_loss = OnHeadsetLoss::kRamp;
  /// Place of the force device in the room; empty: the world is placed in front of the person.
  std::optional<files::StoredCalibration> calibration;
  glm::dvec3 device_centre_m{0.0};  ///< of its workspace, world
};

/// Shows the running scene in a headset and handles the hands there, on a thread of its own, until
/// the object is destroyed; starts again after every loss of the headset.
class HeadsetLoop {
 public:
  /// Starts to search for a runtime and a headset at once; shows nothing before begin().
  /// pass_through: show the room behind the volume, if the headset supports it. overlay: as
  /// xr::HeadsetOptions::overlay.
  explicit HeadsetLoop(bool pass_through = false, std::optional<uint32_t> overlay = std::nullopt);
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
  /// Ends the OpenXR session and the thread; waits for at most a few seconds.
  void end();

  /// Sentences for the user since the last call. Any thread.
  std::vector<std::string> news();
  /// The person ended the session in the headset. Any thread.
  bool ended() const { return ended_; }
  /// For the summary; after end().
  struct Numbers {
    uint64_t frames = 0, drawn = 0, sessions = 0;
    double picture_ms = 0.0;  ///< time for the last picture on the device
    PictureSize size;
    bool depth = false;
    std::string system, runtime;
  };
  const Numbers& numbers() const { return numbers_; }

 private:
  class Run;
  void tell(std::string sentence);

  /// guards the members below except the atomics, numbers_ and the thread
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Availability> found_;
  std::optional<HeadsetScene> scene_;
  std::vector<std::string> news_;
  std::atomic<bool> ended_{false};
  Numbers numbers_;
  std::jthread thread_;
};

}  // namespace palpate::app
