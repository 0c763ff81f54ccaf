#pragma once

#include <palpate.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>

namespace palpate::godot {

using HandPoint = std::array<double, 3>;

/// The hand of a node as a force device of palpate's haptic thread. The node's thread gives places
/// at the rate of its frames; the haptic thread asks a thousand times a second. Between them is a
/// triple buffer, so neither waits. A critically damped spring follows the place,
///   x'' = w^2 (target - x) - 2 w x',
/// solved exactly for each tick, at most at the speed of a quick hand: a place that jumps from
/// frame to frame would count as a hand that is too fast, and the force would end.
class HandLink {
 public:
  /// The node's thread: where the hand is, m in the device's space; null: there is no hand, and
  /// the force goes to zero.
  void hold(const HandPoint* place_m) noexcept {
    places_[written_] = place_m ? HeldPlace{*place_m, true} : HeldPlace{};
    written_ = newest_.exchange(written_ | kFresh, std::memory_order_acq_rel) & ~kFresh;
  }

  /// PalDevice.exchange; `user` is a HandLink. Real-time safe.
  static void exchange(void* user, const double*, PalReading* reading) {
    static_cast<HandLink*>(user)->read(*reading);
  }

  /// Within the device's workspace, m.
  double reach_m = 0.08;
  /// CLOCK_MONOTONIC, ns.
  int64_t (*now_ns)() = nullptr;

 private:
  struct HeldPlace {
    HandPoint place_m{};
    bool is_there = false;
  };
  static constexpr uint32_t kFresh = 4;

  void read(PalReading& reading) noexcept {
    if (newest_.load(std::memory_order_acquire) & kFresh)
      read_ = newest_.exchange(read_, std::memory_order_acq_rel) & ~kFresh;
    const HeldPlace& held = places_[read_];
    reading.time_ns = now_ns();
    const double dt_s = 1e-9 * double(reading.time_ns - last_ns_);
    last_ns_ = reading.time_ns;
    if (!held.is_there) {
      reading.fault = PAL_FAULT_NOT_OPENED;
      follows_ = false;
      return;
    }
    if (follows_) {
      follow(held.place_m, dt_s);
    } else {
      // A hand that comes from elsewhere begins there.
      at_m_ = held.place_m;
      velocity_m_per_s_ = {};
      follows_ = true;
    }
    reading.is_fresh = 1;
    const double shorter = std::min(1.0, reach_m / std::max(1e-9, length(at_m_)));
    for (size_t a = 0; a < 3; ++a) reading.position_m[a] = shorter * at_m_[a];
  }

  void follow(const HandPoint& target_m, double dt_s) noexcept {
    constexpr double kSettle_per_s = 60.0, kSpeed_m_per_s = 0.75;
    HandPoint away{};
    for (size_t a = 0; a < 3; ++a) away[a] = at_m_[a] - target_m[a];
    // The pull is bounded as if the target were never further away than this.
    const double most_m = 2.0 * kSpeed_m_per_s / kSettle_per_s;
    const double shorter = std::min(1.0, most_m / std::max(1e-9, length(away)));
    const double decay = std::exp(-kSettle_per_s * dt_s);
    for (size_t a = 0; a < 3; ++a) {
      const double counted_m = at_m_[a] - shorter * away[a];
      const double slope = velocity_m_per_s_[a] + kSettle_per_s * shorter * away[a];
      at_m_[a] = counted_m + (shorter * away[a] + slope * dt_s) * decay;
      velocity_m_per_s_[a] = (velocity_m_per_s_[a] - kSettle_per_s * slope * dt_s) * decay;
    }
  }

  static double length(const HandPoint& v) noexcept {
    return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }

  std::array<HeldPlace, 3> places_;
  uint32_t written_ = 0, read_ = 1;
  std::atomic<uint32_t> newest_{2};
  // The haptic thread's own.
  HandPoint at_m_{}, velocity_m_per_s_{};
  int64_t last_ns_ = 0;
  bool follows_ = false;
};

}  // namespace palpate::godot
