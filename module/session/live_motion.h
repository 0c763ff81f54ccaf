#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "compute/motion/estimate_sequence.h"
#include "compute/vulkan/context.h"
#include "module/scene/motion_map.h"
#include "module/session/loaded_scene.h"

namespace palpate {

class LiveMotion;

struct LiveMotionOptions {
  std::string preset = "balanced";
  /// Opens the compute device, called on a thread of low priority, once or twice; empty: no motion
  /// is estimated.
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  /// The loop has real-time priority, so that the estimation takes no time from it.
  bool loop_has_priority = false;
};

/// Receives the results on the estimation's thread. An exception from these functions ends the
/// estimation, as an error does: see LiveMotion::trouble().
struct LiveMotionListener {
  /// One step of a volume's motion.
  std::function<Status(size_t volume, size_t step, std::shared_ptr<const MotionMap> map)> on_step;
  /// The volume with all its steps from one motion, and the values of one frame carried by it.
  std::function<Status(size_t volume, std::shared_ptr<const MovingVolume> carried)> on_whole;
  std::function<void(const std::string&)> on_note;   ///< a sentence on the data for the user
  std::function<void(const LiveMotion&)> on_change;  ///< after each step, and at the end
};

/// Estimates motion that no file contains while the data are already felt, on threads of low
/// priority so that the servo loop keeps its time. What is known is handed over at once: first a
/// coarse motion of the whole sequence, with which it moves within seconds, then the one that is
/// estimated with care. Where the frames' own values are wanted: each step.
class LiveMotion {
 public:
  /// Starts at once if any motion is missing. Unless the frames' own values are wanted, hands over
  /// a coarse motion and then one motion for the whole sequence, both described from the frame that
  /// is felt until then. Without a coarse one (frames too small, or it folds) single steps as pairs
  /// of frames are done. All results come from a thread of this object.
  LiveMotion(const LoadedScene& scene, const LiveMotionOptions& options,
             LiveMotionListener listener);
  /// Cancels running work and waits for it.
  ~LiveMotion();
  LiveMotion(const LiveMotion&) = delete;
  LiveMotion& operator=(const LiveMotion&) = delete;

  bool is_done() const { return done_; }
  /// True if the volumes can move: a coarse motion of each is known, or every step; a motion for
  /// the whole sequence may still follow. Volumes that need one motion for all frames wait for one.
  bool can_move() const {
    return done_ || coarse_ == jobs_.size() || (!needs_whole_ && known_ == steps_);
  }
  /// True if a coarse motion of every volume is known.
  bool has_coarse() const { return coarse_ > 0 && coarse_ == jobs_.size(); }
  /// True if a volume stands still until one motion for all frames is known, because its segments
  /// are known in one frame only.
  bool needs_whole() const { return needs_whole_; }
  /// True if one motion for the whole sequence is estimated after the steps.
  bool finds_whole() const;
  struct Progress {
    size_t steps = 0;            ///< number of steps that were missing
    size_t steps_known = 0;      ///< how many of them are known now
    double moves_after_s = 0.0;  ///< time after which the volumes could move; 0 before
    double seconds = 0.0;        ///< duration of the whole work; 0 until it is done
    double left_s = -1.0;        ///< estimate of the time left; below 0: unknown
  };
  Progress progress() const;
  /// Why it ended early, as a sentence; empty without an error.
  std::string trouble() const;
  /// Waits until the estimation has ended.
  void wait();
  /// Asks the estimation to end, without waiting. Any thread.
  void request_stop() { worker_.request_stop(); }
  /// Cancels the estimation and waits. Must not be called from a listener.
  void cancel();

 private:
  struct Job {
    MissingMotion missing;
    bool cyclic = true;
    bool whole = false;  ///< estimate one motion for all frames after the consecutive fields
    CarriedValues values = CarriedValues::kReference;  ///< for one motion
    std::shared_ptr<const MovingVolume> volume;        ///< with all its frames
    /// the frame that is felt while nothing is known, from which a coarse motion is described
    size_t felt_frame() const { return missing.own ? missing.own->segments_frame : 0; }
  };
  void run(std::stop_token stop);
  void note_trouble(const Status& status);
  Status estimate(const Job& job, std::stop_token stop);
  Status take_pair(const Job& job, const PairMotion& pair);
  Status step_by_step(const Job& job, Frames& frames,
                      const std::shared_ptr<vulkan::Context>& context,
                      const EstimatorOptions& options, std::stop_token stop);
  Result<std::shared_ptr<vulkan::Context>> gives_way(std::shared_ptr<vulkan::Context> context);
  Status whole(const Job& job, Frames& frames, std::shared_ptr<vulkan::Context> context,
               const EstimatorOptions& options, std::stop_token stop);
  Result<bool> coarse(const Job& job, const Grid& grid, const FrameReader& read,
                      const std::shared_ptr<vulkan::Context>& context, std::stop_token stop);

  std::vector<Job> jobs_;
  bool needs_whole_ = false;
  LiveMotionOptions options_;
  LiveMotionListener listener_;
  std::atomic<bool> done_{false};
  std::atomic<size_t> steps_{0}, known_{0};
  std::atomic<size_t> coarse_{0};  ///< volumes that move by a coarse motion
  std::atomic<double> seconds_{0.0}, moves_after_s_{0.0};
  std::atomic<double> share_{0.0};    ///< of all steps
  std::atomic<int64_t> start_ns_{0};  ///< start of the first step, steady clock; 0 before
  mutable std::mutex mutex_;
  std::string trouble_;
  std::jthread worker_;
};

}  // namespace palpate
