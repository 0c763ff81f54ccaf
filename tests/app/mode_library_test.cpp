// `--modes`: haptic modes that are not compiled into palpate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/app/program.h"
#include "tests/app/ticks.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kScene = R"({
  "volumes": [{"name": "ball", "source": "shell-exact"}],
  "modes": [{"name": "held", "kind": "snap", "volume": "ball", "strength": 2, "gain": 500,
             "range_m": 0.004}]})";

std::string scene_in(const TemporaryFolder& folder, std::string text = kScene) {
  files::write_bytes(folder / "scene.json", text);
  return folder / "scene.json";
}

double most_force_n(const std::filesystem::path& table) {
  const Table ticks(table);
  double most = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) most = std::max(most, ticks.force(row));
  return most;
}

TEST(ModeLibrary, AddsAKindThatAScenePlansAndFeels) {
  const TemporaryFolder folder;
  const std::string scene = scene_in(folder);
  const Outcome without = run({"plan", scene});
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, AllOf(HasSubstr("\"snap\""), HasSubstr("surface")));
  const Outcome plan = run({"plan", scene, "--modes", PALPATE_SNAP_MODE});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("held"));

  // The mode pulls the hand to the ball's surface; a recording of it is replayed bit by bit.
  const std::string recording = folder / "run";
  const Outcome felt = run_computed({"feel", scene, "--modes", PALPATE_SNAP_MODE, "--device",
                                     "simulated", "--path", "press", "--seconds", "5", "--headset",
                                     "off", "--record", recording, "--csv", folder / "ticks.csv"});
  EXPECT_EQ(felt.exit_code, 0) << felt.err;
  EXPECT_GT(most_force_n(folder / "ticks.csv"), 0.1);
  const Outcome replayed =
      run({"feel", scene, "--modes", PALPATE_SNAP_MODE, "--replay", recording});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("every output is the recorded one"));
}

TEST(ModeLibrary, InCIsFeltLikeAnyOther) {
  const std::string scene = PALPATE_SOURCE_DIR "/docs/examples/my_mode.json";
  const Outcome without = run({"plan", scene});
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, HasSubstr("\"snap-c\""));
  const Outcome plan = run({"plan", scene, "--modes", PALPATE_MY_MODE});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("held"));
  const TemporaryFolder folder;
  const Outcome felt =
      run_computed({"feel", scene, "--modes", PALPATE_MY_MODE, "--device", "simulated", "--path",
                    "press", "--seconds", "5", "--headset", "off", "--csv", folder / "ticks.csv"});
  EXPECT_EQ(felt.exit_code, 0) << felt.err;
  EXPECT_GT(most_force_n(folder / "ticks.csv"), 0.1);
}

TEST(ModeLibrary, InCMayRefuseToo) {
  const TemporaryFolder folder;
  std::string text = kScene;
  text.replace(text.find("0.004"), 5, "0.0");
  text.replace(text.find("\"snap\""), 6, "\"snap-c\"");
  const Outcome plan = run({"plan", scene_in(folder, text), "--modes", PALPATE_MY_MODE});
  EXPECT_EQ(plan.exit_code, 2);
  EXPECT_THAT(plan.err, HasSubstr("Mode \"held\" can not be made: it needs a range_m above 0"));
}

TEST(ModeLibrary, LetsTheModeRefuseWhatCanNotWork) {
  const TemporaryFolder folder;
  std::string text = kScene;
  text.replace(text.find("0.004"), 5, "0.0");
  const Outcome plan = run({"plan", scene_in(folder, text), "--modes", PALPATE_SNAP_MODE});
  EXPECT_EQ(plan.exit_code, 2);
  EXPECT_THAT(plan.err, HasSubstr("range_m"));
}

TEST(ModeLibrary, RefusesWhatIsNoLibraryOfModesInOneSentence) {
  const TemporaryFolder folder;
  const std::string scene = scene_in(folder);
  files::write_bytes(folder / "libtext.so", "not a library");
  const auto refusal = [&](const std::string& library) {
    const Outcome result = run({"plan", scene, "--modes", library});
    EXPECT_EQ(result.exit_code, 2) << library;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  EXPECT_THAT(refusal(folder / "libtext.so"), HasSubstr("can not be loaded"));
  EXPECT_THAT(refusal("/usr/lib/x86_64-linux-gnu/libz.so.1"),
              HasSubstr("is no library of haptic modes"));
  EXPECT_THAT(refusal(PALPATE_OLD_MODES), HasSubstr("compiled for another version"));
  EXPECT_THAT(refusal(folder / "absent.so"), HasSubstr("absent.so"));
  const Outcome made = run({"plan", "molecule", "--modes", PALPATE_SNAP_MODE});
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_THAT(made.err, HasSubstr("Libraries of haptic modes are for a scene file"));
}

}  // namespace
}  // namespace palpate::app
