// Bare hands in the program as a user runs it: a pinching fingertip feels, with its colour and the
// tone as the evidence; taps and triggers lay stream tubes.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <regex>
#include <thread>

#include "tests/app/headset_play.h"

namespace palpate::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The scene's middle: 0.45 m in front of the eyes at (0, 1.6, 0) and 0.15 m below them.
constexpr glm::dvec3 kMiddle_m{0.0, 1.45, -0.45};
constexpr double kOpen_m = 0.05, kTouching_m = 0.0;

std::string fingers(glm::dvec3 tip_m, double gap_m, glm::dvec3 by_m = glm::dvec3(0.0),
                    double seconds = 1.0) {
  return fmt::format("fingers 1 {} {} {} {}", text_of(tip_m), gap_m, text_of(by_m), seconds);
}

class FingersInAHeadset : public InAHeadset {
 protected:
  void start(const std::string& scene, std::vector<std::string> more = {},
             const char* view = "160 120") {
    InAHeadset::SetUp();
    std::ofstream(folder / "asound.conf") << fmt::format(
        "pcm.!default {{ type file slave.pcm {{ type null }} file \"{}\" format raw }}\n", sound());
    setenv("ALSA_CONFIG_PATH", std::string(folder / "asound.conf").c_str(), 1);
    headset.emplace();
    headset->say(std::string("view ") + view);
    headset->say("rate 30");
    headset->say("pictures on");
    headset->say("no-hand 0");
    headset->say("no-hand 1");
    more.insert(more.end(), {"--csv", folder / "ticks.csv", "--no-box"});
    program.emplace(feel(scene, more));
    unsetenv("ALSA_CONFIG_PATH");
    ASSERT_TRUE(says(*program, "Without a controller, pinch to touch")) << program->said();
  }
  void frames_pass(size_t count = 4) {
    const auto frames = [&] { return std::stoul("0" + headset->ask()["frames"]); };
    const size_t before = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > before + count; })) << program->said();
  }
  Outcome end() {
    headset->say("exit");
    Outcome outcome = program->wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(headset->left(), HasSubstr("violations 0"));
    return outcome;
  }
  std::string sound() { return folder / "heard.raw"; }
  /// The number of 16-bit samples that are not silent.
  size_t heard() {
    std::ifstream stream(sound(), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
    size_t loud = 0;
    for (size_t k = 0; k + 1 < bytes.size(); k += 2) {
      int16_t sample = 0;
      std::memcpy(&sample, bytes.data() + k, 2);
      loud += std::abs(int(sample)) > 100;
    }
    return loud;
  }
  /// The number of blue pixels in the left eye's picture; neither the shell nor its background is
  /// blue.
  int blue() {
    headset->ask();
    const MadeHeadset::Shown shown = headset->shown();
    int count = 0;
    for (int y = 0; y < shown.height; ++y)
      for (int x = 0; x < shown.width / 2; ++x) {
        const size_t at = 3 * (size_t(y) * size_t(shown.width) + size_t(x));
        const auto part = [&](size_t c) { return int(uint8_t(shown.rgb[at + c])); };
        count += part(2) > 120 && part(2) > part(0) + 40;
      }
    return count;
  }

  std::optional<MadeHeadset> headset;
  std::optional<Program> program;
};

TEST_F(FingersInAHeadset, APinchingFingertipTouchesIsSeenAndHeardAndIsGoneWhenItOpens) {
  start(still_heart(folder));
  // First open, in front of the heart: no hand feels. Then it pinches there, and moves in.
  const glm::dvec3 before = kMiddle_m + glm::dvec3(0.0, 0.0, 0.07);
  headset->say(fingers(before, kOpen_m));
  frames_pass();
  EXPECT_THAT(program->said(), Not(HasSubstr("  free")));
  headset->say(fingers(before, kTouching_m));
  ASSERT_TRUE(says(*program, "  free")) << program->said();
  // Closer, after the scene was placed.
  headset->say("head 0 1.45 -0.15");
  frames_pass(20);
  EXPECT_EQ(blue(), 0);
  EXPECT_EQ(heard(), 0u);
  headset->say(fingers(before, kTouching_m, {0.0, 0.0, -0.05}, 2.0));
  ASSERT_TRUE(says(*program, "touching")) << program->said();
  EXPECT_TRUE(wait_until([&] { return blue() > 0; })) << "the fingertip has no colour of contact";
  EXPECT_TRUE(wait_until([&] { return heard() > 100; })) << program->said();
  EXPECT_EQ(headset->ask()["haptics"], "0") << "a bare hand can not vibrate";
  const size_t so_far = program->said().size();
  headset->say(fingers(before + glm::dvec3(0.0, 0.0, -0.05), kOpen_m));
  ASSERT_TRUE(says(*program, "device", so_far)) << program->said();
  EXPECT_TRUE(wait_until([&] { return blue() == 0; }));
  const Outcome outcome = end();
  EXPECT_THAT(outcome.out, HasSubstr("controller, as no force device is there"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("the ticks around a fault")))
      << "a hand that opens is no fault";
  const Table ticks(folder / "ticks.csv");
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) most_n = std::max(most_n, ticks.force(row));
  EXPECT_GT(most_n, 0.1);
  expect_no_jump(ticks);
  EXPECT_EQ(ticks.force(ticks.size() - 1), 0.0);
}

TEST_F(FingersInAHeadset, APinchTouchesWhereTheRuntimeGivesPosesAndNoJoints) {
  headset.emplace();
  for (const char* line :
       {"without XR_EXT_hand_tracking", "view 32 24", "rate 30", "no-hand 0", "no-hand 1"})
    headset->say(line);
  program.emplace(feel(still_heart(folder), {"--no-sound"}));
  ASSERT_TRUE(says(*program, "device")) << program->said();
  EXPECT_THAT(program->said(), Not(HasSubstr("pinch to touch"))) << "no hand was seen yet";
  const glm::dvec3 before = kMiddle_m + glm::dvec3(0.0, 0.0, 0.07);
  headset->say(fingers(before, kOpen_m));
  ASSERT_TRUE(says(*program, "Without a controller, pinch to touch")) << program->said();
  EXPECT_THAT(program->said(), Not(HasSubstr("  free")));
  headset->say(fingers(before, kTouching_m));
  ASSERT_TRUE(says(*program, "  free")) << program->said();
  headset->say(fingers(before, kTouching_m, {0.0, 0.0, -0.05}, 2.0));
  ASSERT_TRUE(says(*program, "touching")) << program->said();
  end();
}

TEST_F(FingersInAHeadset, AHandThatIsLostEndsTheForceByTheRampAndComesBackElsewhere) {
  // Nobody looks at the pictures; where they are slow, there is no force.
  start(still_heart(folder), {"--no-sound"}, "32 24");
  const glm::dvec3 before = kMiddle_m + glm::dvec3(0.0, 0.0, 0.07);
  headset->say(fingers(before, kTouching_m));
  ASSERT_TRUE(says(*program, "  free")) << program->said();
  headset->say(fingers(before, kTouching_m, {0.0, 0.0, -0.05}, 2.0));
  ASSERT_TRUE(says(*program, "touching")) << program->said();
  // The start ramp takes two seconds. On a busy machine pictures may be too rare for a force.
  static const std::regex last_n("([0-9.]+) N  phase[^\\n]*\\n$");
  ASSERT_TRUE(wait_until([&] {
    const std::string said = program->said();
    std::smatch found;
    return std::regex_search(said, found, last_n) && std::stod(found[1]) > 0.1;
  })) << program->said();
  size_t so_far = program->said().size();
  headset->say("no-fingers 1");
  ASSERT_TRUE(says(*program, "device", so_far)) << program->said();
  // Pinching again on the other side of the heart: the probe must not be moved through the heart.
  so_far = program->said().size();
  headset->say(fingers(kMiddle_m - glm::dvec3(0.0, 0.0, 0.07), kTouching_m));
  ASSERT_TRUE(says(*program, "  free", so_far)) << program->said();
  // A controller appears: now it is the hand that feels.
  so_far = program->said().size();
  headset->say("hand 1 " + text_of(kMiddle_m + glm::dvec3(0.12, 0.0, 0.0)));
  frames_pass(30);
  headset->say("no-hand 1");
  headset->say("no-fingers 1");
  ASSERT_TRUE(says(*program, "device", so_far)) << program->said();
  end();
  EXPECT_EQ(heard(), 0u);
  const Table ticks(folder / "ticks.csv");
  expect_no_jump(ticks);
  bool held = false, was_right = false;
  double most_n = 0.0;
  for (size_t row = 1; row < ticks.size(); ++row) {
    most_n = std::max(most_n, ticks.force(row));
    was_right |= ticks.number(row, "probe_x_m") > 0.11;
    if (ticks.text(row, "cause") != "device") continue;
    held |= ticks.force(row) > 0.0 && ticks.force(row) < ticks.force(row - 1);
  }
  EXPECT_GT(most_n, 0.3);
  EXPECT_TRUE(held) << "the force does not fall by a ramp";
  EXPECT_TRUE(was_right) << "the controller did not feel";
}

TEST_F(FingersInAHeadset, ATapLaysAStreamTubeWhereItTapped) {
  const std::string file = folder / "tubes.vtk";
  start("molecule", {"--tubes", file, "--no-sound"});
  const glm::dvec3 place = kMiddle_m + glm::dvec3(0.012, 0.02, 0.015);
  headset->say(fingers(place, kOpen_m));
  frames_pass();
  // A tap is shorter than 0.3 s, measured in frames of the runtime, so a busy machine does not
  // matter.
  for (int tries = 0; tries < 20; ++tries) {
    headset->say(fingers(place, kTouching_m));
    headset->ask();
    headset->say(fingers(place, kOpen_m));
    frames_pass();
  }
  const Outcome outcome = end();
  EXPECT_THAT(outcome.out, HasSubstr("Tubes     "));
  std::ifstream stream(file);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_THAT(text, HasSubstr("DATASET POLYDATA"));
  EXPECT_THAT(text, Not(HasSubstr("LINES 0 ")));
}

TEST_F(FingersInAHeadset, TwoTapsKeepTheStreamTubes) {
  start("molecule", {"--tubes", folder / "tubes.vtk", "--no-sound"});
  const glm::dvec3 place = kMiddle_m + glm::dvec3(0.012, 0.02, 0.015);
  headset->say(fingers(place, kOpen_m));
  frames_pass();
  // Repeated until it was fast enough, for a busy machine.
  for (int tries = 0; tries < 8; ++tries) {
    for (const double gap_m : {kTouching_m, kOpen_m, kTouching_m, kOpen_m}) {
      headset->say(fingers(place, gap_m));
      frames_pass(0);
    }
    frames_pass(20);
  }
  const Outcome outcome = end();
  EXPECT_THAT(outcome.out, HasSubstr("Tubes     "));
  EXPECT_THAT(outcome.out, Not(HasSubstr(" 0 of them kept")));
}

TEST_F(FingersInAHeadset, AControllersTriggerPressedTwiceKeepsThem) {
  MadeHeadset made;
  made.say("rate 30");
  made.say("view 32 24");
  made.say("hand 1 " + text_of(kMiddle_m + glm::dvec3(0.012, 0.02, 0.015)));
  Program felt(feel("molecule", {"--tubes", folder / "tubes.vtk"}));
  ASSERT_TRUE(says(felt, "starting")) << felt.said();
  const auto frames = [&] { return std::stoul("0" + made.ask()["frames"]); };
  const auto pass = [&](size_t count) {
    const size_t before = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > before + count; })) << felt.said();
  };
  pass(20);
  // Within four frames; again where these were too slow, on a busy machine.
  for (int tries = 0; tries < 8; ++tries) {
    made.say("tap /user/hand/right/input/menu/click\ntap /user/hand/right/input/menu/click");
    pass(24);
  }
  made.say("exit");
  const Outcome outcome = felt.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Tubes     "));
  EXPECT_THAT(outcome.out, Not(HasSubstr(" 0 of them kept")));
}

TEST_F(FingersInAHeadset, AControllersTriggerLaysAStreamTube) {
  const std::string file = folder / "tubes.vtk";
  MadeHeadset made;
  made.say("rate 30");
  made.say("view 32 24");
  made.say("hand 1 " + text_of(kMiddle_m + glm::dvec3(0.012, 0.02, 0.015)));
  Program felt(feel("molecule", {"--tubes", file}));
  // The molecule's guiding mode is felt everywhere in it.
  ASSERT_TRUE(says(felt, "starting")) << felt.said();
  const auto frames = [&] { return std::stoul("0" + made.ask()["frames"]); };
  const auto pass = [&](size_t count) {
    const size_t before = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > before + count; })) << felt.said();
  };
  pass(20);
  // Simple controllers have the command on the right one's menu button. A press of a single look of
  // the program at its actions, because a long one clears, and on a busy machine frames are long;
  // the next one after more than half a second, because an earlier one keeps.
  for (int press = 0; press < 2; ++press) {
    made.say("tap /user/hand/right/input/menu/click");
    pass(4);
    std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  made.say("exit");
  const Outcome outcome = felt.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Tubes     2 stream tubes, 0 of them kept"));
  EXPECT_TRUE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace palpate::app
