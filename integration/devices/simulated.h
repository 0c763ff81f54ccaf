#pragma once

#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "integration/devices/held_mass.h"
#include "integration/devices/scripted_path.h"
#include "module/haptics/device.h"
#include "module/haptics/servo/servo_clock.h"

namespace palpate::devices {

/// What a simulated device is like. Defaults: a Falcon-sized device in one measured hand.
struct SimulatedOptions {
  MassProperties body{
      .mass_kg = 0.15, .damping_n_s_per_m = 2.0, .coulomb_n = 0.03, .hand = kHumanHand};
  ScriptedPath path;  ///< where the hand means to be; also where the grip starts
  double lets_go_at_s = std::numeric_limits<double>::infinity();  ///< no hand from then on

  double resolution_m = 38e-6;  ///< of the encoder, rounded to nearest; 0: exact
  double read_delay_s = 0.0;    ///< age of a position when the exchange gives it
  double force_delay_s = 0.0;   ///< from the exchange to the motors, at most 50 ms
  /// a position is older by up to this, evenly spread, and the device does not know
  double jitter_s = 0.0;
  double lost_share = 0.0;        ///< of exchanges that reach nothing and bring nothing
  double silence_s = 0.1;         ///< the motors go off when no force came for so long
  double max_force_n = 8.0;       ///< the motors clamp to this, keeping the direction
  double max_slew_n_per_s = 0.0;  ///< of the motors; 0: none
  glm::dvec3 workspace_centre_m{0.0};
  double workspace_radius_m = 0.05;  ///< a hard stop
  int buttons = 4;
  GripReading grip;           ///< as it is held, all the time
  uint32_t seed = 1;          ///< of jitter and losses
  double sub_step_s = 50e-6;  ///< longest step of the physics
  /// True: time passes by itself (the monotonic clock), as the servo thread needs it. False: time
  /// passes by step() alone, as fast as the machine can.
  bool real_time = false;
  /// With real_time: the clock that is meant, if it is not the monotonic one. Borrowed.
  ServoClock* clock = nullptr;
};

/// What such a device is, without one.
DeviceInfo info_of(const SimulatedOptions& options);

/// A simulated device in a simulated hand. The same seed and the same times of exchange give the
/// same bits, whether time passes by itself or by step().
class SimulatedDevice : public ForceDevice {
 public:
  explicit SimulatedDevice(SimulatedOptions options);

  DeviceInfo info() const override { return info_of(options_); }
  /// Real-time safe. After a pause of more than half a second only the last half second is done.
  DeviceReading exchange(const DeviceCommand& command) noexcept override;

  /// Lets time pass; only with real_time = false.
  void step(double dt_s) noexcept;
  /// Time of the device's own monotonic clock: with real_time = false it starts at 0.
  int64_t now_ns() const { return now_ns_; }
  /// The same exchange at a given time, not before the last one: what both kinds of time use.
  DeviceReading exchange_at(const DeviceCommand& command, int64_t now_ns) noexcept;

  // The truth, for tests and charts.
  double time_s() const { return double(now_ns_ - start_ns_) * 1e-9; }
  glm::dvec3 true_position_m() const { return body_.position_m(); }
  glm::dvec3 true_velocity_m_per_s() const { return body_.velocity_m_per_s(); }
  glm::dvec3 motor_force_n() const { return motor_n_; }
  double motor_work_j() const { return motor_work_j_; }  ///< given by the motors since the start

 private:
  struct Past {
    int64_t time_ns;
    glm::dvec3 position_m, velocity_m_per_s;
  };
  struct Coming {
    int64_t time_ns;
    glm::dvec3 force_n;
  };
  void advance_to(int64_t time_ns) noexcept;
  void move(int64_t until_ns) noexcept;
  void remember() noexcept;
  glm::dvec3 wanted_n() const noexcept;
  void take_due_forces() noexcept;
  glm::dvec3 position_at(int64_t time_ns) const noexcept;
  glm::dvec3 clamped(glm::dvec3 force_n) const noexcept;
  double draw() noexcept;
  /// Time of the clock that is meant with real_time.
  int64_t clock_ns() const noexcept;

  SimulatedOptions options_;
  HeldMass body_;
  std::mt19937 random_;
  std::vector<Past> past_;      ///< ring
  std::vector<Coming> coming_;  ///< ring, rising times
  size_t past_end_ = 0, past_count_ = 0, coming_begin_ = 0, coming_count_ = 0;
  int64_t start_ns_ = 0, now_ns_ = 0, last_force_ns_ = 0, sub_step_ns_, lets_go_ns_;
  bool gripped_ = true;
  glm::dvec3 target_n_{0.0}, motor_n_{0.0};
  double motor_work_j_ = 0.0;
  DeviceReading last_;
};

}  // namespace palpate::devices
