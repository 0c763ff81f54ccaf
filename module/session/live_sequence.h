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
#include "module/haptics/statistics.h"
#include "module/session/repetition.h"
#include "module/session/session.h"

namespace palpate {

struct LiveSequenceOptions {
  std::string preset = "fast";
  /// Opens the device that computes, on a thread of low priority.
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  bool keep_cycles = true;  ///< false: every frame is followed, even where they repeat
  /// A sentence; any thread. What it throws is dropped.
  std::function<void(const std::string&)> on_note;
};

/// What became of the frames that came.
struct LiveNumbers {
  uint64_t received = 0;
  uint64_t felt = 0;        ///< the hand was carried to them
  uint64_t newer_came = 0;  ///< left out: a newer one came while motion was estimated
  uint64_t elsewhere = 0;   ///< left out: nothing of them lies where the first one does
  uint64_t kept = 0;        ///< came while the cycle was kept: they only held its pace
  double delay_median_s = 0.0, delay_p95_s = 0.0, delay_most_s = 0.0;  ///< arrival to felt
  double cycle_s = 0.0;  ///< of the cycle that is kept; 0: frames are followed
  int cycles = 0;        ///< from whose means its motion was found
};

/// Follows a source of frames that has no end while it is felt. The first frame is felt standing
/// still. Then, again and again, the motion from the frame that is felt to the newest one is
/// estimated, and the volume moves along it, values fading from the one to the other on the way;
/// the newest frame wins, and those between are left out. When no frame comes it rests at the last
/// one. Frames that repeat (Repetition) become a sequence with one motion for all of them, whose
/// pace follows theirs; when they no longer repeat, each is followed again. Further cycles make
/// that motion better: it is found again from the means of up to kMostCycles of them.
///
/// The scene has `kSlots` frames in a ring: what moves is between two of them, and what is new is
/// put into the next. So each frame reaches the hand as those of a file do, within the same limits.
class LiveSequence {
 public:
  static constexpr size_t kSlots = 4;
  static constexpr int kMostCycles = 8;
  /// of the ring's own time; gone through four times as fast, so that a wall goes 10 mm in 0.1 s
  static constexpr double kSlot_s = 0.4;

  /// The scene's frames before any has moved: the first one in each slot.
  static Sequence standing(const Volume& first);
  /// Makes the volume of a scene that was loaded with standing() ready to be followed.
  static void prepare(LoadedScene& scene, size_t volume);

  /// Starts at once. `session` is borrowed and has a scene that was prepared; `first` is the frame
  /// that it lets feel.
  LiveSequence(Session& session, size_t volume, const Volume& first, LiveSequenceOptions options);
  /// Ends what is estimated and waits for it.
  ~LiveSequence();
  LiveSequence(const LiveSequence&) = delete;
  LiveSequence& operator=(const LiveSequence&) = delete;

  /// The newest frame. One of another grid is resampled onto that of the first. One that can not be
  /// taken is left out, and that is said. One thread; does not throw.
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
    std::vector<Volume> frames;  ///< the means of the cycles that came
    size_t reference = 0;
    std::vector<std::vector<float>> means;
    double cycle_s = 0.0, contrast = 0.0;
  };
  /// The cycles after the one that is kept: each while its frames come, then, taken into the means,
  /// while their motion is found.
  struct Further {
    std::vector<Volume> frames;  ///< without values: has not come yet
    int cycles = 1;              ///< in the means
    std::stop_source stop;
    std::future<Result<SequenceMotion>> motion;
    ~Further() { stop.request_stop(); }
  };
  void run(std::stop_token stop);
  void take(const Volume& frame, int64_t arrived_ns);
  Status follow(const std::shared_ptr<vulkan::Context>& context, std::stop_token stop);
  void move_to(Volume frame, int64_t arrived_ns, const PairMotion& pair, std::stop_token stop);
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
  bool wait_for_frame(RingFrame& frame, std::stop_token stop, bool or_cycle);
  void hand_over(std::shared_ptr<const MovingVolume> volume, std::stop_token stop);
  void watch();
  void say(const std::string& sentence) const;

  Session& session_;
  size_t index_;
  Grid grid_;
  LiveSequenceOptions options_;
  MovingVolume ring_;  ///< the worker's alone, with slot_ and felt_
  size_t slot_ = 0;
  Volume felt_;            ///< samples of the frame at slot_, which its spline does not give back
  Repetition repetition_;  ///< push()'s alone, with history_ and its bytes
  std::deque<RingFrame> history_;
  std::atomic<bool> searching_{true};

  mutable std::mutex mutex_;  ///< of what follows but the threads
  std::condition_variable_any changed_;
  std::optional<RingFrame> newest_;
  std::optional<PairMotion> pair_;
  std::future<Result<Cycle>> cycle_;
  LiveNumbers numbers_;
  Histogram delays_;                      ///< from arrival to felt
  double target_s_ = 0.0, time_s_ = 0.0;  ///< of the ring: to where it goes, and where it is
  int64_t target_arrived_ns_ = 0;         ///< of the frame there; 0: it is felt already
  std::stop_source stop_cycle_;
  std::unique_ptr<Background> watch_;
  std::jthread worker_;
};

}  // namespace palpate
