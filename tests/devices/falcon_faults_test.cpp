// Everything that is likely to go wrong with a Falcon in contact, one row per fault, on the whole
// path: the real libusb, FalconDevice, the servo loop, the haptic step, the guards.
//
// Oracles: the emulated device says what its motors were told; arithmetic says where a straight
// ramp is. Time is counted in ticks of a millisecond of the loop's own clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "tests/devices/fault_rig.h"

namespace palpate::devices::test {
namespace {

using Rig = FaultRig;
using Faults = EmulatedFalcon::Faults;
using Received = EmulatedFalcon::Received;

constexpr int kRampTicks = 20;   // SafetyOptions::off_ramp_s
constexpr double kSlew_n = 2.0;  // SafetyOptions::max_slew_n_per_s, per ms
// The ramp is a product of doubles; what the loop holds is exact.
constexpr double kRounding_n = 1e-9;

Rig::Options patient() {
  Rig::Options options;
  options.falcon.answer_wait_ns = 50'000'000;  // an answer that comes at all comes in time
  options.falcon.away_ns = 5'000'000'000;      // a machine that is busy is not a host that is away
  return options;
}

/// For faults that end in opening the device again, after 100 answers that did not come.
Rig::Options less_patient() {
  Rig::Options options = patient();
  options.falcon.answer_wait_ns = 15'000'000;
  return options;
}

Rig::Options guarded() {
  Rig::Options options = patient();
  options.falcon.away_ns = 200'000'000;
  return options;
}

Rig::Options on_place(const char* place) {
  Rig::Options options = patient();
  options.falcon.place = place;
  return options;
}

enum class Ends {
  kRecovers,   ///< by itself once row.recover has been done
  kStays,      ///< at zero
  kTolerated,  ///< no fault at all: the force goes on
  kFades,      ///< no cut: the scene's own force goes to zero without a step
};

struct Row {
  const char* name;
  std::function<void(Rig&)> inject;
  Cause cause = Cause::kDevice;
  DeviceFault fault = DeviceFault::kNone;
  int within = 3;  ///< ticks from the fault to its detection; 0: as long as it takes
  Ends ends = Ends::kRecovers;
  DeviceFault then = DeviceFault::kNone;  ///< what is said later, before recovery
  std::function<void(Rig&)> recover = [](Rig&) {};
  std::function<void(Rig&)> after = [](Rig&) {};  ///< what must hold at the end
  Rig::Options options = patient();
};

void PrintTo(const Row& row, std::ostream* out) {
  *out << row.name;
}

// ---- how faults are made and mended -----------------------------------------------------------

std::function<void(Rig&)> set(const std::function<void(Faults&)>& change) {
  return [change](Rig& rig) { rig.falcon.change(change); };
}

void heal(Rig& rig) {
  rig.falcon.set({});
}

/// What becomes of each answer.
std::function<void(Rig&)> mangle(std::function<Bytes(Bytes)> how) {
  return set([how](Faults& faults) { faults.mangle = how; });
}

/// The same, for the next `count` answers only.
std::function<void(Rig&)> mangle_some(int count, std::function<Bytes(Bytes)> how) {
  return [count, how](Rig& rig) {
    rig.falcon.change([&](Faults& faults) {
      faults.mangle = [left = count, how](Bytes answer) mutable {
        return left-- > 0 ? how(std::move(answer)) : answer;
      };
    });
  };
}

Bytes noise(Bytes answer) {
  for (size_t n = 0; n < answer.size(); ++n) answer[n] = uint8_t(0x80 + 7 * n);
  return answer;
}

Bytes nothing(Bytes) {
  return {};
}

/// Adds to one encoder of an answer.
Bytes shifted(Bytes answer, size_t encoder, int by) {
  int value = 0;
  for (size_t n = 4; n-- > 0;) value = value * 16 + (answer[1 + 4 * encoder + n] - 'A');
  value += by;
  for (size_t n = 0; n < 4; ++n, value >>= 4)
    answer[1 + 4 * encoder + n] = uint8_t('A' + (value & 0xf));
  return answer;
}

/// The cable is pulled. A motor that has its own power goes on with its last torque: nothing that
/// the host does can reach it before it is plugged in again.
void unplug(Rig& rig) {
  rig.watched->lose();
  rig.falcon.unplug();
}

void plug(Rig& rig) {
  rig.falcon.plug();
  rig.find(rig.falcon);
}

/// Commands are not taken any more.
void refuse_commands(Rig& rig) {
  rig.watched->lose();
  rig.falcon.change([](Faults& faults) { faults.refuses_commands = true; });
}

void stall_out(Rig& rig) {
  rig.watched->lose();
  rig.falcon.change([](Faults& faults) { faults.stall_out = true; });
}

void reachable_again(Rig& rig) {
  heal(rig);
  rig.find(rig.falcon);
}

bool at_zero(Rig& rig) {
  return !rig.used->last().pushes();
}

void plug_other(Rig& rig, const EmulatedFalcon::Options& options) {
  rig.others.emplace_back(options);
  rig.others.back().place(glm::dvec3(0.0, 0.0, 0.160));
  rig.others.back().plug();
}

// ---- the table --------------------------------------------------------------------------------

std::vector<Row> rows() {
  const auto jump = [](int counts) {
    return [counts](Bytes answer) { return shifted(std::move(answer), 1, counts); };
  };
  return {
      // The cable.
      {.name = "UnpluggedInContact",
       .inject = unplug,
       .fault = DeviceFault::kUnplugged,
       .recover = plug},
      {.name = "PluggedInAgainBeforeAnyoneLooks",
       .inject =
           [](Rig& rig) {
             unplug(rig);
             rig.falcon.plug();
           },
       .fault = DeviceFault::kUnplugged,
       .recover = [](Rig& rig) { rig.find(rig.falcon); }},
      {.name = "UnpluggedThreeTimes",
       .inject = unplug,
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             for (int n = 0; n < 2; ++n) {
               rig.falcon.plug();
               rig.turns(30);
               rig.falcon.unplug();
               rig.turns(30);
             }
             plug(rig);
           },
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().opened, 2U); }},
      {.name = "ComesBackHeldByAnotherProgram",
       .inject = unplug,
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.falcon.claim_elsewhere(true);
             plug(rig);
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.inputs.back().reading.fault == DeviceFault::kBusy; }));
             rig.falcon.claim_elsewhere(false);
           }},
      // The bus.
      {.name = "ReadsStallOnce",
       .inject = set([](Faults& faults) { faults.stall_in = true; }),
       .fault = DeviceFault::kTransfer,
       .after =
           [](Rig& rig) {
             EXPECT_GE(rig.device->counts().repaired, 1U);
             EXPECT_EQ(rig.device->counts().opened, 1U);
           }},
      {.name = "WritesStallOnce",
       .inject = stall_out,
       .fault = DeviceFault::kTransfer,
       .recover = reachable_again},
      {.name = "ReadsStallForLong",
       .inject = set([](Faults& faults) { faults.stall_in = faults.stalls_for_good = true; }),
       .fault = DeviceFault::kTransfer,
       .recover = heal},
      {.name = "EverythingStallsForEver",
       .inject =
           [](Rig& rig) {
             rig.watched->lose();
             rig.falcon.change([](Faults& faults) {
               faults.stall_in = faults.stall_out = faults.stall_control = true;
               faults.stalls_for_good = true;
             });
           },
       .fault = DeviceFault::kTransfer,
       .ends = Ends::kStays},
      {.name = "ReadsEndWithNoise",
       .inject = set([](Faults& faults) { faults.ends_with_error = true; }),
       .fault = DeviceFault::kTransfer,
       .recover = heal},
      {.name = "CommandsAreNotTaken",
       .inject = refuse_commands,
       .fault = DeviceFault::kTimeout,
       .recover = reachable_again,
       .options = less_patient()},
      {.name = "ReadsNeverEnd",
       .inject = set([](Faults& faults) { faults.mute_status = true; }),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      // No answers, and answers that are none.
      {.name = "FallsSilent",
       .inject = set([](Faults& faults) { faults.silent = true; }),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      {.name = "FallsSilentUntilItIsOpenedAgain",
       .inject = set([](Faults& faults) { faults.silent = true; }),
       .fault = DeviceFault::kTimeout,
       .recover =
           [](Rig& rig) {
             rig.turns(110);  // hopeless
             heal(rig);
           },
       .options = less_patient()},
      {.name = "OneAnswerIsLost", .inject = mangle_some(1, nothing), .ends = Ends::kTolerated},
      {.name = "TwoAnswersAreLost", .inject = mangle_some(2, nothing), .ends = Ends::kTolerated},
      {.name = "ThreeAnswersAreLost",
       .inject = mangle_some(3, nothing),
       .fault = DeviceFault::kTimeout},
      {.name = "EveryAnswerIsAByteShort",
       .inject = mangle([](Bytes answer) {
         answer.pop_back();
         return answer;
       }),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "EveryAnswerIsHalf",
       .inject = mangle([](Bytes answer) {
         answer.resize(8);
         return answer;
       }),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "EveryAnswerIsTwiceAsLong",
       .inject = mangle([](Bytes answer) {
         const Bytes tail = noise(answer);
         answer.insert(answer.end(), tail.begin(), tail.end());
         return answer;
       }),
       .ends = Ends::kTolerated,
       .after = [](Rig& rig) { EXPECT_GT(rig.device->counts().rejected_bytes, 100U); }},
      {.name = "EveryAnswerIsLongerThanAPacket",
       .inject = mangle([](Bytes answer) {
         Bytes longer(100 + answer.size(), 0x55);
         std::copy(answer.begin(), answer.end(), longer.begin() + 100);
         return longer;
       }),
       .ends = Ends::kTolerated},
      {.name = "EveryAnswerIsNoise",
       .inject = mangle(noise),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "AnswersHaveLettersThatAreNone",
       .inject = mangle([](Bytes answer) {
         answer[6] = 'Z';
         return answer;
       }),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "OneAnswerIsNoise", .inject = mangle_some(1, noise), .ends = Ends::kTolerated},
      {.name = "AnswersComeInSixteenPieces",
       .inject = set([](Faults& faults) { faults.packet_limit = 1; }),
       .ends = Ends::kTolerated},
      {.name = "AnswersComeInPiecesOfSeven",
       .inject = set([](Faults& faults) { faults.packet_limit = 7; }),
       .ends = Ends::kTolerated},
      // Encoders.
      {.name = "AnEncoderJumps",
       .inject = mangle(jump(500)),
       .fault = DeviceFault::kJumped,
       .recover = heal},
      {.name = "AnEncoderJumpsForOneAnswer",
       .inject = mangle_some(1, jump(-500)),
       .fault = DeviceFault::kJumped},
      {.name = "AnEncoderSaysWhatNoArmCan",
       .inject = mangle(jump(20'000)),
       .fault = DeviceFault::kOutOfReach,
       .recover = heal},
      {.name = "AllEncodersStand",
       .inject = [](Rig& rig) { rig.holds_grip = false; },
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "AnEncoderStands",
       .inject = set([](Faults& faults) { faults.stuck_encoder = 0; }),
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = heal},
      {.name = "TheZeroMarksAreLost",
       .inject = [](Rig& rig) { rig.falcon.lose_homing(); },
       .fault = DeviceFault::kNotHomed,
       .recover = [](Rig& rig) { EXPECT_TRUE(rig.home()); }},
      // The device's power, and other devices.
      {.name = "LosesPowerAndFirmware",
       .inject = [](Rig& rig) { rig.falcon.power_cycle(); },
       .fault = DeviceFault::kTimeout,
       .ends = Ends::kStays,
       .then = DeviceFault::kNoFirmware,
       .options = less_patient()},
      {.name = "IsReplacedByAnotherDeviceWithItsId",
       .inject =
           [](Rig& rig) {
             unplug(rig);
             plug_other(rig, {.product_name = "USB Relay", .port = 2});
           },
       .fault = DeviceFault::kUnplugged,
       .then = DeviceFault::kNotOpened,
       .recover =
           [](Rig& rig) {
             EXPECT_EQ(rig.others.front().received_count(), 0U);
             plug(rig);
           }},
      {.name = "ASecondFalconTakesOver",
       .inject =
           [](Rig& rig) {
             plug_other(rig, {.port = 2});
             unplug(rig);
           },
       .fault = DeviceFault::kUnplugged,
       .recover = [](Rig& rig) { rig.find(rig.others.front()); },
       .after = [](Rig& rig) { EXPECT_EQ(rig.device->info().place, "usb 1-2"); }},
      {.name = "ASecondFalconIsNotTheOneThatWasAskedFor",
       .inject =
           [](Rig& rig) {
             plug_other(rig, {.port = 2});
             unplug(rig);
           },
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.turns(50);
             EXPECT_EQ(rig.others.front().received_count(), 0U);
             plug(rig);
           },
       .options = on_place("usb 1-1")},
      {.name = "ASecondFalconComesAndGoes",
       .inject =
           [](Rig& rig) {
             plug_other(rig, {.port = 2});
             rig.turns(20);
             rig.others.front().unplug();
           },
       .ends = Ends::kTolerated},
      // The host.
      {.name = "TheHostIsAwayForFiveMilliseconds",
       .inject = [](Rig& rig) { rig.stall_host(5); },
       .cause = Cause::kLate},
      {.name = "TheHostIsAwayForFiftyMilliseconds",
       .inject = [](Rig& rig) { rig.stall_host(50); },
       .cause = Cause::kLate},
      {.name = "TheHostIsAwayForHalfASecondAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return at_zero(rig); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = guarded()},
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
      // The scene.
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
             rig.turns(50);
             EXPECT_EQ(rig.outputs.back().cause, Cause::kStopped);
             rig.ports.events.push({ControlEvent::Kind::kRearm, 0, 0.0});
           }},
  };
}

// ---- what must hold ---------------------------------------------------------------------------

/// Whether a tick was told of trouble, or found it.
bool troubled(const TickInput& input, const TickOutput& output) {
  const bool finite = std::isfinite(output.wanted_n.x + output.wanted_n.y + output.wanted_n.z);
  return input.reading.fault != DeviceFault::kNone || input.late || !finite ||
         !(input.dt_s > 1e-6 && input.dt_s < 1.0) || output.cause == Cause::kStopped;
}

/// The first tick from `first` on that knows; or the number of ticks.
size_t detection(const Rig& rig, size_t first) {
  while (first < rig.inputs.size() && !troubled(rig.inputs[first], rig.outputs[first])) ++first;
  return first;
}

std::string state(const Rig& rig) {
  return std::string(sentence(rig.outputs.back().cause)) + " " + sentence(rig.outputs.back().fault);
}

void expect_ramp(const Rig& rig, size_t detected) {
  const double before = rig.force_n(detected - 1);
  EXPECT_GT(before, 0.3) << "it was not in contact";
  for (size_t n = detected; n < detected + kRampTicks; ++n) {
    const double share = 1.0 - double(n - detected + 1) / kRampTicks;
    // A tick that took longer has come further down, but none may be behind.
    EXPECT_LE(rig.force_n(n), before * std::max(0.0, share) + kRounding_n)
        << n - detected << " ms after it was known";
  }
}

/// Nothing was noticed, and no step was larger than the guards allow.
void expect_no_fault(Rig& rig, const Row& row, size_t injected) {
  rig.turns(150);
  EXPECT_EQ(detection(rig, injected), rig.inputs.size()) << state(rig);
  for (size_t n = injected; n < rig.outputs.size(); ++n) {
    EXPECT_LE(glm::distance(rig.outputs[n].command.force_n, rig.outputs[n - 1].command.force_n),
              kSlew_n + kRounding_n);
    if (row.ends == Ends::kTolerated) {
      EXPECT_GT(rig.force_n(n), 0.3) << n - injected;
    }
  }
  if (row.ends == Ends::kTolerated) return;
  EXPECT_EQ(rig.outputs.back().cause, row.cause) << state(rig);
  EXPECT_TRUE(at_zero(rig));
}

/// It is noticed in time, named, and the force is on its ramp from that tick on.
void expect_fault(Rig& rig, const Row& row, size_t injected) {
  ASSERT_TRUE(rig.turn_until([&] { return detection(rig, injected) < rig.inputs.size(); }));
  const size_t detected = detection(rig, injected);
  rig.turns(kRampTicks);
  EXPECT_EQ(rig.outputs[detected].cause, row.cause) << sentence(rig.outputs[detected].cause);
  EXPECT_EQ(rig.inputs[detected].reading.fault, row.fault)
      << sentence(rig.inputs[detected].reading.fault);
  if (row.within > 0) {
    EXPECT_LT(detected, injected + size_t(row.within));
  }
  expect_ramp(rig, detected);
  // What heals by itself may be back by now, through the start gate.
  if (rig.watched->reachable() && rig.force_n(rig.outputs.size() - 1) == 0.0) {
    EXPECT_TRUE(at_zero(rig));
  }
  if (row.then != DeviceFault::kNone) {
    EXPECT_TRUE(rig.turn_until([&] { return rig.inputs.back().reading.fault == row.then; }))
        << state(rig);
  }
  row.recover(rig);
  if (row.ends == Ends::kRecovers) {
    EXPECT_TRUE(rig.touch()) << state(rig);
    return;
  }
  rig.turns(200);
  for (size_t n = detected + kRampTicks; n < rig.outputs.size(); ++n)
    EXPECT_EQ(rig.force_n(n), 0.0) << n;
}

class FalconFault : public testing::TestWithParam<Row> {};

TEST_P(FalconFault, BringsTheForceDownAndLetsItComeBack) {
  const Row& row = GetParam();
  Rig rig(row.options);
  ASSERT_TRUE(rig.touch()) << state(rig);
  const size_t injected = rig.outputs.size();
  row.inject(rig);
  if (row.ends == Ends::kTolerated || row.ends == Ends::kFades)
    expect_no_fault(rig, row, injected);
  else
    expect_fault(rig, row, injected);
  row.after(rig);
  for (const std::string& wrong : rig.watched->wrong) ADD_FAILURE() << wrong;
}

std::string name_of(const testing::TestParamInfo<Row>& row) {
  return row.param.name;
}

INSTANTIATE_TEST_SUITE_P(, FalconFault, testing::ValuesIn(rows()), name_of);

}  // namespace
}  // namespace palpate::devices::test
