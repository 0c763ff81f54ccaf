#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "compute/motion/estimator.h"
#include "compute/vulkan/context.h"
#include "module/scene/motion_map.h"
#include "module/session/loaded_scene.h"

namespace palpate {

class LiveMotion;

struct LiveMotionOptions {
  std::string preset = "balanced";
  /// Opens the device that computes, on a thread of low priority; empty: nothing is estimated.
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
};

/// Takes what is found, on the estimation's thread. What these throw ends the estimation, as an
/// error does: see LiveMotion::trouble().
struct LiveMotionListener {
  /// One step of a volume's motion.
  std::function<Status(size_t volume, size_t step, std::shared_ptr<const MotionMap> map)> on_step;
  /// The volume with all its steps from one motion, and one frame's values carried by it.
  std::function<Status(size_t volume, std::shared_ptr<const MovingVolume> carried)> on_whole;
  std::function<void(const std::string&)> on_note;   ///< a sentence on the data
  std::function<void(const LiveMotion&)> on_change;  ///< after each step, and at the end
};

/// Estimates the motion that no file gives, while the data are already felt: on threads of low
/// priority, so that the hand comes first. Each step is handed over as soon as it is known.
class LiveMotion {
 public:
  /// Starts at once if anything is missing. Steps are handed over one by one as pairs of frames are
  /// done; then, unless its own values are wanted, the whole sequence with one motion. Both come
  /// from a thread of its own.
  LiveMotion(const LoadedScene& scene, const LiveMotionOptions& options,
             LiveMotionListener listener);
  /// Cancels what is still running and waits for it.
  ~LiveMotion();
  LiveMotion(const LiveMotion&) = delete;
  LiveMotion& operator=(const LiveMotion&) = delete;

  bool is_done() const { return done_; }
  /// Every step is known, so that it can move; the whole may still be refined. What waits for one
  /// motion for all frames moves with that.
  bool can_move() const { return done_ || (!needs_whole_ && known_ == steps_); }
  /// Something stands still until one motion for all frames is known: its segments are known in one
  /// frame only.
  bool needs_whole() const { return needs_whole_; }
  /// One motion for the whole sequence is found, or looked for, after the steps.
  bool finds_whole() const;
  struct Progress {
    size_t steps = 0;            ///< that were missing
    size_t steps_known = 0;      ///< of them, so far
    double moves_after_s = 0.0;  ///< when all steps were known; 0 before
    double seconds = 0.0;        ///< that it took; 0 until all is done
    double left_s = -1.0;        ///< about as long from now; below 0: nothing can be said yet
  };
  Progress progress() const;
  /// Why it ended early: a sentence, or nothing.
  std::string trouble() const;
  /// Waits until it is done.
  void wait();
  /// Ends it early and waits for that. Not from a listener's thread.
  void cancel();

 private:
  struct Job {
    MissingMotion missing;
    bool cyclic = true;
    bool whole = false;  ///< one motion for all frames, beyond consecutive fields
    CarriedValues values = CarriedValues::kReference;  ///< with one motion
    std::shared_ptr<const MovingVolume> volume;        ///< with all its frames
  };
  void run(std::stop_token stop);
  void note_trouble(const Status& status);
  Status estimate(const Job& job, std::stop_token stop);
  Status take_pair(const Job& job, const PairMotion& pair);
  Status step_by_step(const Job& job, Frames& frames,
                      const std::shared_ptr<vulkan::Context>& context,
                      const EstimatorOptions& options, std::stop_token stop);
  Status whole(const Job& job, Frames& frames, const std::shared_ptr<vulkan::Context>& context,
               const EstimatorOptions& options, std::stop_token stop);

  std::vector<Job> jobs_;
  bool needs_whole_ = false;
  LiveMotionOptions options_;
  LiveMotionListener listener_;
  std::atomic<bool> done_{false};
  std::atomic<size_t> steps_{0}, known_{0};
  std::atomic<double> seconds_{0.0}, moves_after_s_{0.0};
  std::atomic<double> share_{0.0};    ///< of all steps
  std::atomic<int64_t> start_ns_{0};  ///< of the first step, steady clock; 0 before
  mutable std::mutex mutex_;
  std::string trouble_;
  std::jthread worker_;
};

}  // namespace palpate
