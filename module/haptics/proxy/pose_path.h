#pragma once

#include <array>
#include <cstdint>
#include <optional>

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
/// the frame times vary. Its parts, by the cases that need them:
/// - New poses come: the piece that is played is replaced by one from the pose and velocity that
///   are shown to a knot whose tangent is now known better (bend_from_here).
/// - Frame times vary: the delay is learned from the waits for poses (learn). It changes by playing
///   up to 10 % slower, or faster by at most the half while far behind (next_speed).
/// - Poses are late or stay away: the clock brakes before the last one, so that it comes to rest
///   there without overshoot (fastest_before_end). If a pose comes meanwhile, it goes on from the
///   velocity that is shown.
/// - Many poses come at once: those in one haptic frame are one knot, and of more than there is
///   place for every other one is left out (add_knot, thin_out).
/// - A source begins to move, goes on after a pause, or leaps: the way takes as long as the delay,
///   or more, so that it is no faster than three times the recent speed, or takes 0.25 s. A fast
///   source is followed even if it sends each pose twice (duration_for).
/// - A time stamp is far in the future: it counts as now, so that later ones are not blocked
///   (keep_in_reach).
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
  /// kSmooth, while poses come: how far in the past the pose is that at() gave last, s.
  double delay_s() const noexcept;

 private:
  static constexpr int kKnots = 16;
  struct Knot {
    double time_s = 0.0;  ///< of playing; the newest one's is its own time stamp
    Transform pose;
  };

  // kPaper.
  Transform paper_pose(int64_t now_ns) const;
  void start_for_newest(int64_t now_ns);

  // kSmooth: what add() does, what at() does, and what both need.
  void add_knot(const Transform& pose, double time_s);
  double duration_for(const Transform& pose, double gap_s);
  void thin_out();
  void play(double now_s, double dt_s);
  void keep_in_reach(double now_s);
  void learn(double now_s);
  void bend_from_here();
  void bend_to_target(const Transform& from, const PoseRate& rate);
  void drop_passed();
  PoseRate tangent(int knot) const;
  double next_speed(double now_s, double dt_s);
  double fastest_before_end();
  void shift(int knots, double by_s);
  double time_s(int64_t now_ns) const;
  double share() const { return curve_.share(play_s_ - curve_start_s_); }
  Knot& last() { return knots_[size_t(knot_count_ - 1)]; }
  Knot& target() { return knots_[size_t(target_)]; }

  PosePath path_;
  Transform pose_;                    ///< what at() gave last
  std::optional<int64_t> now_ns_;     ///< and when
  Transform newest_;                  ///< what add() took last
  std::optional<int64_t> newest_ns_;  ///< and its time
  bool fresh_ = false;                ///< poses came since the last at()
  FrameIntervals intervals_;          ///< kPaper: between time stamps; kSmooth: waits for a pose

  // kPaper: from this pose to that one, since then, for so long.
  Transform paper_from_, paper_to_;
  int64_t paper_start_ns_ = 0;
  double paper_duration_s_ = 0.0;

  // kSmooth. Times in s since the first pose's, epoch_ns_. The poses that are known, and the piece
  // of the path that is played:
  int64_t epoch_ns_ = 0;
  std::array<Knot, kKnots> knots_;
  int knot_count_ = 1;
  int target_ = 0;  ///< the knot that curve_ leads to
  PoseCurve curve_;
  double curve_start_s_ = 0.0;
  // The clock:
  double play_s_ = 0.0;  ///< the time that is shown
  double speed_ = 1.0;   ///< of playing
  bool resting_ = true;  ///< at the newest knot, without velocity
  bool catching_up_ = false;
  // What is known of the source:
  double last_seen_s_ = 0.0;        ///< time stamp of the newest pose at the last at()
  double wanted_delay_s_, room_s_;  ///< the delay, and the part of it in which the clock may brake
  glm::dvec3 recent_speed_{0.0};    ///< m, rad, log scale per s
};

}  // namespace palpate
