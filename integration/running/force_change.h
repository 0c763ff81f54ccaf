#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::running {

/// How fast a force changes, from the ticks of a loop that is not even. A tick that comes late is
/// followed by some that come at once, and a change over the time between two ticks would be
/// divided by nearly nothing. So a change is measured over a window of a millisecond that ends at a
/// tick, with the force between two ticks on a straight line. After a late tick, and at the
/// beginning, over what there is of the window, as if it had been whole. Late ticks are counted
/// apart. Its memory does not grow. One thread at a time.
class ForceChange {
 public:
  static constexpr double kWindow_s = 1e-3;

  /// A tick is late that comes more than one and a half periods after the last one.
  explicit ForceChange(double period_s = 1e-3) : late_s_(1.5 * period_s) {}
  /// force_n: sent dt_s after the last one. A dt_s that is not above 0 counts as 0.
  void add(double dt_s, const glm::dvec3& force_n);

  /// The largest change within a millisecond, N, of all ticks that were not late.
  double largest_n_per_ms() const { return largest_n_; }
  uint64_t late_ticks() const { return late_ticks_; }
  double latest_s() const { return latest_s_; }      ///< from the tick before to a late one
  double largest_late_n() const { return late_n_; }  ///< change of the force at a late tick

 private:
  struct TimedForce {
    double time_s = 0.0;
    glm::dvec3 force_n{0.0};
  };
  const TimedForce& at(size_t age) const {
    return ring_[(newest_ + ring_.size() - age) % ring_.size()];
  }

  double late_s_;
  std::array<TimedForce, 64> ring_;
  size_t newest_ = 0, count_ = 0;
  double largest_n_ = 0.0, latest_s_ = 0.0, late_n_ = 0.0;
  uint64_t late_ticks_ = 0;
};

}  // namespace palpate::running
