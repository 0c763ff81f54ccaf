#pragma once

#include <memory>
#include <mutex>

#include "integration/app/felt_scene.h"
#include "integration/devices/second_hand.h"
#include "module/haptics/background.h"
#include "module/haptics/scene_ticker.h"
#include "module/haptics/servo.h"

namespace palpate::app {

/// Who looks at what is felt, each on a thread of its own.
enum class Viewer { kHeadset, kWindow, kGallery };
static_assert(int(Viewer::kGallery) < SceneTicker::kReaders);

/// A scene that is being felt: joins scene, haptic step and servo thread, sends the poses of
/// volumes that move by themselves, and takes motion that arrives while it runs. A volume whose
/// motion is still missing stands still: frames that fade into each other where they are would let
/// surfaces jump, or vanish under the hand.
class Palpation {
 public:
  /// Starts the servo thread. `device` is borrowed, and so are the listeners and the second hand
  /// (may be null: volumes that it would move stand still). kBadInput if the scene can not be put
  /// together.
  static Result<std::unique_ptr<Palpation>> start(FeltScene scene, ForceDevice& device,
                                                  const HapticsOptions& haptics,
                                                  const ServoOptions& servo,
                                                  const devices::SecondHand* second_hand = nullptr);
  /// As stop().
  ~Palpation();
  Palpation(const Palpation&) = delete;
  Palpation& operator=(const Palpation&) = delete;

  /// One step of a volume's motion is known now: it is felt from the next ticks on, without a step
  /// of the force. Any thread.
  Status take_motion(size_t volume, size_t step, std::shared_ptr<const MotionMap> map);

  /// Another form of a volume's data, with as many frames and the same times: felt from the next
  /// ticks on, without a step of the force. Any thread.
  Status take_volume(size_t volume, std::shared_ptr<const MovingVolume> data);

  /// Into the loop; false if too much waits there already. Any thread.
  bool send(const ControlEvent& event);
  /// A volume whose motion was awaited begins to move. Any thread.
  void play(size_t volume);

  /// The scene as it is felt now. Any thread.
  std::shared_ptr<const HapticScene> scene() const;

  Servo& servo() { return *servo_; }
  /// The newest tick as an eye sees it; true if it is another than last time. One thread each.
  bool newest(Viewer who, SceneMoment& moment) { return ticker_.newest(int(who), moment); }
  /// Takes along all volumes that a second hand may move: x becomes moved(x), world, a similarity
  /// (equal scales). They follow on a smooth path. Any thread; to be called once per frame as long
  /// as they are held, also if they rest.
  void drag(const Transform& moved);
  /// Ramps to zero and ends the servo thread. Further calls do nothing.
  void stop();
  /// The step's books; after stop() only.
  const Haptics& haptics() const { return ticker_.haptics(); }

 private:
  Palpation(FeltScene scene, const HapticsOptions& haptics, const DeviceInfo& device)
      : felt_(std::move(scene)), ticker_(haptics, device) {}
  Status hand_over();
  void send_poses();

  mutable std::mutex mutex_;  ///< of all that follows but poses_; never the servo thread's
  FeltScene felt_;
  std::vector<double> rates_;  ///< per volume, as the scene wants them
  std::shared_ptr<const HapticScene> assembled_;
  bool waiting_ = false;  ///< a scene that could not be offered yet
  SceneTicker ticker_;
  std::unique_ptr<Servo> servo_;
  const devices::SecondHand* second_hand_ = nullptr;
  std::vector<Transform> moved_;  ///< per volume: where second hands have taken it
  int64_t start_ns_ = 0, last_ns_ = 0;
  std::unique_ptr<Background> poses_;
};

/// Whether the program has to send this volume's poses: a second hand moves it, or it moves by
/// itself but the loop is not to ask for the exact pose.
bool needs_poses(const VolumeSpec& spec);

}  // namespace palpate::app
