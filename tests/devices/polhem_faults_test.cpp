// Faults that are likely with a Polhem in contact, one row per fault, on the whole path: a
// pseudo-terminal, MailboxDevice, the servo loop, the haptic step, the guards. The oracle is the
// emulated firmware, which stores the last force.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <random>

#include "integration/devices/answer_judge.h"
#include "integration/devices/polhem.h"
#include "integration/devices/polhem_protocol.h"
#include "tests/devices/emulated_polhem.h"
#include "tests/devices/fault_rows.h"
#include "tests/devices/mailbox_rig.h"

namespace palpate::devices::test {
namespace {

class PolhemRig final : public MailboxRig {
 public:
  struct Options {
    MailboxOptions mailbox = patient_mailbox();
    int64_t answer_wait_ns = 250'000'000;
    size_t line_bytes = 64;
  };
  static Options patient() { return {}; }

  explicit PolhemRig(const Options& options) {
    polhem.change_faults([&](auto& faults) { faults.line_bytes = options.line_bytes; });
    PolhemOptions link;
    link.port = polhem.port();
    link.answer_wait_ns = options.answer_wait_ns;
    link.open_wait_ns = 1'000'000'000;
    hold(polhem, glm::dvec3(0.0));
    start_mailbox(make_polhem_link(link), options.mailbox);
  }

  EmulatedPolhem polhem;
};

using Rig = PolhemRig;
using Row = FaultRow<Rig>;
using Faults = EmulatedPolhem::Faults;

/// For faults that need many missing answers: the waiting time of each is shorter, but longer than
/// a busy machine takes to run the firmware's thread. Rows that are tolerated need the longest
/// waiting time, because a late answer counts as one more missing one.
Rig::Options less_patient() {
  Rig::Options options = Rig::patient();
  options.answer_wait_ns = 100'000'000;
  return options;
}

std::function<void(Rig&)> set(const std::function<void(Faults&)>& change) {
  return [change](Rig& rig) { rig.polhem.change_faults(change); };
}

void heal(Rig& rig) {
  rig.polhem.heal();
}

std::function<void(Rig&)> mangle(const std::function<std::string(std::string)>& how) {
  return set([how](Faults& faults) { faults.mangle = how; });
}

std::function<void(Rig&)> mangle_some(int count,
                                      const std::function<std::string(std::string)>& how) {
  return set([count, how](Faults& faults) {
    faults.mangle = [left = count, how](std::string text) mutable {
      return left-- > 0 ? how(std::move(text)) : text;
    };
  });
}

std::string noise(std::string text) {
  for (size_t n = 0; n + 1 < text.size(); ++n) text[n] = char(0x80 + 7 * n);
  return text;
}

/// Replaces the first number.
std::function<std::string(std::string)> with_x(const std::string& x) {
  return [x](std::string text) {
    text.replace(0, 8, x + std::string(8 - x.size(), ' '));
    return text;
  };
}

void unplug(Rig& rig) {
  rig.watched->lose();
  rig.polhem.unplug();
}

void plug(Rig& rig) {
  rig.polhem.plug();
  rig.find(rig.polhem);
}

std::vector<Row> rows() {
  return {
      {.name = "UnpluggedInContact",
       .inject = unplug,
       .fault = DeviceFault::kUnplugged,
       .recover = plug},
      {.name = "PluggedInAgainAtOnce",
       .inject =
           [](Rig& rig) {
             unplug(rig);
             plug(rig);
           },
       .fault = DeviceFault::kUnplugged},
      {.name = "ComesBackHeldByAnotherProgram",
       .inject = unplug,
       .fault = DeviceFault::kUnplugged,
       .recover =
           [](Rig& rig) {
             rig.polhem.plug();
             const int other = open(rig.polhem.port().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
             if (flock(other, LOCK_EX | LOCK_NB) == 0) {
               EXPECT_TRUE(rig.turn_until(
                   [&] { return rig.inputs.back().reading.fault == DeviceFault::kBusy; }));
             }
             close(other);
             rig.find(rig.polhem);
           }},
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
             EXPECT_TRUE(rig.turn_until(
                 [&] { return rig.device->counts().missed >= AnswerJudge::kGiveUp; }));
             heal(rig);
           },
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().opened, 2U); },
       .options = less_patient()},
      {.name = "AnswersAreLate",
       .inject = set([](Faults& faults) { faults.delay_ns = 300'000'000; }),
       .fault = DeviceFault::kTimeout,
       .within = 0,
       .recover = heal,
       .options = less_patient()},
      {.name = "OneAnswerIsLost",
       .inject = mangle_some(1, [](const std::string&) { return std::string(); }),
       .ends = Ends::kTolerated},
      // It is no longer clear which line a later answer belongs to: it may be a late one.
      {.name = "TwoAnswersAreLost",
       .inject = mangle_some(2, [](const std::string&) { return std::string(); }),
       .fault = DeviceFault::kTimeout,
       .options = less_patient()},
      {.name = "EveryAnswerIsNoise",
       .inject = mangle(noise),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "OneAnswerIsNoise", .inject = mangle_some(1, noise), .ends = Ends::kTolerated},
      {.name = "EveryAnswerIsHalf",
       .inject = mangle([](const std::string& text) { return text.substr(0, 20) + "\n"; }),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "LinesNeverEnd",
       .inject = mangle([](const std::string&) { return std::string(64, '7'); }),
       .fault = DeviceFault::kTimeout,
       .recover = heal,
       .options = less_patient()},
      {.name = "ThePositionIsNoNumber",
       .inject = mangle(with_x("nan")),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "ThePositionIsInfinite",
       .inject = mangle(with_x("inf")),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "ThePositionIsFarAway",
       .inject = mangle(with_x("9999.9")),
       .fault = DeviceFault::kGarbage,
       .recover = heal,
       .options = less_patient()},
      {.name = "ThePositionJumps",
       .inject = mangle(with_x("90.0")),
       .fault = DeviceFault::kJumped,
       .recover = heal},
      {.name = "ThePositionJumpsForOneAnswer",
       .inject = mangle_some(1, with_x("-20.0")),
       .fault = DeviceFault::kJumped},
      {.name = "ThePositionStands",
       .inject = [](Rig& rig) { rig.holds_grip = false; },
       .fault = DeviceFault::kStuck,
       .within = 0,
       .recover = [](Rig& rig) { rig.holds_grip = true; }},
      {.name = "ItAsksToBeCalibrated",
       .inject = set([](Faults& faults) { faults.info = 1; }),
       .fault = DeviceFault::kNotHomed,
       .recover = heal},
      {.name = "AnswersComeInPieces",
       .inject = set([](Faults& faults) { faults.torn = 7; }),
       .ends = Ends::kTolerated},
      {.name = "EveryAnswerComesTwice",
       .inject = mangle([](const std::string& text) { return text + text; }),
       .ends = Ends::kTolerated},
      {.name = "TheOlderFirmwareHasShorterLines",
       .inject = [](Rig&) {},
       .ends = Ends::kTolerated,
       .options = {.line_bytes = 63}},
      {.name = "TheHostIsAwayAndTheForceIsCutMeanwhile",
       .inject = [](Rig& rig) { rig.stall_host(500, [&] { return !rig.pushes(); }); },
       .fault = DeviceFault::kTimeout,
       .after = [](Rig& rig) { EXPECT_GE(rig.device->counts().cuts, 1U); },
       .options = {.mailbox = {.away_ns = 200'000'000,
                               .silence_ns = 10'000'000'000,
                               .priority = 0}}},
  };
}

class PolhemFault : public testing::TestWithParam<Row> {};

TEST_P(PolhemFault, BringsTheForceDownAndLetsItComeBack) {
  Rig rig(GetParam().options);
  expect_row(rig, GetParam());
  EXPECT_EQ(rig.polhem.malformed(), 0U);
}

INSTANTIATE_TEST_SUITE_P(, PolhemFault, testing::ValuesIn(rows()), name_of_row<Rig>);
INSTANTIATE_TEST_SUITE_P(AroundIt, PolhemFault, testing::ValuesIn(host_and_scene_rows<Rig>()),
                         name_of_row<Rig>);

// ---- the lines

TEST(PolhemLine, IsWhatTheFirmwareReads) {
  // mN; x towards the user, y right, z up.
  const std::string line = polhem::force_line({0.25, -1.5, 3.0});
  EXPECT_EQ(line.size(), 64U);
  EXPECT_TRUE(line.starts_with("3000 250 -1500 2 0 0 0 ")) << line;
  EXPECT_EQ(line.find('\n'), 63U);
  EXPECT_TRUE(polhem::force_line({1e9, 0.0, -1e9}).starts_with("-32767 32767 0 2"));
}

TEST(PolhemLine, GivesThePlaceInPalpatesAxes) {
  const auto answer =
      polhem::answer_of(" -59.276   13.383 -148.002   0.0919 -1.8483  1.0370 -1.9512 0 ");
  ASSERT_TRUE(answer);
  EXPECT_LT(glm::distance(answer->position_m, glm::dvec3(0.013383, -0.148002, -0.059276)), 1e-12);
  EXPECT_EQ(answer->info, 0);
}

TEST(PolhemLine, IsRefusedIfAnythingInItIsWrong) {
  for (const char* line : {"", "1 2 3", "1 2 3 4 5 6 7", "1 2 3 4 5 6 7 0 9", "1 2 3 4 5 6 7 0x",
                           "nan 2 3 4 5 6 7 0", "1 2 3 4 inf 6 7 0", "1e400 2 3 4 5 6 7 0",
                           "1 2 3 4 5 6 7 1e9", "2000 0 0 0 0 0 0 0", "1,2 3 4 5 6 7 8 0"})
    EXPECT_FALSE(polhem::answer_of(line)) << line;
}

TEST(PolhemLine, GivesFinitePlacesForAnyBytes) {
  std::mt19937 random(7);
  const std::string letters = "0123456789.-+eE nainf\n\r\0x";
  for (int round = 0; round < 2000; ++round) {
    polhem::LineSplitter lines;
    std::string bytes;
    for (int n = 0; n < 200; ++n) bytes += letters[random() % letters.size()];
    for (size_t at = 0; at < bytes.size();) {
      const size_t count = std::min(bytes.size() - at, size_t(1 + random() % 40));
      lines.read(std::string_view(bytes).substr(at, count));
      at += count;
      if (const auto answer = lines.take()) {
        ASSERT_LE(glm::length(answer->position_m), 1.0 + 1e-12) << bytes;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::devices::test
