// `palpate feel` as a user runs it: with a simulated hand, in real time where that is tested.
// No test here measures time: the machine may be busy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>
#include <thread>

#include "integration/files/read_volume.h"
#include "integration/running/force_change.h"
#include "module/haptics/force_ledger.h"
#include "tests/app/pages.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/app/ticks.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<std::string> feel(const std::string& what, std::vector<std::string> more) {
  // A busy machine must not trigger the watchdog in a test of something else.
  std::vector<std::string> all = {"feel", what, "--device", "simulated", "--watchdog", "1000"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(Feel, PressesTheBeatingHeartAndDrawsWhatItFelt) {
  const TemporaryFolder folder;
  const Outcome result =
      run_computed(feel("heart", {"--csv", folder / "ticks.csv", "--picture", folder / "felt.png",
                                  "--black-box", folder / "."}));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("8 frames in 2 s, with its motion"),
                                HasSubstr("follows the path 'press'"), HasSubstr("Felt")));
  EXPECT_TRUE(std::filesystem::exists(folder / "felt.png"));
  const Table ticks(folder / "ticks.csv");
  ASSERT_GT(ticks.size(), 100u);
  double most = 0.0, at_start = 0.0;
  bool touched = false;
  for (size_t k = 0; k < ticks.size(); ++k) {
    most = std::max(most, ticks.force(k));
    if (ticks.text(k, "cause") == "starting") at_start = std::max(at_start, ticks.force(k));
    touched |= ticks.text(k, "contact") == "1";
    EXPECT_EQ(ticks.text(k, "frozen"), "0") << "row " << k;
    // The force, of which five digits are written, is what was asked less what limiters hold back.
    for (const std::string axis : {"_x_n", "_y_n", "_z_n"}) {
      double left_n = ticks.number(k, "asked" + axis);
      for (size_t n = 0; n < kLimiters; ++n) {
        std::string column = word(Limiter(n));
        std::replace(column.begin(), column.end(), '-', '_');
        left_n -= ticks.number(k, column + axis);
      }
      ASSERT_NEAR(left_n, ticks.number(k, "force" + axis), 5.1e-6) << "row " << k;
    }
  }
  // The hand aims 14 mm deep and has a stiffness of 135 N/m: 1.9 N at rest, with a beating wall
  // below it.
  EXPECT_GT(most, 1.0);
  EXPECT_LT(most, 4.0);
  EXPECT_LT(at_start, 0.3);
  EXPECT_TRUE(touched);
  EXPECT_EQ(ticks.force(ticks.size() - 1), 0.0);
}

const std::filesystem::path kCine = std::filesystem::path(PALPATE_SHARED_DATA) / "heart_cine";

#define NEEDS_CINE()                                 \
  if (!std::filesystem::exists(kCine / "lv_00.mha")) \
  GTEST_SKIP() << "There is no heart_cine "          \
                  "here."

TEST(Feel, PressesTheSegmentsOfARealHeart) {
  NEEDS_CINE();
  const TemporaryFolder folder;
  std::vector<std::string> more = {"--segments",         kCine / "lv_00.mha", "--csv",
                                   folder / "ticks.csv", "--black-box",       folder / "."};
  const std::string page = folder / "page.html";
  if (writes_pages()) more.insert(more.end(), {"--page", page});
  const Outcome result = run_computed(feel(kCine / "frame_00.mha", more));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  if (writes_pages()) {
    const auto shown = page_data(page);
    // One frame, which stands still: no motion over it. The second label lies in the first one.
    ASSERT_EQ(shown["volumes"].size(), 2U);
    EXPECT_EQ(shown["volumes"][1]["role"], "labels");
    const auto labels = files::read_volume(kCine / "lv_00.mha");
    ASSERT_TRUE(labels) << labels.error().message;
    const glm::dvec3 spacing = labels->grid.spacing_mm;
    for (const int label : {1, 2}) {
      const double ml = 1e-3 * spacing.x * spacing.y * spacing.z *
                        double(std::count(labels->values.begin(), labels->values.end(), label));
      EXPECT_NEAR(shown["plots"][0]["curves"][label - 1]["y"][0].get<double>(), ml, 0.08 * ml);
    }
    EXPECT_EQ(shown["plots"][1]["title"], "Thickness of the wall (mm)");
    // The pig's left ventricle: 4 to 12 mm.
    const auto thickness_mm = shown["plots"][1]["curves"][0]["y"][0].get<double>();
    EXPECT_GT(thickness_mm, 4.0);
    EXPECT_LT(thickness_mm, 12.0);
    EXPECT_EQ(shown["plots"][2]["title"], "Force (N)");
    const auto& force = shown["plots"][2]["curves"][0]["y"];
    EXPECT_GT(*std::max_element(force.begin(), force.end()), 0.5);
  }
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("Segment   label 1, colour"), HasSubstr("Segment   label 2, colour"),
                    HasSubstr("a wall of 4 N, 4000 N/m")));
  const Table ticks(folder / "ticks.csv");
  double most = 0.0;
  running::ForceChange change;
  for (size_t k = 0; k < ticks.size(); ++k) {
    most = std::max(most, ticks.force(k));
    change.add(ticks.number(k, "dt_s"), {ticks.force(k), 0.0, 0.0});
  }
  // A wall that releases the hand changes the force by 1.6 N in a tick. The remaining change is the
  // hand's, which moves with up to 0.14 m/s on a spring of 600 N/m.
  EXPECT_GT(most, 0.5);
  EXPECT_LT(change.largest_n_per_ms(), 0.1);
}

TEST(Feel, FeelsTheHeartOfTheExamplesStillUntilItsMotionIsKnown) {
  NEEDS_CINE();
  const Outcome result =
      run_computed(feel(std::string(PALPATE_SOURCE_DIR) + "/docs/examples/heart.json",
                        {"--folder", kCine, "--no-motion", "--seconds", "1"}));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("20 frames in 0.601 s, of which frame 0 stands still"),
                    HasSubstr("Segment   epicardium"), HasSubstr("a wall of 2 N, 800 N/m")));
}

TEST(Feel, SaysWhatIsWrongWithASegmentation) {
  NEEDS_CINE();
  const Outcome image = run(feel(kCine / "frame_00.mha", {"--segments", kCine / "frame_00.mha"}));
  EXPECT_EQ(image.exit_code, 2);
  EXPECT_THAT(image.err, HasSubstr("frame_00.mha' holds"));
  const Outcome name =
      run(feel(kCine / "frame_00.mha", {"--segments", kCine / "lv_00.mha", "--segment", "atrium"}));
  EXPECT_EQ(name.exit_code, 2);
  EXPECT_THAT(name.err, HasSubstr("has no segment \"atrium\": it has \"label 1\", \"label 2\""));
  std::vector<std::string> own = {kCine / "frame_01.mha", "--segments", kCine / "lv_00.mha",
                                  "--values", "own"};
  const Outcome values = run(feel(kCine / "frame_00.mha", own));
  EXPECT_EQ(values.exit_code, 2);
  EXPECT_THAT(values.err,
              HasSubstr("lv_00.mha' is the segmentation of one frame, and each frame's own"));
}

TEST(Feel, DerivesAWallWhereTheValuesHaveNone) {
  NEEDS_CINE();
  const TemporaryFolder folder;
  const Outcome made = run_computed(
      feel(kCine / "frame_00.mha", {"--csv", folder / "ticks.csv", "--black-box", folder / "."}));
  ASSERT_EQ(made.exit_code, 0) << made.out << made.err;
  EXPECT_THAT(
      made.out,
      AllOf(HasSubstr("Segment   wall, colour"),
            HasSubstr("is no closed wall: at 33 % of its places"),
            HasSubstr("The wall to feel is derived from the values: the border of what is brighter "
                      "than 43.85, in frame 0 smoothed by 3 mm.")));
  const Table ticks(folder / "ticks.csv");
  double most = 0.0;
  for (size_t k = 0; k < ticks.size(); ++k) most = std::max(most, ticks.force(k));
  EXPECT_GT(most, 0.5);

  const Outcome plain = run({"plan", kCine / "frame_00.mha", "--wall", "values"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.out, AllOf(HasSubstr("felt by    surface"), HasSubstr("--wall region")));
  // Two frames without motion: the wall stands still until the motion is estimated; without
  // estimation it is the wall of the values.
  const Outcome waits = run({"plan", kCine / "frame_00.mha", kCine / "frame_01.mha"});
  EXPECT_THAT(waits.out,
              AllOf(HasSubstr("felt by    wall"),
                    HasSubstr("The wall is that of frame 0: heart_cine stands still there")));
  const Outcome alone = run_computed(
      feel(kCine / "frame_00.mha", {kCine / "frame_01.mha", "--no-motion", "--seconds", "1"}));
  EXPECT_THAT(alone.out, Not(HasSubstr("Segment")));
}

TEST(Feel, DerivesTheWallThatIsAskedFor) {
  NEEDS_CINE();
  const Outcome ridges = run({"plan", kCine / "frame_00.mha", "--wall", "ridges"});
  ASSERT_EQ(ridges.exit_code, 0) << ridges.err;
  EXPECT_THAT(ridges.out,
              AllOf(HasSubstr("felt by    wall"),
                    HasSubstr("derived from the values: where the values rise most steeply")));
  const Outcome own = run({"plan", kCine / "frame_00.mha", kCine / "frame_01.mha", "--wall",
                           "region", "--values", "own"});
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_THAT(own.err, HasSubstr("leave 'own' out"));
  const Outcome both =
      run({"plan", kCine / "frame_00.mha", "--wall", "region", "--segments", kCine / "lv_00.mha"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--segments"));
  const Outcome bright = run(feel(kCine / "frame_00.mha", {"--wall", "region", "--level", "1e5"}));
  EXPECT_EQ(bright.exit_code, 2);
  EXPECT_THAT(bright.err, HasSubstr("nothing large enough that is brighter than 1e+05"));
}

TEST(Feel, SaysWhenValuesCanNotBeCarried) {
  NEEDS_CINE();
  const Outcome made = run(feel("heart", {"--values", "mean"}));
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_THAT(made.err, HasSubstr("'heart' is synthetic data, which have their own values"));
  const TemporaryFolder folder;
  const Outcome seen = run({"view", kCine / "frame_00.mha", kCine / "frame_01.mha", "--values",
                            "mean", "--picture", folder / "x.png"});
  EXPECT_EQ(seen.exit_code, 2);
  EXPECT_THAT(seen.err, HasSubstr("has no motion yet that could carry values"));
}

TEST(Feel, ReportsTheServosPeriodsAloneBesideThoseOfTheRun) {
  const TemporaryFolder folder;
  const Outcome result =
      run(feel("shell", {"--servo-report", "--seconds", "0.5", "--black-box", folder / "."}));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  int alone = 0, joined = 0;
  const size_t at = result.out.find("Servo     alone:");
  ASSERT_NE(at, std::string::npos) << result.out;
  EXPECT_EQ(std::sscanf(result.out.c_str() + result.out.find("us in ", at), "us in %d", &alone), 1);
  const size_t then = result.out.find("in this run:", at);
  ASSERT_NE(then, std::string::npos) << result.out;
  EXPECT_EQ(std::sscanf(result.out.c_str() + result.out.find("us in ", then), "us in %d", &joined),
            1);
  // Alone for ten times as long: far more ticks, also on a busy machine.
  EXPECT_GT(alone, joined);
  EXPECT_GT(joined, 0);
}

TEST(Feel, RecordsARunAndReplaysItBitByBit) {
  const TemporaryFolder folder;
  const std::string file = folder / "run.ticks";
  const Outcome felt = run_computed(
      feel("molecule", {"--seconds", "3", "--record", file, "--black-box", folder / "."}));
  ASSERT_EQ(felt.exit_code, 0) << felt.out << felt.err;
  const Outcome again = run({"feel", "molecule", "--replay", file});
  EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
  EXPECT_THAT(again.out, HasSubstr("every output is the recorded one, bit by bit"));
  const Outcome other = run({"feel", "heart", "--replay", file});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("was made with another scene"));
}

TEST(Feel, IsFeltWithTwoDevicesWhoseRecordingsReplay) {
  const TemporaryFolder folder;
  const Outcome felt = run(
      feel("molecule", {"--seconds", "3", "--second-device", "simulated", "--record",
                        folder / "run.ticks", "--csv", folder / "run.csv", "--black-box", "off"}));
  ASSERT_EQ(felt.exit_code, 0) << felt.out << felt.err;
  EXPECT_THAT(felt.out, HasSubstr("Second    simulated device, as asked."));
  for (const char* name : {"run", "run.second"}) {
    const Table ticks(folder / (std::string(name) + ".csv"));
    double most_n = 0.0;
    for (size_t row = 0; row < ticks.size(); ++row) most_n = std::max(most_n, ticks.force(row));
    EXPECT_GT(most_n, 0.05) << name;
    const Outcome again =
        run({"feel", "molecule", "--replay", folder / (std::string(name) + ".ticks")});
    EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
    EXPECT_THAT(again.out, HasSubstr("every output is the recorded one, bit by bit")) << name;
  }
  for (const char* wrong : {"auto", "mouse", "none"}) {
    const Outcome refused = run(feel("molecule", {"--second-device", wrong}));
    EXPECT_EQ(refused.exit_code, 2) << refused.out;
    EXPECT_THAT(refused.err, HasSubstr("name a force device")) << wrong;
  }
}

TEST(Feel, LaysStreamTubesByTheDevicesButtonAndAgainWhenReplayed) {
  const TemporaryFolder folder;
  // A short press; one that is longer than a second, which clears; and two in quick succession, of
  // which the second keeps the tube of the first.
  std::ofstream(folder / "path.csv") << "0,0.01,0.02,0.015,0\n1,0.01,0.02,0.015,1\n"
                                        "1.1,-0.01,0.01,0.01,0\n1.6,-0.01,0.01,0.01,1\n"
                                        "2.9,0.012,-0.02,0.01,0\n3.2,0.012,-0.02,0.01,1\n"
                                        "3.3,0.012,-0.02,0.01,0\n3.45,0.012,-0.02,0.01,1\n"
                                        "3.55,0.012,-0.02,0.01,0\n";
  const std::vector<std::string> how = {"--path", folder / "path.csv", "--seconds", "4"};
  std::vector<std::string> more = how;
  more.insert(more.end(), {"--tubes", folder / "felt.vtk", "--record", folder / "run.ticks",
                           "--black-box", folder / "."});
  const Outcome felt = run_computed(feel("molecule", more));
  ASSERT_EQ(felt.exit_code, 0) << felt.out << felt.err;
  EXPECT_THAT(felt.out, HasSubstr("Tubes     1 stream tube, 1 of them kept"));
  const Outcome again = run(
      {"feel", "molecule", "--replay", folder / "run.ticks", "--tubes", folder / "replayed.vtk"});
  ASSERT_EQ(again.exit_code, 0) << again.out << again.err;
  EXPECT_THAT(again.out, HasSubstr("Tubes     1 stream tube"));
  const auto bytes = [](const std::string& file) {
    std::ifstream stream(file);
    return std::string((std::istreambuf_iterator<char>(stream)), {});
  };
  const std::string text = bytes(folder / "felt.vtk");
  EXPECT_EQ(bytes(folder / "replayed.vtk"), text);
  EXPECT_THAT(text, HasSubstr("SPACE=LPS"));
  EXPECT_THAT(text, HasSubstr("LINES 1 "));
  // With a dead-man switch the buttons enable the force, and lay no tubes.
  more = how;
  more.insert(more.end(), {"--dead-man", "--tubes", folder / "none.vtk"});
  const Outcome dead_man = run_computed(feel("molecule", more));
  EXPECT_EQ(dead_man.exit_code, 0) << dead_man.err;
  EXPECT_THAT(bytes(folder / "none.vtk"), HasSubstr("LINES 0 0"));
  const Outcome wrong = run(feel("molecule", {"--tubes", folder / "tubes.stl"}));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("let it end in .vtk"));
}

TEST(Feel, StreamTubesOfABeatingHeartAreItsVelocity) {
  const TemporaryFolder folder;
  std::ofstream(folder / "path.csv") << "0,0.02,0.015,0.02,0\n2.3,0.02,0.015,0.02,1\n"
                                        "2.4,0.02,0.015,0.02,0\n";
  const Outcome felt = run_computed(feel(
      "shell", {"--path", folder / "path.csv", "--seconds", "3", "--tubes", folder / "felt.vtk"}));
  ASSERT_EQ(felt.exit_code, 0) << felt.out << felt.err;
  EXPECT_THAT(felt.out, HasSubstr("Tubes     1 stream tube"));
  std::ifstream stream(folder / "felt.vtk");
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_THAT(text, HasSubstr("field 1 1 double\n3\n"));
}

TEST(Feel, EstimatesTheMotionOfASequenceWhileTheStillFrameIsFelt) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(), folder / "heart.seq.nrrd");
  const Outcome result = run_computed(feel(
      heart, {"--csv", folder / "ticks.csv", "--preset", "fast", "--black-box", folder / "."}));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("still at first"), HasSubstr("between the two main"),
                                HasSubstr("coarse, known after")));
  const Table ticks(folder / "ticks.csv");
  ASSERT_GT(ticks.size(), 100u);
  // Still until the motion is estimated, but for the 20 ms in which it comes to rest; then it
  // plays.
  EXPECT_LT(ticks.number(50, "frame_and_phase"), 0.1);
  double farthest = 0.0;
  for (size_t k = 0; k < ticks.size(); ++k)
    farthest = std::max(farthest, ticks.number(k, "frame_and_phase"));
  EXPECT_GT(farthest, 2.0);
}

TEST(Feel, UsesTheFieldsThatMotionHasWritten) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(), folder / "heart.seq.nrrd");
  for (const auto& [model, plan, felt] :
       {std::tuple("pairwise", "4 of 4 steps known", "with its motion"),
        std::tuple("sequence", "one for all times", "with one motion for all of them")}) {
    ASSERT_EQ(run({"motion", heart, "-o", folder / model, "--cyclic", "--confidence", "--preset",
                   "fast", "--no-verdict", "--quiet", "--model", model})
                  .exit_code,
              0);
    const Outcome planned = run({"plan", heart, "--fields", folder / model});
    EXPECT_EQ(planned.exit_code, 0) << planned.err;
    EXPECT_THAT(planned.out, AllOf(HasSubstr(plan), HasSubstr("back-tracking by")));
    const Outcome result = run_computed(
        feel(heart, {"--fields", folder / model, "--seconds", "1", "--black-box", folder / "."}));
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr(std::string("4 frames in 1 s, ") + felt));
  }
}

TEST(Feel, EndsByARampWithItsSummaryOnCtrlC) {
  const TemporaryFolder folder;
  Program program(feel("molecule", {"--seconds", "600", "--black-box", folder / "."}));
  ASSERT_TRUE(program.wait_for(" Hz "));
  program.signal(SIGINT);
  const Outcome result = program.wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("Felt"), HasSubstr("stopped")));
}

TEST(Feel, KeepsTheTicksAroundAFaultWithTheProgramsStateAndSaysWhere) {
  const TemporaryFolder folder;
  const std::filesystem::path state = folder / "state", kept = state / "palpate";
  const auto files = [&] {
    size_t count = 0;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(kept, none))
      count += entry.path().filename().string().starts_with("palpate-");
    return count;
  };
  ::setenv("XDG_STATE_HOME", state.c_str(), 1);
  Program program(
      {"feel", "molecule", "--device", "simulated", "--seconds", "600", "--watchdog", "1000"});
  ::unsetenv("XDG_STATE_HOME");
  ASSERT_TRUE(program.wait_for(" Hz "));
  // Stopped for longer than the watchdog waits.
  program.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  program.signal(SIGCONT);
  for (int n = 0; n < 6000 && files() == 0 && !program.ended(); ++n)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  program.signal(SIGINT);
  const Outcome result = program.wait();
  EXPECT_EQ(files(), 1U) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("Wrote     " + kept.string() + "/palpate-"));
}

TEST(Feel, SaysInOneSentenceWhatIsWrong) {
  const TemporaryFolder folder;
  const std::string scene = folder / "scene.json";
  std::ofstream(scene) << R"({"volumes": [{"name": "a", "source": "molecule", "colour": 3}],
                              "modes": [{"volume": "a", "strength": 2}]})";
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"feel", "hart"}, "'hart' does not exist"},
      {{"feel", scene}, "colour"},
      {{"feel", "molecule", "--device", "simulated", "--hand", "third"}, "'third' is not known"},
      {{"feel", "molecule", "--device", "simulated", "--path", "wiggle"}, "'wiggle' is no file"},
      {{"feel", "molecule", "--device", "haptic"}, "haptic"},
      {{"feel", "molecule", "--device", "simulated", "--csv", "/nowhere/x.csv"}, "/nowhere/x.csv"},
      {{"feel", "molecule", "--falcon-firmware", "/nowhere/fw.bin", "--device", "falcon"},
       "/nowhere/fw.bin"},
      {{"plan", scene}, "colour"},
  };
  for (const auto& [arguments, sentence] : cases) {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments[1] << "\n" << result.out;
    EXPECT_THAT(result.err, HasSubstr(sentence));
    EXPECT_THAT(result.out, Not(HasSubstr("Felt")));
  }
}

TEST(Plan, NamesWhatIsNeededAndWhatIsLeftOut) {
  const Outcome heart = run({"plan", "heart"});
  EXPECT_EQ(heart.exit_code, 0) << heart.err;
  EXPECT_THAT(heart.out, AllOf(HasSubstr("8 of 8 steps known"), HasSubstr("felt by    wall"),
                               HasSubstr("pose: its transform does not change")));
  const Outcome molecule = run({"plan", "molecule"});
  EXPECT_THAT(molecule.out, AllOf(HasSubstr("turning, at the tick's own time"),
                                  HasSubstr("left out   phase, back-tracking, blending")));
}

TEST(Plan, SaysWhatAThinWallHolds) {
  // A closed shell of three voxels of 1 mm.
  const TemporaryFolder folder;
  const glm::ivec3 size(40);
  Volume volume{{size, glm::dvec3(1.0)}, std::vector<float>(64000)};
  for (int z = 0, i = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x, ++i) {
        const double r_mm = glm::length(glm::dvec3(x, y, z) - 19.5);
        volume.values[size_t(i)] = r_mm > 13.0 && r_mm < 16.0 ? 1.0F : 0.0F;
      }
  written(volume, folder / "shell.mha");
  const auto planned = [&](double scale) {
    std::ofstream(folder / "shell.json") << R"({"volumes": [{"name": "shell", "files": "shell.mha",
      "segments": {"files": "shell.mha"}, "transform": {"scale": )"
                                         << scale << "}}]}";
    const Outcome outcome = run({"plan", folder / "shell.json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  };
  static const std::regex line(
      "a wall of 4 N, 4000 N/m; at ([0-9.]+|its own size)(?: of its size)? a tenth of it is at "
      "most ([0-9.]+) mm thick and holds ([0-9.]+) N");
  // Less than what 4000 N/m have in the middle: the distance is smooth there.
  for (const double scale : {1.0, 0.25}) {
    const std::string said = planned(scale);
    std::smatch found;
    ASSERT_TRUE(std::regex_search(said, found, line)) << said;
    EXPECT_EQ(found[1], scale == 1.0 ? "its own size" : "0.25");
    EXPECT_NEAR(std::stod(found[2]), 3.0 * scale, 0.6 * scale) << said;
    EXPECT_GT(std::stod(found[3]), 0.2 * 6.0 * scale) << said;
    EXPECT_LT(std::stod(found[3]), std::min(4.0, 6.0 * scale)) << said;
  }
  // A body is thick enough.
  for (float& value : volume.values) value = 0.0F;
  for (int z = 8; z < 32; ++z)
    for (int y = 8; y < 32; ++y)
      for (int x = 8; x < 32; ++x) volume.values[volume.grid.offset(x, y, z)] = 1.0F;
  written(volume, folder / "shell.mha");
  EXPECT_THAT(planned(1.0), AllOf(HasSubstr("a wall of 4 N, 4000 N/m"), Not(HasSubstr("thick"))));
}

TEST(Feel, GuidesTheHandAlongAFlowAndDrawsItsTubes) {
  const TemporaryFolder folder;
  Field flow = still_field(small_heart(1).frames[0].grid);
  for (glm::vec3& v : flow.u_mm) v = {0.0F, 0.0F, 10.0F};
  written(flow, folder / "flow.mha");
  std::ofstream(folder / "flow.json") << R"({
    "volumes": [{"name": "flow", "files": "flow.mha", "transform": {"scale": 0.5}}],
    "modes": [{"kind": "follow", "strength": {"pairs": [[0, 0], [10, 3]]}}]})";
  for (const char* what : {"flow.mha", "flow.json"}) {
    const std::filesystem::path csv = folder / (std::string(what) + ".csv");
    const std::filesystem::path pictures = folder / (std::string(what) + "_pictures");
    const Outcome result =
        run_computed(feel(folder / what, {"--seconds", "4", "--csv", csv.string(), "--headless",
                                          pictures.string(), "--black-box", folder / "."}));
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_TRUE(std::filesystem::exists(pictures / "view_1.png")) << result.out;
    const Table table(csv);
    double along = 0.0, across = 0.0;
    for (size_t row = 0; row < table.size(); ++row) {
      if (table.text(row, "cause") != "none") continue;
      along = std::max(along, std::abs(table.number(row, "force_y_n")));
      across = std::max(across,
                        std::hypot(table.number(row, "force_x_n"), table.number(row, "force_z_n")));
    }
    EXPECT_GT(across, 0.2) << what << ": leaving a line of the flow needs a force";
    EXPECT_LT(along, 0.01 * across) << what << ": moving along it needs none";
  }
}

}  // namespace
}  // namespace palpate::app
