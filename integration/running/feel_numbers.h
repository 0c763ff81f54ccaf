#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "integration/running/force_change.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate::running {

/// What is stored of a tick for summary and pictures. Space: force of the device, places of the
/// world.
struct TickRow {
  double time_s = 0.0;  ///< since the first tick
  double dt_s = 0.0;
  glm::dvec3 force_n{0.0};   ///< sent to the device
  glm::dvec3 wanted_n{0.0};  ///< of the spring
  glm::dvec3 probe_m{0.0}, proxy_m{0.0};
  double pointer = 0.0;  ///< frame + phase of the first moving volume
  double residual_m = 0.0;
  double scene_energy_j = 0.0;
  Cause cause = Cause::kNone;
  DeviceFault fault = DeviceFault::kNone;
  uint8_t newton_steps = 0;
  bool in_contact = false;
  bool frozen = false;
};

/// A cause that was active, and for how long.
struct CauseTime {
  Cause cause = Cause::kNone;
  DeviceFault fault = DeviceFault::kNone;
  double seconds = 0.0;
  double from_s = 0.0;  ///< first
};

/// A limiter that held force back, and how much.
struct LimiterTime {
  Limiter limiter = Limiter::kOff;
  double seconds = 0.0;  ///< with more than kHeldBack_n
  double most_n = 0.0;
};
inline constexpr double kHeldBack_n = 0.005;

/// Numbers of a run, computed from its ticks.
struct FeelNumbers {
  double seconds = 0.0, touched_s = 0.0;
  double most_force_n = 0.0, mean_force_n = 0.0;  ///< while touching
  double deepest_m = 0.0;  ///< the hand behind the surface: how far the spring was stretched
  /// largest change of the force that reached the hand, without late ticks: see ForceChange
  double steepest_n_per_ms = 0.0;
  uint64_t late_ticks = 0;
  double latest_s = 0.0, late_change_n = 0.0;  ///< from tick to tick, where one was late
  double worst_residual_m = 0.0;
  int most_newton_steps = 0;
  uint64_t frozen = 0;            ///< ticks whose motion could not be inverted
  std::vector<CauseTime> causes;  ///< all but none, longest first
  double hand_work_j = 0.0;       ///< that all forces did on the hand
  std::vector<LimiterTime> held;  ///< those with some seconds, in the order of the limiters
};

/// Computes the numbers of a run tick by tick; its memory does not grow. One thread at a time.
class FeelCounter {
 public:
  void add(const TickRow& row, const ForceLedger& ledger, double hand_work_j);
  FeelNumbers numbers() const;

 private:
  std::array<LimiterTime, kLimiters> held_;
  FeelNumbers sums_;  ///< mean_force_n contains the integral of the force over time, N s
  ForceChange change_;
};

/// The course of a run for pictures, in memory that does not grow: every tick of the first half
/// minute. Of a longer run evenly spaced groups of ticks, each with its smallest and its largest
/// force, so that no peak is lost. A tick with a cause counts as larger than any without one. One
/// thread at a time.
class TickHistory {
 public:
  static constexpr size_t kMostRows = 32768;  // 6 MB

  TickHistory();
  void add(const TickRow& row);
  /// In the order of time; without the group that is not yet complete.
  const std::vector<TickRow>& rows() const { return rows_; }

 private:
  static bool is_larger(const TickRow& a, const TickRow& b);
  /// Writes both in the order of time; returns the end.
  static TickRow* put(const TickRow& smallest, const TickRow& largest, TickRow* to);
  void thin();

  std::vector<TickRow> rows_;
  size_t group_ = 1;  ///< ticks that become one or two rows
  size_t count_ = 0;  ///< ticks of the group so far
  TickRow smallest_, largest_;
};

}  // namespace palpate::running
