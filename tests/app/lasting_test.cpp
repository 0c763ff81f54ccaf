// Long runs and their ends: signals, limits, a display that goes away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/app/ticks.h"
#include "tests/desktop/virtual_display.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;
using test::VirtualDisplay;
using ::testing::HasSubstr;

/// The force went to zero without a step, and the cause is in the table.
void expect_ramp_at_the_end(const fs::path& csv) {
  const Table ticks(csv);
  ASSERT_GT(ticks.size(), 100U);
  const size_t last = ticks.size() - 1;
  EXPECT_EQ(ticks.force(last), 0.0);
  EXPECT_EQ(ticks.text(last, "cause"), "stopped");
  // A late tick makes the step of the time that has passed.
  for (size_t row = last - 100; row < last; ++row)
    EXPECT_LT(std::abs(ticks.force(row + 1) - ticks.force(row)),
              0.2 * std::max(1.0, 1e3 * (ticks.number(row + 1, "t_s") - ticks.number(row, "t_s"))))
        << "row " << row;
}

/// A scene file: a ball that comes and goes, and a wall around it. By a formula, so that the hand
/// touches it at once: none of these tests depends on what is touched.
std::string swinging_ball(const TemporaryFolder& folder) {
  const std::string file = folder / "ball.json";
  std::ofstream(file) << R"({
    "volumes": [{"name": "ball", "source": "charges", "box_m": [0.128, 0.128, 0.128],
                 "charges": [{"strength_v_m": 1, "softness_m": 0.02}],
                 "drive": {"kind": "swing", "axis": [0, 0, 1], "amplitude_m": 0.005, "rate_hz": 1}}],
    "modes": [{"name": "wall", "kind": "surface", "volume": "ball",
               "strength": {"window": {"level": 25, "width": 4, "full": 5}}}]})";
  return file;
}

std::string black_boxes(const fs::path& folder) {
  std::string names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with("palpate-"))
      names += entry.path().filename().string() + " ";
  return names;
}

TEST(TheEndOfARun, IsOrderlyWhenTheDisplayDiesInContact) {
  NEEDS_DEVICE();
  std::string why_not;
  auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const TemporaryFolder folder;
  Program program({"feel", swinging_ball(folder), "--headset", "none", "--device", "simulated",
                   "--csv", folder / "t.csv", "--record", folder / "r.rec", "--black-box",
                   folder.path().string(), "--seconds", "120"});
  ASSERT_TRUE(program.wait_for("touching"));
  display.reset();
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("palpate: The display has gone away"));
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("XIO")));
  expect_ramp_at_the_end(folder / "t.csv");
  EXPECT_THAT(black_boxes(folder.path()), HasSubstr("display-lost.csv"));
  const Outcome replayed = run({"feel", swinging_ball(folder), "--replay", folder / "r.rec"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("bit by bit"));
}

class EndBySignal : public ::testing::TestWithParam<int> {};

TEST_P(EndBySignal, RampsAndFinishesWhatIsWritten) {
  const TemporaryFolder folder;
  Program program({"feel", swinging_ball(folder), "--headset", "off", "--device", "simulated",
                   "--csv", folder / "t.csv", "--record", folder / "r.rec", "--seconds", "120"});
  ASSERT_TRUE(program.wait_for("touching"));
  // Twice, as timeout and Slurm send it: to the program and to its group.
  program.signal(GetParam());
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  program.signal(GetParam());
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  expect_ramp_at_the_end(folder / "t.csv");
  const Outcome replayed = run({"feel", swinging_ball(folder), "--replay", folder / "r.rec"});
  EXPECT_THAT(replayed.out, HasSubstr("bit by bit"));
  EXPECT_THAT(replayed.out, ::testing::Not(HasSubstr("cut off")));
}

INSTANTIATE_TEST_SUITE_P(, EndBySignal, ::testing::Values(SIGINT, SIGTERM, SIGHUP, SIGQUIT));

TEST(TheEndOfARun, ThatIsKilledLeavesARecordingThatReplays) {
  const TemporaryFolder folder;
  Program program({"feel", swinging_ball(folder), "--headset", "off", "--device", "simulated",
                   "--record", folder / "r.rec", "--seconds", "120"});
  ASSERT_TRUE(program.wait_for("touching"));
  program.signal(SIGKILL);
  program.wait();
  const Outcome replayed = run({"feel", swinging_ball(folder), "--replay", folder / "r.rec"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("bit by bit; the recording is cut off there"));
}

TEST(TheEndOfARun, ByAFileThatMayNotGrowIsNotTheEndOfTheHand) {
  const TemporaryFolder folder;
  // The child inherits the limit; the test itself writes no file during this time.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{200'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  Program program({"feel", swinging_ball(folder), "--headset", "off", "--device", "simulated",
                   "--csv", folder / "t.csv", "--seconds", "4"});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("Felt      4."));
  EXPECT_THAT(outcome.err, HasSubstr("is not complete"));
}

TEST(TheEndOfARun, IsOrderlyBesideAThreadThatIsOlderThanMain) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  ASSERT_EQ(run({"phantom", "shell", "--size", "64", "--frames", "6", "-o", folder / "in.seq.nrrd"})
                .exit_code,
            0);
  for (int number : {SIGINT, SIGTERM}) {
    ::setenv("LD_PRELOAD", PALPATE_EARLY_THREAD, 1);
    Program program({"motion", folder / "in.seq.nrrd", "-o", folder / "out", "--preset", "best"});
    ::unsetenv("LD_PRELOAD");
    ASSERT_TRUE(program.wait_for("Device"));
    program.signal(number);
    const Outcome outcome = program.wait();
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("Stopped"));
    EXPECT_EQ(folder.entry_count(), 1U);
  }
}

TEST(TheStartOfARun, ObeysASignalAtOnceAndLeavesNothing) {
  // Making the heart takes longer than installing the signal handlers, but on a busy machine the
  // program may be further when the signal comes: then it ends as a run does.
  int at_start = 0;
  for (int k = 0; k < 20 && at_start < 3; ++k) {
    const TemporaryFolder folder;
    Program program(
        {"feel", "heart", "--headset", "off", "--device", "simulated", "--csv", folder / "t.csv"});
    ASSERT_TRUE(wait_until([&] { return program.handles(SIGTERM); }));
    program.signal(SIGTERM);
    const Outcome outcome = program.wait();
    if (outcome.exit_code == 0) continue;
    ++at_start;
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.err, "palpate: Stopped as asked, before anything began.\n");
    EXPECT_FALSE(fs::exists(folder / "t.csv"));
  }
  EXPECT_EQ(at_start, 3);
}

TEST(AReaderThatGoesAway, DoesNotEndTheWork) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string a = written(heart.frames[0], folder / "a.mha");
  const std::string b = written(heart.frames[1], folder / "b.mha");
  const std::string command = std::string(PALPATE_PROGRAM) + " motion " + a + " " + b + " -o " +
                              (folder / "u.mha").string() + " | true";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_TRUE(wait_until([&] { return fs::exists(folder / "u.mha"); }));
}

}  // namespace
}  // namespace palpate::app
