#pragma once

#include <array>
#include <cstdint>

#include "module/haptics/proxy/pose_curve.h"
#include "module/scene/scene_spec.h"
#include "module/scene/transform.h"

namespace palpate {

/// The last frame times of a source, s. A value; real-time safe.
class FrameIntervals {
 public:
  static constexpr int kKept = 24;
  void add(double interval_s);
  int count() const { return count_; }
  /// Equation (21): mean of the middle half of the last 12; 0 if there are none.
  double inter_quartile_mean_s() const;
  /// The longest of them that is not a stall; a stall is longer than 3 times the inter-quartile
  /// mean.
  double longest_s() const;

 private:
  std::array<double, kKept> intervals_s_{};
  int count_ = 0, next_ = 0;
};

/// The pose of a volume at every haptic frame, from poses that arrive at irregular times: section 5
/// of the method. A value: no clock, no allocation. `add` what arrives (also several at once, also
/// late or twice), then `at` the haptic frame's time, rising. One thread; real-time safe.
///
/// kPaper: equations (17) to (21): from the current pose to the new one by lerp, slerp, lerp over
/// the estimated frame time, then hold. Where frame times vary, velocity jumps: the paper's tick.
///
/// kSmooth: a C1 path through the poses at their own times, played a little late (delay_s()): by
/// the longest recent wait for a pose and 40 % more. Constant velocity is followed exactly however
/// the frame times vary. The delay changes by playing up to 10 % slower, or faster by at most the
/// half while far behind. Where poses stay away, the clock brakes before the last pose, so that it
/// comes to rest there without overshoot. A pause of the source, and poses that leap, are replayed
/// no faster than three times the recent speed, or within 0.25 s.
///
/// kExact: the newest pose, as it is.
class MovingPose {
 public:
  explicit MovingPose(PosePath path, const Transform& start);

  /// A pose that holds at time_ns (monotonic). Times that do not rise are ignored, and so is what
  /// is no pose (not finite, a scale not above 0). Any sign and length of the quaternion.
  void add(const Transform& pose, int64_t time_ns) noexcept;
  /// The pose for this haptic frame. A time that does not rise gives the last pose again.
  Transform at(int64_t now_ns) noexcept;
  /// True once nothing has moved for so long that it stands still: the volume may take the still
  /// path.
  bool at_rest() const noexcept;
  /// How far in the past the pose is that at() gave last, s: 0 for kExact; kPaper's is not defined
  /// by time stamps and is given as the estimated frame time.
  double delay_s() const noexcept;

 private:
  static constexpr int kKnots = 16;
  struct Knot {
    double time_s = 0.0;  ///< of playing; the newest one's is its own time stamp
    Transform pose;
  };

  void add_knot(const Transform& pose, double time_s);
  double duration_for(const Transform& pose, double gap_s);
  void thin_out();
  void drop_passed();
  void shift(int knots, double by_s);
  void learn(double now_s);
  void bend_from_here();
  void bend_to_target(const Transform& from, PoseRate rate);
  PoseRate tangent(int knot) const;
  double braked(double left_s) const;
  double next_speed(double now_s, double dt_s);
  void play(double now_s, double dt_s);
  double paper_share(int64_t now_ns) const;
  Transform paper_pose(int64_t now_ns) const;

  PosePath path_;
  Transform pose_;         ///< what at() gave last
  Transform newest_;       ///< what add() took last
  int64_t newest_ns_ = 0;  ///< and its time
  int64_t now_ns_ = 0;     ///< of the last at()
  int64_t moved_ns_ = 0;   ///< when pose_ last changed
  bool timed_ = false;     ///< newest_ns_ is known: a pose has come
  bool asked_ = false;     ///< now_ns_ is known
  bool fresh_ = false;     ///< poses came since the last at()
  bool ever_moved_ = false;
  FrameIntervals intervals_;  ///< kPaper: between time stamps; kSmooth: waits for a pose

  // kPaper: from this pose to that one, since then, for so long.
  Transform paper_from_, paper_to_;
  int64_t paper_start_ns_ = 0;
  double paper_duration_s_ = 0.0;

  // kSmooth. Times in s since epoch_ns_.
  int64_t epoch_ns_ = 0;
  std::array<Knot, kKnots> knots_;
  int knot_count_ = 1;
  int target_ = 0;  ///< the knot that curve_ leads to
  PoseCurve curve_;
  double curve_start_s_ = 0.0, curve_per_s_ = 0.0;
  PoseRate target_rate_;  ///< at the end of curve_
  double play_s_ = 0.0;   ///< the time that is shown
  double speed_ = 1.0;    ///< of playing
  bool resting_ = true;   ///< at the newest knot, without velocity
  bool catching_up_ = false;
  double last_seen_s_ = 0.0;  ///< time stamp of the newest pose at the last at()
  double wanted_delay_s_, room_s_, braking_s_ = 1.0, delay_s_ = 0.0;
  glm::dvec3 recent_speed_{0.0};  ///< of the source: m, rad, log scale per s
};

}  // namespace palpate
