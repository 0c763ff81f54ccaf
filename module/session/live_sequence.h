#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "compute/motion/estimate_sequence.h"
#include "compute/volume/sequence.h"
#include "module/haptics/servo/statistics.h"
#include "module/session/repetition.h"
#include "module/session/session.h"

namespace palpate {

struct LiveSequenceOptions {
  std::string preset = "fast";
  /// Opens the compute device, called on a thread of low priority.
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  bool keep_cycles = true;  ///< false: every frame is followed, even if the frames repeat
  /// Called with a sentence for the user, on any thread. Its exceptions are dropped.
  std::function<void(const std::string&)> on_note;
};

/// What happened to the received frames.
struct LiveNumbers {
  uint64_t received = 0;
  uint64_t felt = 0;        ///< the hand was moved along with them
  uint64_t newer_came = 0;  ///< left out: a newer one arrived while motion was estimated
  uint64_t elsewhere = 0;   ///< left out: they do not overlap the first one in space
  uint64_t kept = 0;        ///< arrived while a cycle was played: they control its pace
  double delay_median_s = 0.0, delay_p95_s = 0.0, delay_most_s = 0.0;  ///< arrival to felt
  double cycle_s = 0.0;  ///< of the cycle that is played; 0: frames are followed
  int cycles = 0;        ///< number of cycles in the means from which its motion was estimated
};

/// Follows an endless source of frames while it is felt. The first frame stands still. Then, again
/// and again, the motion from the present frame to the newest one is estimated, and the volume
/// moves along it while its values are blended from one to the other; frames in between are left
/// out. When no frame arrives the volume rests at the last one. Frames that repeat (Repetition)
/// become a cyclic sequence with one motion for all of them, which plays at the pace of the
/// arriving frames; when these no longer repeat, each is followed again. Further cycles improve
/// that motion: it is estimated again from the means of up to kMostCycles of them.
///
/// The scene has a ring of `kSlots` frames: the volume moves between two of them, and the next
/// frame is written into the next slot. So live frames reach the servo loop in the same way, and
/// within the same limits, as those of a file.
class LiveSequence {
 public:
  static constexpr size_t kSlots = 4;
  static constexpr int kMostCycles = 8;
  /// Length of a slot in the ring's own time. It is played four times as fast, so that a wall moves
  /// 10 mm in 0.1 s.
  static constexpr double kSlot_s = 0.4;

  /// The scene's frames before any motion: the first frame in each slot.
  static Sequence standing(const Volume& first);
  /// Prepares the volume of a scene that was loaded with standing() for following frames.
  static void prepare(LoadedScene& scene, size_t volume);

  /// Starts at once. `session` is borrowed and has a scene that prepare() was applied to; `first`
  /// is the frame in that scene.
  LiveSequence(Session& session, size_t volume, const Volume& first, LiveSequenceOptions options);
  /// Cancels the estimation and waits for it.
  ~LiveSequence();
  LiveSequence(const LiveSequence&) = delete;
  LiveSequence& operator=(const LiveSequence&) = delete;

  /// Takes the newest frame. A frame on another grid is resampled onto that of the first one. A
  /// frame that can not be used is left out and reported through on_note. One thread; does not
  /// throw.
  void push(const Volume& frame, int64_t arrived_ns);
  LiveNumbers numbers() const;

 private:
  struct RingFrame {
    Volume volume;
    int64_t arrived_ns = 0;
  };
  struct Cycle {
    std::shared_ptr<const MovingVolume> volume;
    std::vector<double> times_s;
    std::vector<Volume> frames;  ///< the means over the cycles received
    size_t reference = 0;
    std::vector<std::vector<float>> means;
    double cycle_s = 0.0, contrast = 0.0;
  };
  /// The cycles after the first one: first their frames are collected; then, added to the means,
  /// their motion is estimated.
  struct Further {
    std::vector<Volume> frames;  ///< without values: not yet received
    int cycles = 1;              ///< number of cycles in the means
    std::stop_source stop;
    std::future<Result<SequenceMotion>> motion;
    ~Further() { stop.request_stop(); }
  };
  void run(std::stop_token stop);
  void take(const Volume& frame, int64_t arrived_ns);
  Status follow(const std::shared_ptr<vulkan::Context>& context, std::stop_token stop);
  void move_to(Volume frame, int64_t arrived_ns, const PairMotion& pair, std::stop_token stop);
  void begin_cycle(const Cycle& cycle, std::stop_token stop);
  void keep(Cycle& cycle, std::stop_token stop);
  void stand_at(const Volume& frame, std::stop_token stop);
  void look_for_cycle(const Volume& frame, int64_t arrived_ns);
  Result<SequenceMotion> motion_of(const std::vector<double>& times_s,
                                   const std::vector<Volume>& frames, SequenceMotionOptions options,
                                   std::stop_token stop);
  void take_further(Cycle& cycle, Further& further, size_t frame, Volume volume,
                    std::stop_token stop);
  Result<Cycle> find_cycle(std::vector<RingFrame> frames, std::vector<std::vector<float>> means,
                           double contrast);
  std::optional<PairMotion> wait_for_pair(std::stop_token stop);
  bool wait_for_frame(RingFrame& frame, std::stop_token stop, bool or_cycle);
  void hand_over(std::shared_ptr<const MovingVolume> volume, std::stop_token stop);
  void watch();
  void say(const std::string& sentence) const;

  Session& session_;
  size_t index_;
  Grid grid_;
  LiveSequenceOptions options_;
  MovingVolume ring_;  ///< used by the worker only, as are slot_ and felt_
  size_t slot_ = 0;
  Volume felt_;  ///< samples of the frame at slot_, which can not be recovered from its spline
  Repetition repetition_;  ///< used by push() only, as are history_ and its size
  std::deque<RingFrame> history_;
  std::atomic<bool> searching_{true};

  mutable std::mutex mutex_;  ///< guards the members below except the threads
  std::condition_variable_any changed_;
  std::optional<RingFrame> newest_;
  std::optional<PairMotion> pair_;
  std::future<Result<Cycle>> cycle_;
  LiveNumbers numbers_;
  Histogram delays_;                      ///< from arrival to felt
  double target_s_ = 0.0, time_s_ = 0.0;  ///< of the ring: the time to go to, and the present time
  int64_t target_arrived_ns_ = 0;         ///< of the frame at target_s_; 0: the hand has reached it
  std::stop_source stop_cycle_;
  std::unique_ptr<Background> watch_;
  std::jthread worker_;
};

}  // namespace palpate
