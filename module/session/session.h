#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "module/haptics/background.h"
#include "module/haptics/host_loop.h"
#include "module/haptics/scene_ticker.h"
#include "module/haptics/second_hand.h"
#include "module/haptics/servo.h"
#include "module/session/hand_tubes.h"
#include "module/session/live_motion.h"
#include "module/session/loaded_scene.h"

namespace palpate {

/// What has happened in a session: a kind for programs and a sentence for people.
struct SessionEvent {
  enum class Kind {
    kNote,          ///< something that a person may want to know
    kMoves,         ///< every step of the motion is known: the volumes begin to move
    kWholeMotion,   ///< one motion for a whole sequence is felt from now on
    kMotionFailed,  ///< what is known stays felt; the sentence says why there is no more
  } kind = Kind::kNote;
  std::string sentence;
};

struct SessionOptions {
  HapticsOptions haptics;
  ServoOptions servo;
  /// Moves the volumes whose drive says so; may be null: they stand still. Borrowed.
  const SecondHand* second_hand = nullptr;
  /// How motion that nothing gives is estimated while the data are felt; without open_context the
  /// data stand still.
  LiveMotionOptions motion;
  /// Buttons of the device with which the hand releases stream tubes; see CommandButton. 0: none.
  uint32_t tube_buttons = 0;
  /// Hears what happens, on a thread of the session's; may be empty. Must not end the session. What
  /// it throws is dropped: it is the one who would be told.
  std::function<void(const SessionEvent&)> on_event;
  /// Asked every some hundredths of a second, on a thread of the session's: a sentence becomes an
  /// event of kind kNote. For what goes wrong where nothing may be said, in the haptic loop. May be
  /// empty.
  std::function<std::string()> next_note;
};

/// The readers of the newest snapshot, each on a thread of its own.
enum class SnapshotReader { kHeadset, kWindow, kPictures, kLive, kServer, kTubes };
static_assert(int(SnapshotReader::kTubes) < SceneTicker::kReaders);

/// A scene that is being felt: joins scene, haptic step and servo loop, sends the poses of volumes
/// that move by themselves, estimates motion that nothing gives and takes it up while the loop
/// runs. A volume whose motion is still missing stands still: frames that fade into each other
/// where they are would let surfaces jump, or vanish under the hand.
class Session {
 public:
  /// Starts the servo thread. `device` is borrowed, and so are the listeners. kBadInput if the
  /// scene can not be put together.
  static Result<std::unique_ptr<Session>> start(const LoadedScene& scene, ForceDevice& device,
                                                SessionOptions options);
  /// The same without a servo thread: the host calls tick() in its own haptic loop. `device` says
  /// what the host's device can do.
  static Result<std::unique_ptr<Session>> start_in_host(const LoadedScene& scene,
                                                        const DeviceInfo& device,
                                                        SessionOptions options);
  /// As stop().
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// One haptic frame of a session that was started in its host: the force for the hand, device
  /// space, N, behind every guard. About 1,000 times a second, 250 to 4,000 are allowed. Real-time
  /// safe; one thread at a time. Zero if the session has a servo thread.
  glm::dvec3 tick(const HostTick& tick) noexcept {
    return host_ ? host_->tick(tick) : glm::dvec3(0.0);
  }

  /// One step of a volume's motion is known now: it is felt from the next ticks on, without a step
  /// of the force. Any thread.
  Status take_motion(size_t volume, size_t step, std::shared_ptr<const MotionMap> map);

  /// Another form of a volume's data, with as many frames and the same times: felt from the next
  /// ticks on, without a step of the force. Any thread.
  Status take_volume(size_t volume, std::shared_ptr<const MovingVolume> data);

  /// Whether the loop has been offered all that was taken; else it is soon, by itself. What is sent
  /// after that acts on the newest data. Any thread.
  bool has_handed_over() const;

  /// Into the loop; false if too much waits there already. Any thread.
  bool send(const ControlEvent& event);
  /// Both, one after the other, or neither. Any thread.
  bool send(const ControlEvent& first, const ControlEvent& second);

  /// What a key asks of the stream tubes, at the proxy of the next tick. Any thread.
  bool release_tube() { return send({ControlEvent::Kind::kReleaseTube}); }
  bool keep_tubes() { return send({ControlEvent::Kind::kKeepTubes}); }
  bool clear_tubes() { return send({ControlEvent::Kind::kClearTubes}); }
  /// The stream tubes that the hand has released, as of some hundredths of a second ago, and after
  /// stop() all of them. Never null. Any thread.
  std::shared_ptr<const ReleasedTubes> tubes() const;

  /// Whether there is motion to play: false while it is awaited. Any thread.
  bool can_play() const { return can_play_; }
  /// Plays what was paused, pauses what was played; nothing while motion is awaited. Any thread.
  void toggle_play();
  void play(bool on);
  /// By a share of each sequence from where it is in `snapshot`, or from where the scrub before
  /// took it, which no picture may have shown yet; pauses. Any thread.
  void scrub(const SceneSnapshot& snapshot, double share);
  /// To a share of every moving sequence's length, 0 to 1; pauses. Any thread.
  void scrub_to(double share);

  /// The scene as it is felt now. Any thread.
  std::shared_ptr<const Scene> scene() const;
  /// What is estimated meanwhile.
  const LiveMotion& motion() const { return *motion_; }

  /// The newest tick as an eye sees it; true if it is another than last time. One thread each.
  bool newest(SnapshotReader who, SceneSnapshot& snapshot) {
    return ticker_.newest(int(who), snapshot);
  }
  /// The newest tick for reader 0 or 1; see Servo::newest().
  bool newest(int reader, TickOutput& output) noexcept;
  const ServoStatistics& statistics() const noexcept;
  /// Which real-time settings the system gave the servo thread; none where the host ticks.
  const ServoReport& report() const;

  /// Moves all volumes that a second hand may move: x becomes moved(x), world, a similarity
  /// (equal scales). They follow on a smooth path. Any thread; to be called once per frame as long
  /// as they are held, also if they rest.
  void drag(const Transform& moved);
  /// Where a volume is from now on: world_from_volume. It follows on a smooth path. Any thread.
  /// False if there is no such volume, or too much waits already.
  bool place(size_t volume, const Transform& world_from_volume);

  /// Ramps to zero and ends the servo thread and the estimation. In a host the ramp takes place
  /// while it goes on to tick, and this does not wait for it. Further calls do nothing. Any thread
  /// but those of the session.
  void stop();
  /// Whether the loop has been stopped and the device's force has reached zero.
  bool at_rest() const noexcept;
  /// The step's books; after stop() only.
  const Haptics& haptics() const { return ticker_.haptics(); }

 private:
  Session(const SessionOptions& options, const DeviceInfo& device);
  Status begin(const LoadedScene& at_start);
  void begin_motion(const LoadedScene& at_start);
  Status hand_over(Result<std::shared_ptr<const Scene>> scene);
  void send_poses();
  void take_commands();
  bool push(const PoseUpdate& pose);
  void on_motion(const LiveMotion& motion);
  void tell(SessionEvent::Kind kind, const std::string& sentence) const;
  void attempt(const std::function<void()>& work);
  void say_what_failed(const Scene& felt);

  SessionOptions options_;
  mutable std::mutex mutex_;   ///< of all that follows but poses_; never the servo thread's
  std::vector<double> rates_;  ///< per volume, as the scene wants them
  std::shared_ptr<const Scene> scene_;  ///< the newest
  bool waiting_ = false;                ///< a scene that could not be offered yet
  SceneTicker ticker_;
  std::unique_ptr<Servo> servo_;  ///< one of these two runs the ticker
  std::unique_ptr<HostLoop> host_;
  std::vector<Transform> moved_;  ///< per volume: where second hands have taken it
  int64_t start_ns_ = 0, last_ns_ = 0;
  std::mutex stopping_;  ///< stop() may be called by several threads
  std::atomic<bool> can_play_{false}, playing_{true};
  std::vector<double> scrubbed_s_;  ///< per volume; empty: not since it played
  mutable std::mutex tubes_mutex_;  ///< of hand_tubes_
  HandTubes hand_tubes_;
  std::unique_ptr<Background> poses_, commands_;
  std::vector<size_t> missing_;  ///< volumes whose motion is awaited
  std::atomic<bool> told_failure_{false};
  std::vector<std::shared_ptr<const Mode>> failed_modes_;  ///< that were told of; commands_' alone
  std::unique_ptr<LiveMotion> motion_;
};

}  // namespace palpate
