#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "compute/motion/estimator.h"
#include "integration/app/felt_scene.h"
#include "integration/app/progress.h"
#include "integration/app/session.h"
#include "module/scene/motion_map.h"

namespace palpate::app {

/// Estimates the motion that no file gives, while the data are already felt: on threads of low
/// priority, so that the hand comes first. Each step is handed over as soon as it is known.
class LiveMotion {
 public:
  using OnStep =
      std::function<Status(size_t volume, size_t step, std::shared_ptr<const MotionMap> map)>;
  /// The volume with all its steps from one motion, and one frame's values carried by it.
  using OnWhole = std::function<Status(size_t volume, std::shared_ptr<const MovingVolume> carried)>;

  /// Starts at once if anything is missing. Steps are handed over one by one as pairs of frames are
  /// done; then, unless its own values are wanted, the whole sequence with one motion. Both come
  /// from a thread of its own; the console must outlive this.
  LiveMotion(const FeltScene& scene, const DeviceOptions& device, const std::string& preset,
             OnStep on_step, OnWhole on_whole, Console& console);
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
  size_t steps() const { return steps_; }                  ///< that were missing
  size_t steps_known() const { return known_; }            ///< of them, so far
  double moves_after_s() const { return moves_after_s_; }  ///< all steps were known; 0 before
  double seconds() const { return seconds_; }              ///< it took; 0 until all is done
  /// One motion for the whole sequence is found, or looked for, after the steps.
  bool finds_whole() const;
  /// "motion 3 of 20 steps, 25 s left"; nothing once it is done.
  std::string text() const;
  /// Why it ended early: a sentence, or nothing.
  std::string trouble() const;
  /// Waits until it is done.
  void wait();

 private:
  struct Job {
    MissingMotion missing;
    bool cyclic = true;
    bool whole = false;  ///< one motion for all frames, beyond consecutive fields
    CarriedValues values = CarriedValues::kReference;  ///< with one motion
    std::shared_ptr<const MovingVolume> volume;        ///< with all its frames
  };
  void run(std::stop_token stop);
  Status estimate(const Job& job, std::stop_token stop);
  Status take_pair(const Job& job, const PairMotion& pair);
  Status step_by_step(const Job& job, Frames& frames,
                      const std::shared_ptr<vulkan::Context>& context,
                      const EstimatorOptions& options, std::stop_token stop);
  Status whole(const Job& job, Frames& frames, const std::shared_ptr<vulkan::Context>& context,
               const EstimatorOptions& options, std::stop_token stop);

  std::vector<Job> jobs_;
  bool needs_whole_ = false;
  DeviceOptions device_;
  std::string preset_;
  OnStep on_step_;
  OnWhole on_whole_;
  Console& console_;
  std::atomic<bool> done_{false};
  std::atomic<size_t> steps_{0}, known_{0};
  std::atomic<double> seconds_{0.0}, moves_after_s_{0.0};
  std::atomic<double> share_{0.0};    ///< of all steps
  std::atomic<int64_t> start_ns_{0};  ///< of the first step, steady clock; 0 before
  mutable std::mutex mutex_;
  std::string trouble_;
  std::jthread worker_;
};

}  // namespace palpate::app
