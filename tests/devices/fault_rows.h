#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>

#include "tests/devices/fault_rig.h"

namespace palpate::devices::test {

enum class Ends {
  /// By itself after row.recover was called.
  kRecovers,
  kStays,  ///< at zero
  /// No fault: the force goes on.
  kTolerated,
  kFades,  ///< no cut: the scene's own force goes to zero without a step
};

/// A fault in contact, and its required result. A Rig is a DeviceRig with Options, and patient(),
/// the options of most rows.
template <class Rig>
struct FaultRow {
  const char* name;
  std::function<void(Rig&)> inject;
  Cause cause = Cause::kDevice;
  DeviceFault fault = DeviceFault::kNone;
  /// Ticks from the fault to its detection; 0: no limit.
  int within = Rig::kWithin;
  Ends ends = Ends::kRecovers;
  /// The fault that is reported later, before recovery.
  DeviceFault then = DeviceFault::kNone;
  /// Ends the fault; null: nothing to do.
  std::function<void(Rig&)> recover = nullptr;
  /// More checks at the end; null: none.
  std::function<void(Rig&)> after = nullptr;
  typename Rig::Options options = Rig::patient();
};

template <class Rig>
void PrintTo(const FaultRow<Rig>& row, std::ostream* out) {
  *out << row.name;
}

template <class Rig>
std::string name_of_row(const testing::TestParamInfo<FaultRow<Rig>>& row) {
  return row.param.name;
}

inline constexpr int kRampTicks = 20;   // SafetyOptions::off_ramp_s
inline constexpr double kSlew_n = 2.0;  // SafetyOptions::max_slew_n_per_s, per ms
// The ramp is a product of doubles; a force that the loop repeats is exact.
inline constexpr double kRounding_n = 1e-9;

/// Whether a tick got a fault, or detected one.
inline bool troubled(const TickInput& input, const TickOutput& output) {
  const bool finite = std::isfinite(output.wanted_n.x + output.wanted_n.y + output.wanted_n.z);
  return input.reading.fault != DeviceFault::kNone || input.late || !finite ||
         !(input.dt_s > 1e-6 && input.dt_s < 1.0) || output.cause == Cause::kStopped;
}

/// The first tick from `first` on that got or detected a fault; else the number of ticks.
inline size_t detection(const DeviceRig& rig, size_t first) {
  while (first < rig.inputs.size() && !troubled(rig.inputs[first], rig.outputs[first])) ++first;
  return first;
}

inline std::string state_of(const DeviceRig& rig) {
  return std::string(sentence(rig.outputs.back().cause)) + " " + sentence(rig.outputs.back().fault);
}

inline void expect_ramp(const DeviceRig& rig, size_t detected) {
  const double before = rig.force_n(detected - 1);
  EXPECT_GT(before, 0.3) << "there was no contact";
  for (size_t n = detected; n < detected + kRampTicks; ++n) {
    const double share = 1.0 - double(n - detected + 1) / kRampTicks;
    // After a longer tick the force may be further down, but never behind the ramp.
    EXPECT_LE(rig.force_n(n), before * std::max(0.0, share) + kRounding_n)
        << n - detected << " ms after the detection";
  }
}

/// No fault was detected, and no step was larger than the guards allow.
template <class Rig>
void expect_no_fault(Rig& rig, const FaultRow<Rig>& row, size_t injected) {
  rig.run_periods(150);
  EXPECT_EQ(detection(rig, injected), rig.inputs.size()) << state_of(rig);
  for (size_t n = injected; n < rig.outputs.size(); ++n) {
    EXPECT_LE(glm::distance(rig.outputs[n].command.force_n, rig.outputs[n - 1].command.force_n),
              kSlew_n + kRounding_n);
    if (row.ends == Ends::kTolerated) {
      EXPECT_GT(rig.force_n(n), 0.3) << n - injected;
    }
  }
  if (row.ends == Ends::kTolerated) return;
  EXPECT_EQ(rig.outputs.back().cause, row.cause) << state_of(rig);
  EXPECT_FALSE(rig.pushes());
}

/// The fault is detected in time and has its name, and the force is on its ramp from that tick on.
template <class Rig>
void expect_fault(Rig& rig, const FaultRow<Rig>& row, size_t injected) {
  ASSERT_TRUE(rig.turn_until([&] { return detection(rig, injected) < rig.inputs.size(); }));
  const size_t detected = detection(rig, injected);
  rig.run_periods(kRampTicks);
  EXPECT_EQ(rig.outputs[detected].cause, row.cause) << sentence(rig.outputs[detected].cause);
  EXPECT_EQ(rig.inputs[detected].reading.fault, row.fault)
      << sentence(rig.inputs[detected].reading.fault);
  if (row.within > 0) {
    EXPECT_LT(detected, injected + size_t(row.within));
  }
  expect_ramp(rig, detected);
  // A device that recovers by itself may be back by now, through the start gate.
  if (rig.watched->reachable() && rig.force_n(rig.outputs.size() - 1) == 0.0) {
    EXPECT_FALSE(rig.pushes());
  }
  if (row.then != DeviceFault::kNone) {
    EXPECT_TRUE(rig.turn_until([&] { return rig.inputs.back().reading.fault == row.then; }))
        << state_of(rig);
  }
  if (row.recover) row.recover(rig);
  if (row.ends == Ends::kRecovers) {
    EXPECT_TRUE(rig.touch()) << state_of(rig);
    return;
  }
  rig.run_periods(200);
  for (size_t n = detected + kRampTicks; n < rig.outputs.size(); ++n)
    EXPECT_EQ(rig.force_n(n), 0.0) << n;
}

/// Runs a row on a rig that was made with its options.
template <class Rig>
void expect_row(Rig& rig, const FaultRow<Rig>& row) {
  ASSERT_TRUE(rig.touch()) << state_of(rig);
  const size_t injected = rig.outputs.size();
  row.inject(rig);
  if (row.ends == Ends::kTolerated || row.ends == Ends::kFades)
    expect_no_fault(rig, row, injected);
  else
    expect_fault(rig, row, injected);
  if (row.after) row.after(rig);
  for (const std::string& wrong : rig.watched->wrong) ADD_FAILURE() << wrong;
}

/// Faults outside the device: rows for every rig.
template <class Rig>
std::vector<FaultRow<Rig>> host_and_scene_rows() {
  return {
      {.name = "TheHostIsAwayForFiveMilliseconds",
       .inject = [](Rig& rig) { rig.stall_host(5); },
       .cause = Cause::kLate},
      {.name = "TheHostIsAwayForFiftyMilliseconds",
       .inject = [](Rig& rig) { rig.stall_host(50); },
       .cause = Cause::kLate},
      {.name = "TheClockJumpsAhead",
       .inject = [](Rig& rig) { rig.time.now += 10'000'000'000; },
       .cause = Cause::kClock},
      {.name = "TheClockJumpsBackWhileTheDeviceAnswers",
       .inject = [](Rig& rig) { rig.watched->during = [&rig] { rig.time.now -= 10'000'000'000; }; },
       .cause = Cause::kClock},
      {.name = "TheClockStands",
       .inject = [](Rig& rig) { rig.time.stands = true; },
       .cause = Cause::kClock,
       .recover = [](Rig& rig) { rig.time.stands = false; }},
      {.name = "TheDataTurnIntoNoNumbers",
       .inject = [](Rig& rig) { rig.data->not_a_number = true; },
       .cause = Cause::kField,
       .ends = Ends::kFades},
      {.name = "TheSceneBecomesEmpty",
       .inject = [](Rig& rig) { rig.adopt(0); },
       .cause = Cause::kSceneEmpty,
       .ends = Ends::kFades},
      {.name = "TheSceneIsSwappedInContact",
       .inject = [](Rig& rig) { rig.adopt(1); },
       .ends = Ends::kTolerated},
      {.name = "ItIsAskedToStopAndGoesOnOnlyWhenAPersonSaysSo",
       .inject =
           [](Rig& rig) {
             rig.ports.events.push({ControlEvent::Kind::kStop, 0, 0.0});
           },
       .cause = Cause::kStopped,
       .recover =
           [](Rig& rig) {
             rig.run_periods(50);
             EXPECT_EQ(rig.outputs.back().cause, Cause::kStopped);
             rig.ports.events.push({ControlEvent::Kind::kRearm, 0, 0.0});
           }},
  };
}

}  // namespace palpate::devices::test
