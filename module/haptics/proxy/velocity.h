#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate {

/// The hand's velocity from positions that come with their times: the slope of the least-squares
/// line through the samples of the last 15 ms. It lags by half the window for a hand that
/// accelerates and is exact for one that does not; an encoder step of d makes an error of at most
/// 1.5 d / window. A value: no clock, no allocation; real-time safe.
class VelocityEstimate {
 public:
  /// Samples kept; those that come faster than window / (capacity - 1) are thinned out, so that the
  /// window stays full at any rate.
  static constexpr int kCapacity = 64;
  explicit VelocityEstimate(double window_s = 0.015) noexcept;

  /// Takes a sample and returns the velocity, m/s, in the positions' space. A time that is not
  /// later than the last (a position seen twice, jitter) or a position that is not finite is
  /// ignored; a time more than the window earlier means that the clock was set back: everything
  /// starts anew. After a gap longer than the window the last sample before it is the other end of
  /// the line.
  glm::dvec3 add(int64_t time_ns, glm::dvec3 position_m) noexcept;

  /// 0 until there are two samples.
  glm::dvec3 velocity_m_per_s() const noexcept { return velocity_; }
  void reset() noexcept;

 private:
  struct TimedPosition {
    int64_t time_ns = 0;
    glm::dvec3 position_m{0.0};
  };
  const TimedPosition& back(int age) const noexcept;  // 0 is the newest
  glm::dvec3 slope() const noexcept;

  std::array<TimedPosition, kCapacity> ring_{};
  int newest_ = 0, count_ = 0;
  uint64_t window_ns_;
  glm::dvec3 velocity_{0.0};
};

}  // namespace palpate
