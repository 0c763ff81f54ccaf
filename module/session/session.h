#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "module/haptics/scene_ticker.h"
#include "module/haptics/servo/background.h"
#include "module/haptics/servo/host_loop.h"
#include "module/haptics/servo/second_hand.h"
#include "module/haptics/servo/servo.h"
#include "module/session/hand_tubes.h"
#include "module/session/live_motion.h"
#include "module/session/loaded_scene.h"

namespace palpate {

/// An event in a session: a kind for programs and a sentence for people.
struct SessionEvent {
  enum class Kind {
    kNote,          ///< information for the user
    kMoves,         ///< a motion is known, coarse at first: the volumes begin to move
    kWholeMotion,   ///< one motion for a whole sequence is in use from now on
    kMotionFailed,  ///< known motion stays in use; the sentence says why there is no more
  } kind = Kind::kNote;
  std::string sentence;
};

class Session;

struct SessionOptions {
  HapticsOptions haptics;
  ServoOptions servo;
  /// Moves the volumes whose drive is a second hand; null: only drag() and place() do. Borrowed.
  const SecondHand* second_hand = nullptr;
  /// Where the servo thread takes its time from; null: the monotonic clock. Borrowed.
  ServoClock* clock = nullptr;
  /// A session of the same scene with a second device, which was started before: it gets all
  /// motion, poses and events that this one gets, and viewers of this one see its hand. Borrowed;
  /// it ends with this one. Null: one hand.
  Session* second = nullptr;
  /// It is the second one of another session, which sends it poses.
  bool is_second = false;
  /// How motion that no file contains is estimated while the data are felt; without open_context
  /// the data stand still.
  LiveMotionOptions motion;
  /// Buttons of the device that release stream tubes; see CommandButton. 0: none.
  uint32_t tube_buttons = 0;
  /// Called with each event, on a thread of the session; may be empty. Must not end the session.
  /// Its exceptions are dropped, since it is the place to report them.
  std::function<void(const SessionEvent&)> on_event;
  /// Called every few hundredths of a second, on a thread of the session; a sentence that it
  /// returns becomes an event of kind kNote. For errors in the haptic loop, which must not report
  /// them itself. May be empty.
  std::function<std::string()> next_note;
};

/// Readers of the newest snapshot, each on a thread of its own.
enum class SnapshotReader { kHeadset, kWindow, kPictures, kLive, kServer, kPage, kTubes };
static_assert(int(SnapshotReader::kTubes) < SceneTicker::kReaders);

/// A scene that is being felt: joins scene, haptic step and servo loop, sends the poses of volumes
/// that move by themselves, estimates missing motion and puts it to use while the loop runs. A
/// volume whose motion is still missing stands still: with frames blended in place, surfaces would
/// jump or vanish under the hand.
class Session {
 public:
  /// Starts the servo thread. `device` and the listeners are borrowed. Errors: kBadInput if the
  /// scene can not be assembled.
  static Result<std::unique_ptr<Session>> start(const LoadedScene& scene, ForceDevice& device,
                                                SessionOptions options);
  /// The same without a servo thread: the host calls tick() in its own haptic loop. `device`
  /// describes the host's device.
  static Result<std::unique_ptr<Session>> start_in_host(const LoadedScene& scene,
                                                        const DeviceInfo& device,
                                                        SessionOptions options);
  /// As stop().
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// One haptic frame of a session started with start_in_host(): returns the force on the hand,
  /// device space, N, after all guards. Call it about 1,000 times a second; 250 to 4,000 are
  /// allowed. Real-time safe; one thread at a time. Zero if the session has a servo thread.
  glm::dvec3 tick(const HostTick& tick) noexcept {
    return host_ ? host_->tick(tick) : glm::dvec3(0.0);
  }
  /// With a host that ticks: see HostLoop. Zero else.
  glm::dvec3 torque_n_m() const noexcept { return host_ ? host_->torque_n_m() : glm::dvec3(0.0); }

  /// Takes a newly known step of a volume's motion: it is used from the next ticks on, without a
  /// jump of the force. Any thread.
  Status take_motion(size_t volume, size_t step, std::shared_ptr<const MotionMap> map);

  /// Takes another form of a volume's data, with as many frames and the same times: it is used from
  /// the next ticks on, without a jump of the force. Any thread.
  Status take_volume(size_t volume, std::shared_ptr<const MovingVolume> data);

  /// Whether everything that was taken has been handed to the loop; if not, it will be soon. What
  /// is sent after that acts on the newest data. Any thread.
  bool has_handed_over() const;

  /// Sends an event to the loop; false if its queue is full. Any thread.
  bool send(const ControlEvent& event);
  /// Sends both, one after the other, or neither. Any thread.
  bool send(const ControlEvent& first, const ControlEvent& second);

  /// Releases a stream tube at the proxy of the next tick, as a key does. Any thread.
  bool release_tube() { return send({ControlEvent::Kind::kReleaseTube}); }
  bool keep_tubes() { return send({ControlEvent::Kind::kKeepTubes}); }
  bool clear_tubes() { return send({ControlEvent::Kind::kClearTubes}); }
  /// The stream tubes that the user has released, up to a few hundredths of a second ago; after
  /// stop() all of them. Never null. Any thread.
  std::shared_ptr<const ReleasedTubes> tubes() const;

  /// Whether there is motion to play: false while it is being estimated. Any thread.
  bool can_play() const { return can_play_; }
  /// Whether time goes on, or will where there is motion to play. Any thread.
  bool plays() const { return playing_; }
  /// Pauses or continues; does nothing while motion is being estimated. Any thread.
  void toggle_play();
  void play(bool on);
  /// Moves the time of each sequence by a share of its length, from its time in `snapshot`, or from
  /// where the last scrub moved it, which no picture may have shown yet; pauses. Any thread.
  void scrub(const SceneSnapshot& snapshot, double share);
  /// Moves the time of every moving sequence to a share of its length, 0 to 1; pauses. Any thread.
  void scrub_to(double share);

  /// The present scene. Any thread.
  std::shared_ptr<const Scene> scene() const;
  /// The estimation of missing motion.
  const LiveMotion& motion() const { return *motion_; }

  /// The newest tick for a viewer; true if it is another one than in the last call. One thread per
  /// reader.
  bool newest(SnapshotReader who, SceneSnapshot& snapshot);
  /// The newest tick for reader 0 or 1; see Servo::newest().
  bool newest(int reader, TickOutput& output) noexcept;
  const ServoStatistics& statistics() const noexcept;
  /// The real-time settings that the system granted the servo thread; empty if the host ticks.
  const ServoReport& report() const;

  /// Moves all volumes that a second hand may move: x becomes moved(x), world, a similarity (equal
  /// scales). They follow on a smooth path. Any thread; call it once per frame while they are held,
  /// even if they do not move.
  void drag(const Transform& moved);
  /// Sets the place of a volume: world_from_volume. It follows on a smooth path. Any thread. False
  /// if there is no such volume, or if the queue is full.
  bool place(size_t volume, const Transform& world_from_volume);

  /// Ramps the force to zero and ends the servo thread and the estimation. In a host the ramp takes
  /// place in further calls of tick(); this function does not wait for them. Further calls do
  /// nothing. Any thread but those of the session.
  void stop();
  /// Whether the loop has been stopped and the device's force has reached zero.
  bool at_rest() const noexcept;
  /// The haptic step with its statistics; only after stop().
  const Haptics& haptics() const { return ticker_.haptics(); }

 private:
  Session(const SessionOptions& options, const DeviceInfo& device);
  Status begin(const LoadedScene& at_start);
  void begin_motion(const LoadedScene& at_start);
  Status hand_over(Result<std::shared_ptr<const Scene>> scene);
  void send_poses();
  void take_commands();
  bool push(const PoseUpdate& pose);
  void follow(const PoseUpdate& pose);
  void on_motion(const LiveMotion& motion);
  void tell(SessionEvent::Kind kind, const std::string& sentence) const;
  void attempt(const std::function<void()>& work);
  void say_what_failed(const Scene& felt);

  SessionOptions options_;
  /// Guards scene_, waiting_, moved_, last_ns_ and scrubbed_s_. Is also locked for calls that one
  /// thread at a time may make: ticker_.offer() and collect(), and send() of servo_ or host_. The
  /// servo thread never locks it.
  mutable std::mutex mutex_;
  std::vector<double> rates_;           ///< per volume, as in the scene; does not change
  std::shared_ptr<const Scene> scene_;  ///< the newest
  bool waiting_ = false;                ///< a new scene could not be offered to the loop yet
  SceneTicker ticker_;
  std::unique_ptr<Servo> servo_;  ///< one of these two runs the ticker; they do not change
  std::unique_ptr<HostLoop> host_;
  std::vector<Transform> moved_;  ///< per volume: the last one sent to the loop
  int64_t start_ns_ = 0;          ///< does not change
  int64_t last_ns_ = 0;           ///< when poses were last sent
  std::mutex stopping_;           ///< locked by stop(), which several threads may call
  std::atomic<bool> can_play_{false}, playing_{true};
  std::vector<double> scrubbed_s_;  ///< per volume; empty: none since it last played
  mutable std::mutex tubes_mutex_;  ///< guards hand_tubes_
  HandTubes hand_tubes_;
  std::unique_ptr<Background> poses_, commands_;
  /// volumes whose motion was missing at the start; does not change
  std::vector<size_t> missing_;
  std::atomic<bool> told_failure_{false};
  /// already reported; used by commands_ only
  std::vector<std::shared_ptr<const Mode>> failed_modes_;
  std::unique_ptr<LiveMotion> motion_;
};

}  // namespace palpate
