#include "module/haptics/proxy/pose_path.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "module/haptics/force_vector.h"

namespace palpate {
namespace {

constexpr double kStallS = 0.5;         // a longer wait does not count as a frame time
constexpr double kFirstDelayS = 0.025;  // before any wait is known: 60 Hz
constexpr double kLongestStretchS = 0.25;
constexpr double kLongestStepS = 0.05;  // of playing, after the caller itself was late
constexpr double kClosestS = 1e-3;      // knots nearer than a haptic frame are one
constexpr double kArrivedS = 1e-7;  // before the last knot, where the clock has braked to nothing
const glm::dvec3 kSlowestLimit(0.2, 2.0, 2.0);  // m, rad, log scale per s: always allowed

double seconds(int64_t ns) {
  return 1e-9 * double(ns);
}

bool same(const Transform& a, const Transform& b) {
  return a.translation_m == b.translation_m && a.rotation == b.rotation && a.scale == b.scale;
}

/// Unit quaternion on the side of `near`; false if it is no pose.
bool make_valid(Transform& t, const glm::dquat& near) {
  const double squared = glm::dot(t.rotation, t.rotation);
  if (!is_finite(t.translation_m) || !is_finite(t.scale) || !std::isfinite(squared)) return false;
  if (!(squared > 1e-12 && t.scale.x > 0.0 && t.scale.y > 0.0 && t.scale.z > 0.0)) return false;
  t.rotation = t.rotation / std::sqrt(squared);
  if (glm::dot(t.rotation, near) < 0.0) t.rotation = -t.rotation;
  return true;
}

/// Velocity at a knot between two pieces of constant velocity: the three-point derivative
/// (Catmull-Rom with the knots' own times). Where the pieces differ much it is kept below three
/// times the slower one, beyond which a cubic overshoots, and where they turn back it goes to zero.
glm::dvec3 between(glm::dvec3 before, double h_before, glm::dvec3 after, double h_after) {
  const double a = glm::length(before), b = glm::length(after);
  if (a == 0.0 || b == 0.0) return glm::dvec3(0.0);
  glm::dvec3 m = (h_after * before + h_before * after) / (h_before + h_after);
  const double cosine = glm::dot(before, after) / (a * b);
  const double most = 3.0 * std::min(a, b) * std::min(1.0, 1.0 + cosine);
  const double length = glm::length(m);
  return length > most ? m * (most / length) : m;
}

/// The same at the newest knot, from the two pieces before it.
glm::dvec3 beyond(glm::dvec3 earlier, double h_earlier, glm::dvec3 before, double h_before) {
  glm::dvec3 bend = (before - earlier) * (h_before / (h_earlier + h_before));
  const double most = 0.5 * glm::length(before), length = glm::length(bend);
  if (length > most) bend *= most / length;
  return before + bend;
}

}  // namespace

void FrameIntervals::add(double interval_s) {
  intervals_s_[size_t(next_)] = interval_s;
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
}

double FrameIntervals::inter_quartile_mean_s() const {
  constexpr int kMean = 12;
  const int n = std::min(count_, kMean);
  if (n == 0) return 0.0;
  // All are sorted, the unused ones to the end: GCC 14 wrongly warns where a part is sorted.
  std::array<double, kMean> sorted;
  sorted.fill(std::numeric_limits<double>::infinity());
  for (int k = 0; k < n; ++k)
    sorted[size_t(k)] = intervals_s_[size_t((next_ + kKept - 1 - k) % kKept)];
  std::sort(sorted.begin(), sorted.end());
  const int cut = n / 4;
  double sum = 0.0;
  for (int k = cut; k < n - cut; ++k) sum += sorted[size_t(k)];
  return sum / (n - 2 * cut);
}

double FrameIntervals::longest_s() const {
  const double limit = 3.0 * inter_quartile_mean_s();
  double longest = 0.0;
  for (int k = 0; k < count_; ++k)
    if (intervals_s_[size_t(k)] <= limit) longest = std::max(longest, intervals_s_[size_t(k)]);
  return longest;
}

MovingPose::MovingPose(PosePath path, const Transform& start)
    : path_(path), pose_(start), newest_(start), paper_from_(start) {
  make_valid(newest_, newest_.rotation);
  pose_ = paper_from_ = paper_to_ = knots_[0].pose = newest_;
  wanted_delay_s_ = kFirstDelayS;
  room_s_ = 0.2 * kFirstDelayS;
}

void MovingPose::add(const Transform& pose, int64_t time_ns) noexcept {
  Transform valid = pose;
  if ((newest_ns_ && time_ns <= *newest_ns_) || !make_valid(valid, newest_.rotation)) return;
  if (path_ == PosePath::kPaper && newest_ns_) intervals_.add(seconds(time_ns - *newest_ns_));
  if (path_ == PosePath::kSmooth) {
    if (!newest_ns_) {
      epoch_ns_ = time_ns;
      last_seen_s_ = -2.0 * kStallS;
      knots_[0].time_s = play_s_ = last_seen_s_;
    }
    add_knot(valid, time_s(time_ns));
  }
  newest_ = valid;
  newest_ns_ = time_ns;
  fresh_ = true;
}

Transform MovingPose::at(int64_t now_ns) noexcept {
  if (now_ns_ && now_ns <= *now_ns_) return pose_;
  const double dt_s = now_ns_ ? std::min(seconds(now_ns - *now_ns_), kLongestStepS) : 0.0;
  switch (path_) {
    case PosePath::kExact:
      pose_ = newest_;
      break;
    case PosePath::kPaper:
      if (fresh_) start_for_newest(now_ns);
      pose_ = paper_pose(now_ns);
      break;
    case PosePath::kSmooth:
      if (newest_ns_ && (fresh_ || !resting_)) play(time_s(now_ns), dt_s);
      pose_ = resting_ ? newest_ : curve_.pose(share());
      break;
  }
  now_ns_ = now_ns;
  fresh_ = false;
  return pose_;
}

double MovingPose::delay_s() const noexcept {
  return path_ == PosePath::kSmooth && now_ns_ && newest_ns_ ? time_s(*now_ns_) - play_s_ : 0.0;
}

/// From the pose that is shown now to the newest one, for the mean frame time.
void MovingPose::start_for_newest(int64_t now_ns) {
  paper_from_ = paper_pose(now_ns);
  paper_to_ = newest_;
  paper_start_ns_ = now_ns;
  const double mean = intervals_.inter_quartile_mean_s();
  paper_duration_s_ = mean > 0.0 ? mean : 1.0 / 60.0;
}

/// (17) to (20): lerp, slerp, lerp.
Transform MovingPose::paper_pose(int64_t now_ns) const {
  const double share =
      paper_duration_s_ > 0.0 ? seconds(now_ns - paper_start_ns_) / paper_duration_s_ : 1.0;
  if (share >= 1.0) return paper_to_;
  Transform t;
  t.translation_m = glm::mix(paper_from_.translation_m, paper_to_.translation_m, share);
  t.rotation = between(paper_from_.rotation, paper_to_.rotation, share);
  t.scale = glm::mix(paper_from_.scale, paper_to_.scale, share);
  return t;
}

double MovingPose::time_s(int64_t now_ns) const {
  return seconds(now_ns - epoch_ns_);
}

void MovingPose::add_knot(const Transform& pose, double time_s) {
  // From rest the path begins where it is shown, unless this pose follows another that at() has not
  // seen yet.
  if (resting_ && !fresh_) {
    knots_[0] = {play_s_, last().pose};
    knot_count_ = 1;
    target_ = 0;
  }
  // The same pose again: it rests on.
  if (resting_ && knot_count_ == 1 && same(pose, knots_[0].pose)) {
    knots_[0].time_s = play_s_ = time_s;
    return;
  }
  // Poses too near to each other in time are one.
  const double gap_s = time_s - last().time_s;
  if (knot_count_ > 1 && gap_s < kClosestS) {
    last().pose = pose;
    return;
  }
  shift(knot_count_, gap_s - duration_for(pose, gap_s));
  if (knot_count_ == kKnots) thin_out();
  knots_[size_t(knot_count_++)] = {time_s, pose};
}

/// How long the way from the newest pose to this one is to take. Its own time, but: from rest as
/// long as the delay that will be needed; after a pause not all of it; and never so short that it
/// would be a throw.
double MovingPose::duration_for(const Transform& pose, double gap_s) {
  const PoseRate way = difference(last().pose, pose);
  const glm::dvec3 length(glm::length(way.translation), glm::length(way.rotation),
                          glm::length(way.log_scale));
  const glm::dvec3 needed = length / glm::max(kSlowestLimit, 3.0 * recent_speed_);
  double duration = std::min(std::max({needed.x, needed.y, needed.z}), kLongestStretchS);
  const bool pause = gap_s > 2.0 * wanted_delay_s_;
  const bool from_rest = resting_ && knot_count_ == 1;
  duration = std::max(duration, from_rest || pause ? wanted_delay_s_ : gap_s);
  recent_speed_ = glm::max(length / duration, 0.7 * recent_speed_);
  return duration;
}

/// Moves the first knots, and what is shown, in time: the path stays what it is.
void MovingPose::shift(int knots, double by_s) {
  for (int k = 0; k < knots; ++k) knots_[size_t(k)].time_s += by_s;
  play_s_ += by_s;
  curve_start_s_ += by_s;
}

/// Makes room when a burst brings more than there is place for: every other pose that is not yet on
/// its way to be shown is left out.
void MovingPose::thin_out() {
  int kept = target_ + 1;
  for (int k = target_ + 2; k < knot_count_ - 1; k += 2) knots_[size_t(kept++)] = knots_[size_t(k)];
  knots_[size_t(kept++)] = knots_[size_t(knot_count_ - 1)];
  knot_count_ = kept;
}

/// Tangents look two knots back.
void MovingPose::drop_passed() {
  const int drop = target_ - 2;
  if (drop <= 0) return;
  std::copy(knots_.begin() + drop, knots_.begin() + knot_count_, knots_.begin());
  knot_count_ -= drop;
  target_ -= drop;
}

/// What the waits for poses say about the delay that is needed.
void MovingPose::learn(double now_s) {
  const double wait = now_s - last_seen_s_;
  if (wait < kStallS) intervals_.add(std::max(wait, kClosestS));
  last_seen_s_ = time_s(*newest_ns_);
  if (intervals_.count() == 0) return;
  const double longest = intervals_.longest_s(), margin = std::max(0.4 * longest, 0.004);
  wanted_delay_s_ = longest + margin;
  room_s_ = 0.9 * margin;
}

PoseRate MovingPose::tangent(int knot) const {
  const auto piece = [&](int k) {
    const Knot &a = knots_[size_t(k - 1)], &b = knots_[size_t(k)];
    return (1.0 / (b.time_s - a.time_s)) * difference(a.pose, b.pose);
  };
  const auto length = [&](int k) {
    return knots_[size_t(k)].time_s - knots_[size_t(k - 1)].time_s;
  };
  const PoseRate before = piece(knot);
  const double h = length(knot);
  if (knot + 1 < knot_count_) {
    const PoseRate after = piece(knot + 1);
    const double h_after = length(knot + 1);
    return {between(before.translation, h, after.translation, h_after),
            between(before.rotation, h, after.rotation, h_after),
            between(before.log_scale, h, after.log_scale, h_after)};
  }
  if (knot < 2) return before;
  const PoseRate earlier = piece(knot - 1);
  const double h_earlier = length(knot - 1);
  return {beyond(earlier.translation, h_earlier, before.translation, h),
          beyond(earlier.rotation, h_earlier, before.rotation, h),
          beyond(earlier.log_scale, h_earlier, before.log_scale, h)};
}

/// The curve from what is shown now, at this pose and rate, to the target.
void MovingPose::bend_to_target(const Transform& from, const PoseRate& rate) {
  curve_ = PoseCurve(from, rate, target().pose, tangent(target_), target().time_s - play_s_);
  curve_start_s_ = play_s_;
}

/// New poses came: from the pose and velocity that are shown now to a knot whose tangent is known
/// better.
void MovingPose::bend_from_here() {
  Transform from = knots_[0].pose;
  PoseRate rate;
  if (resting_) {
    if (knot_count_ == 1) return;
    target_ = 1;
    speed_ = 1.0;
    resting_ = false;
  } else {
    from = curve_.pose(share());
    rate = curve_.rate(share());
  }

  // Too near to be reached smoothly: on to the next one, or give it time.
  const auto room = [&] { return target().time_s - play_s_; };
  while (room() < room_s_ && target_ + 1 < knot_count_) ++target_;
  if (room() < room_s_) shift(target_, room() - room_s_);

  // Where the clock brakes, or has braked, its speed is put into the path instead.
  if (speed_ < 0.85 || speed_ > fastest_before_end()) {
    rate = speed_ * rate;
    speed_ = 1.0;
  }
  bend_to_target(from, rate);
  drop_passed();
}

/// The largest rate of the clock so near to the last known pose: it brakes at a constant rate, in
/// the end like exp(-2 t / room_s_).
double MovingPose::fastest_before_end() {
  const double left = (last().time_s - play_s_) / room_s_;
  return left > 0.25 ? std::sqrt(left) : 2.0 * left;
}

/// The clock's rate: 1 while the delay is about as long as it should be.
double MovingPose::next_speed(double now_s, double dt_s) {
  const double behind = now_s - play_s_ - wanted_delay_s_;
  if (behind > 0.25 * wanted_delay_s_) catching_up_ = true;
  if (behind < 0.10 * wanted_delay_s_) catching_up_ = false;
  double wanted = 1.0;
  if (behind < 0.0) wanted += std::max(behind / 0.1, -0.1);
  if (catching_up_) wanted += std::clamp((behind - 0.05 * wanted_delay_s_) / 0.2, 0.0, 0.5);
  const double change = dt_s / 0.03;
  const double speed = std::clamp(wanted, speed_ - change, speed_ + change);
  return std::min(speed, fastest_before_end());
}

/// A stamp far in the future would block all that come before it: it becomes now.
void MovingPose::keep_in_reach(double now_s) {
  const double newest_s = last().time_s;
  if (newest_s <= now_s + kStallS) return;
  shift(knot_count_, now_s - newest_s);
  newest_ns_ = epoch_ns_ + int64_t(1e9 * now_s);
}

void MovingPose::play(double now_s, double dt_s) {
  if (fresh_) {
    keep_in_reach(now_s);
    learn(now_s);
    bend_from_here();
  }
  if (resting_) return;

  // The clock goes on, and with it the curve from knot to knot.
  speed_ = next_speed(now_s, dt_s);
  play_s_ += speed_ * dt_s;
  while (target_ + 1 < knot_count_ && play_s_ >= target().time_s) {
    const double shown = play_s_;
    const Transform from = target().pose;
    const PoseRate rate = tangent(target_);
    play_s_ = target().time_s;
    ++target_;
    bend_to_target(from, rate);
    play_s_ = shown;
    drop_passed();
  }

  // At the last known pose it rests.
  const bool at_last = target_ + 1 == knot_count_;
  if (at_last && (curve_.is_still() || play_s_ > target().time_s - kArrivedS)) {
    play_s_ = target().time_s;
    resting_ = true;
  }
}

}  // namespace palpate
