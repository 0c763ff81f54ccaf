// Faults that are likely with a Falcon in contact, one row per fault, on the whole path: the real
// libusb, FalconDevice, the servo loop, the haptic step, the guards.
//
// Oracles: the commands that the emulated device has received for its motors; arithmetic for a
// straight ramp. Time is counted in ticks of a millisecond of the loop's own clock.
#include <gtest/gtest.h>

#include "tests/devices/falcon_rig.h"
#include "tests/devices/fault_rows.h"

namespace palpate::devices::test {
namespace {

using Rig = FalconRig;
using Row = FaultRow<Rig>;
using Faults = EmulatedFalcon::Faults;
using Received = EmulatedFalcon::Received;

/// For faults that end in opening the device again, after 100 missing answers.
Rig::Options less_patient() {
  Rig::Options options = Rig::patient();
  options.falcon.answer_wait_ns = 15'000'000;
  return options;
}

Rig::Options guarded() {
  Rig::Options options = Rig::patient();
  options.falcon.away_ns = 200'000'000;
  return options;
}

Rig::Options on_place(const char* place) {
  Rig::Options options = Rig::patient();
  options.falcon.address = place;
  return options;
}

// ---- how faults are made and mended -----------------------------------------------------------

std::function<void(Rig&)> set(const std::function<void(Faults&)>& change) {
  return [change](Rig& rig) { rig.falcon.change(change); };
}

void heal(Rig& rig) {
  rig.falcon.set({});
}

/// Changes each answer.
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

/// The cable is pulled. A motor with its own power supply keeps its last torque: the host can not
/// reach it before it is plugged in again.
void unplug(Rig& rig) {
  rig.watched->lose();
  rig.falcon.unplug();
}

void plug(Rig& rig) {
  rig.falcon.plug();
  rig.find(rig.falcon);
}

/// Commands are not accepted any more.
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
               rig.run_periods(30);
               rig.falcon.unplug();
               rig.run_periods(30);
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
      // Missing and invalid answers.
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
             // After more misses than are retried.
             rig.run_periods(110);
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
       .after = [](Rig& rig) { EXPECT_EQ(rig.device->info().address, "usb 1-2"); }},
      {.name = "ASecondFalconIsNotTheOneThatWasAskedFor",
       .inject =
           [](Rig& rig) {
             plug_other(rig, {.port = 2});
             unplug(rig);
           },
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.run_periods(50);
             EXPECT_EQ(rig.others.front().received_count(), 0U);
             plug(rig);
           },
       .options = on_place("usb 1-1")},
      {.name = "ASecondFalconComesAndGoes",
       .inject =
           [](Rig& rig) {
             plug_other(rig, {.port = 2});
             rig.run_periods(20);
             rig.others.front().unplug();
           },
       .ends = Ends::kTolerated},
      // The host; more rows are in host_and_scene_rows().
      {.name = "TheHostIsAwayForHalfASecondAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = guarded()},
  };
}

class FalconFault : public testing::TestWithParam<Row> {};

TEST_P(FalconFault, BringsTheForceDownAndLetsItComeBack) {
  Rig rig(GetParam().options);
  expect_row(rig, GetParam());
}

INSTANTIATE_TEST_SUITE_P(, FalconFault, testing::ValuesIn(rows()), name_of_row<Rig>);
INSTANTIATE_TEST_SUITE_P(AroundIt, FalconFault, testing::ValuesIn(host_and_scene_rows<Rig>()),
                         name_of_row<Rig>);

}  // namespace
}  // namespace palpate::devices::test
