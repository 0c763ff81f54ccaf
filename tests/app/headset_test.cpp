// The unmodified program in a headset, as a user runs it, on the tests' OpenXR runtime; the test
// acts as the user. No test here measures time: the machine may be busy.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <glm/glm.hpp>

#include "integration/files/scene/calibration_file.h"
#include "tests/app/headset_play.h"
#include "tests/app/made_headset.h"
#include "tests/app/program.h"
#include "tests/app/ticks.h"
#include "tests/desktop/virtual_display.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(InAHeadset, AGrabbedVolumeDragsTheFeltOne) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  const double gap_m = glm::distance(way.start_m, way.surface_m);
  const std::string rest = path_file(folder, {{0.0, way.start_m}, {600.0, way.start_m}});
  setenv("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation", 1);
  setenv("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT", 1);
  MadeHeadset headset;
  Program program(feel(scene, {"--headset", "openxr", "--device", "simulated", "--hand", "firm",
                               "--path", rest, "--csv", folder / "ticks.csv"}));
  unsetenv("VK_INSTANCE_LAYERS");
  unsetenv("VK_LAYER_ENABLES");
  ASSERT_TRUE(says(program, "  free")) << program.said();
  // A hand that does not grip moves nothing. The world is aligned with the user, so its axes are
  // the room's.
  const glm::dvec3 towards_hand = -(gap_m + 0.008) * way.in();
  headset.say("glide 1 " + text_of(towards_hand) + " 0.5");
  auto frames = [&] { return std::stoul("0" + headset.ask()["frames"]); };
  const size_t before = frames();
  ASSERT_TRUE(wait_until([&] { return frames() > before + 60; }));
  EXPECT_THAT(program.said(), Not(HasSubstr("touching")));
  // Now it grips the volume, and moves it to the hand that feels.
  headset.say(kSelect + std::string("1"));
  const size_t held = frames();
  ASSERT_TRUE(wait_until([&] { return frames() > held + 5; }));
  headset.say("glide 1 " + text_of(towards_hand) + " 1");
  // Contact begins before the volume is at its end: the grip is kept until the force is there.
  ASSERT_TRUE(says(program, "touching")) << program.said();
  ASSERT_TRUE(feels(program, 0.5)) << program.said();
  headset.say(kSelect + std::string("0"));
  // On a busy machine a frame may have no picture.
  EXPECT_TRUE(wait_until([&] { return headset.ask()["depth"] == "1"; }));
  headset.say("exit");
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Shown     in the headset: made headset"));
  EXPECT_THAT(outcome.out, HasSubstr("The session in the headset was ended."));
  // The device's place is not known: this is reported once, with what to do about it.
  const size_t guess = outcome.out.find("is a guess");
  ASSERT_NE(guess, std::string::npos) << outcome.out;
  EXPECT_THAT(outcome.out.substr(guess), HasSubstr("palpate calibrate -o room.json"));
  EXPECT_EQ(outcome.out.find("is a guess", guess + 1), std::string::npos);
  std::string layers = outcome.out;
  // Before all else newer ones say that the variable above has another name for them.
  if (layers.starts_with("Validation Warning: [ VALIDATION-SETTINGS ]"))
    layers.erase(0, layers.find("\n\n"));
  EXPECT_THAT(layers, Not(HasSubstr("Validation")));
  EXPECT_THAT(outcome.err, Not(HasSubstr("alidation")));
  EXPECT_THAT(headset.left(), HasSubstr("violations 0"));
  const Table ticks(folder / "ticks.csv");
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) most_n = std::max(most_n, ticks.force(row));
  EXPECT_GT(most_n, 0.5) << "the wall was moved 8 mm past the hand";
  expect_no_jump(ticks);
}

TEST_F(InAHeadset, TheForceRampsDownWhenThePictureIsLostAndComesBackWithIt) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  const std::string path = path_file(folder, presses(way));
  MadeHeadset headset;
  Program program(feel(scene, {"--headset", "openxr", "--device", "simulated", "--path", path,
                               "--csv", folder / "ticks.csv"}));
  ASSERT_TRUE(says(program, "touching")) << program.said();
  headset.say("headset off");
  headset.say("lose session");
  ASSERT_TRUE(says(program, "the force goes down until it is back")) << program.said();
  ASSERT_TRUE(says(program, "unseen")) << program.said();
  headset.say("headset on");
  ASSERT_TRUE(says(program, "The picture is back in the headset")) << program.said();
  ASSERT_TRUE(says(program, "touching", program.said().find("The picture is back")));
  headset.say("exit");
  EXPECT_EQ(program.wait().exit_code, 0);
  EXPECT_THAT(headset.left(), HasSubstr("violations 0"));
  const Table ticks(folder / "ticks.csv");
  expect_no_jump(ticks);
  // Not visible while the session begins, and then a second time: then the force goes to zero and
  // stays there.
  size_t last_unseen = 0;
  double at_rest_n = -1.0, after_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row)
    if (ticks.text(row, "cause") == "unseen") last_unseen = row;
  ASSERT_GT(last_unseen, 1000u);
  at_rest_n = ticks.force(last_unseen);
  for (size_t row = last_unseen; row < ticks.size(); ++row)
    after_n = std::max(after_n, ticks.force(row));
  EXPECT_EQ(at_rest_n, 0.0);
  EXPECT_GT(after_n, 0.5);
}

TEST_F(InAHeadset, TheForceGoesOnWithoutAPictureIfThatWasChosen) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  const std::string path = path_file(folder, presses(way));
  MadeHeadset headset;
  Program program(feel(scene, {"--headset", "openxr", "--on-headset-loss", "go-on", "--device",
                               "simulated", "--path", path, "--csv", folder / "ticks.csv"}));
  ASSERT_TRUE(says(program, "touching")) << program.said();
  headset.say("runtime down");
  headset.say("lose instance");
  ASSERT_TRUE(says(program, "the force goes on")) << program.said();
  ASSERT_TRUE(says(program, "touching", program.said().size())) << program.said();
  headset.say("runtime up");
  ASSERT_TRUE(says(program, "The picture is back in the headset")) << program.said();
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("in 2 sessions"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("unseen")));
}

/// The pixels of one eye's half that are redder than the blue-grey background.
int red_pixels(const MadeHeadset::Shown& shown, int eye) {
  int red = 0;
  if (shown.rgb.size() < 3 * size_t(shown.width) * size_t(shown.height)) return red;
  for (int y = 0; y < shown.height; ++y)
    for (int x = eye * shown.width / 2; x < (eye + 1) * shown.width / 2; ++x) {
      const size_t at = 3 * (size_t(y) * size_t(shown.width) + size_t(x));
      red += int(uint8_t(shown.rgb[at])) > int(uint8_t(shown.rgb[at + 2])) + 25;
    }
  return red;
}

TEST_F(InAHeadset, AControllerFeelsWithVibrationAndPausesTheHeart) {
  MadeHeadset headset;
  headset.say("view 320 240");
  headset.say("pictures on");
  // The scene is 0.45 m in front of the eyes and 0.15 m below them.
  headset.say("hand 1 0.12 1.45 -0.45");
  // Neither headset nor device is named: the program chooses both from what it finds.
  Program program(feel("shell", {"--csv", folder / "ticks.csv"}));
  ASSERT_TRUE(says(program, "  free")) << program.said();
  headset.say(kMenu + std::string("1"));
  EXPECT_EQ(headset.ask()["haptics"], "0") << "no contact yet";
  headset.say("glide 1 -0.10 0 0 2");
  ASSERT_TRUE(says(program, "touching")) << program.said();
  ASSERT_TRUE(wait_until([&] { return headset.ask()["haptics"] != "0"; }));
  EXPECT_GT(std::stod("0" + headset.ask()["amplitude"]), 0.01);
  // Both eyes see red parts of the shell. A busy machine shows its first picture after the contact.
  int red[2] = {};
  wait_until([&] {
    headset.ask();
    const MadeHeadset::Shown shown = headset.shown();
    for (const int eye : {0, 1}) red[eye] = red_pixels(shown, eye);
    return (red[0] > 15 && red[1] > 15) || program.ended();
  });
  EXPECT_GT(red[0], 15) << program.said();
  EXPECT_GT(red[1], 15) << program.said();
  headset.say("exit");
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Shown     in the headset: made headset"));
  EXPECT_THAT(outcome.out, HasSubstr("controller, as no force device is there"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("is a guess"))) << "the controller feels at its own place";
  EXPECT_THAT(headset.left(), HasSubstr("violations 0"));
  const Table ticks(folder / "ticks.csv");
  ASSERT_GT(ticks.size(), 100u);
  for (size_t row = ticks.size() - 50; row < ticks.size(); ++row)
    EXPECT_EQ(ticks.text(row, "frame_and_phase"), ticks.text(ticks.size() - 1, "frame_and_phase"));
}

TEST_F(InAHeadset, OneTouchedPointChecksTheCalibrationAlsoAfterARestartOfTheRuntime) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  const std::string rest = path_file(folder, {{0.0, way.start_m}, {600.0, way.start_m}});
  files::StoredCalibration stored;
  stored.calibration.stage_from_device = {{0.1, 0.9, -0.5},
                                          glm::angleAxis(0.5, glm::dvec3(0.0, 1.0, 0.0))};
  stored.calibration.controller_from_tip_m = {0.0, 0.0, -0.05};
  stored.calibration.used = stored.calibration.all = 12;
  stored.device = stored.headset = stored.runtime = "made";
  ASSERT_TRUE(files::write_calibration(folder / "room.json", stored));
  // The world of the heart is the device's: the tip is visible and felt there.
  const glm::dvec3 tip = stored.calibration.stage_from_device(way.start_m);
  const auto touch = [&](MadeHeadset& headset, double off_m) {
    headset.say("hand 1 " + text_of(tip + glm::dvec3(off_m, 0.0, 0.05)));
    const auto frames = [&] { return std::stoul("0" + headset.ask()["frames"]); };
    const size_t before = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > before + 5; }));
    headset.say(kSelect + std::string("1"));
    const size_t held = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > held + 5; }));
    headset.say(kSelect + std::string("0"));
  };
  MadeHeadset headset;
  Program program(feel(scene, {"--headset", "openxr", "--device", "simulated", "--hand", "none",
                               "--path", rest, "--calibration", folder / "room.json"}));
  ASSERT_TRUE(says(program, "that checks that the picture stands"))
      << program.said() << program.wait().err;
  touch(headset, 0.001);
  ASSERT_TRUE(says(program, "The picture stands where the device is, to 1.0 mm")) << program.said();
  headset.say("lose instance");
  ASSERT_TRUE(says(program, "may take the room for another")) << program.said();
  touch(headset, 0.020);
  ASSERT_TRUE(says(program, "The picture stands 20.0 mm off the device")) << program.said();
  touch(headset, 0.0);
  ASSERT_TRUE(says(program, "The picture stands where the device is, to 0.0 mm")) << program.said();
  EXPECT_THAT(program.said(), Not(HasSubstr("is a guess")));
  headset.say("exit");
  EXPECT_EQ(program.wait().exit_code, 0);
  EXPECT_THAT(headset.left(), HasSubstr("violations 0"));
}

TEST_F(InAHeadset, ForceActsOnlyWhileAControllersDeadManIsHeld) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  const std::string path = path_file(folder, presses(way));
  const std::string dead_man = "input /user/hand/right/input/menu/click ";
  MadeHeadset headset;
  Program program(feel(scene, {"--headset", "openxr", "--dead-man", "--device", "simulated",
                               "--path", path, "--csv", folder / "ticks.csv"}));
  ASSERT_TRUE(says(program, "dead-man")) << program.said();
  headset.say(dead_man + "1");
  ASSERT_TRUE(says(program, "touching")) << program.said();
  headset.say(dead_man + "0");
  ASSERT_TRUE(says(program, "dead-man", program.said().rfind("touching"))) << program.said();
  headset.say("exit");
  EXPECT_EQ(program.wait().exit_code, 0);
  const Table ticks(folder / "ticks.csv");
  expect_no_jump(ticks);
  size_t last = 0;
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) {
    if (ticks.text(row, "cause") == "dead-man") last = row;
    most_n = std::max(most_n, ticks.force(row));
  }
  EXPECT_GT(most_n, 0.5) << "no force while the volume was gripped";
  EXPECT_EQ(ticks.force(last), 0.0);
}

TEST_F(InAHeadset, IsSeenInAWindowAndInPicturesAtTheSameTime) {
  MadeHeadset headset;
  std::string why_not;
  const auto display = test::VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const auto path = path_file(folder, {{0.0, {0.0, 0.0, 0.07}}, {600.0, {0.0, 0.0, 0.07}}});
  Program program(feel("shell", {"--headset", "openxr", "--headless", folder / "pictures",
                                 "--picture-size", "96", "--device", "simulated", "--path", path}));
  ASSERT_TRUE(says(program, "A window shows the same to others.")) << program.said();
  // A red part of the shell in the middle of the window.
  EXPECT_TRUE(wait_until([&] {
    const uint32_t pixel = display->screenshot().at(560, 380);
    return int(pixel >> 16 & 255) > int(pixel & 255) + 25;
  }));
  EXPECT_TRUE(wait_until([&] { return std::stoi("0" + headset.ask()["layers"]) > 0; }));
  headset.say("exit");
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "pictures/view_1.png")) << outcome.out;
  EXPECT_THAT(headset.left(), HasSubstr("violations 0"));
}

TEST_F(InAHeadset, GoesOnWithoutItsWindow) {
  MadeHeadset headset;
  std::string why_not;
  auto display = test::VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const auto path = path_file(folder, {{0.0, {0.0, 0.0, 0.07}}, {600.0, {0.0, 0.0, 0.07}}});
  // Freed memory is overwritten, so that the program crashes if it uses it.
  setenv("MALLOC_PERTURB_", "165", 1);
  Program program(feel("shell", {"--headset", "openxr", "--device", "simulated", "--path", path}));
  unsetenv("MALLOC_PERTURB_");
  ASSERT_TRUE(says(program, "A window shows the same to others.")) << program.said();
  EXPECT_TRUE(wait_until([&] { return std::stoi("0" + headset.ask()["layers"]) > 0; }));
  display.reset();
  // The servo thread still writes every force to the window's listener.
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_FALSE(program.ended());
  headset.say("exit");
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("the headset goes on"));
}

TEST_F(InAHeadset, IsWaitedForWhileItIsOff) {
  MadeHeadset headset;
  headset.say("headset off");
  Program program(
      feel("shell", {"--headset", "openxr", "--device", "simulated", "--seconds", "600"}));
  ASSERT_TRUE(says(program, "in a headset, as asked, as soon as one is there")) << program.said();
  ASSERT_TRUE(says(program, "unseen")) << program.said();
  headset.say("headset on");
  EXPECT_TRUE(says(program, "The headset is there: made headset")) << program.said();
  headset.say("exit");
  EXPECT_EQ(program.wait().exit_code, 0);
}

/// The smallest and the largest sum of red, green and blue in the rows in the middle: the simulated
/// optics hide corners above and below.
std::pair<int, int> brightness(const MadeHeadset::Shown& shown) {
  int least = 3 * 255, most = 0;
  const size_t row = 3 * size_t(shown.width), height = size_t(shown.height);
  const size_t end = std::min(height * 3 / 4 * row, shown.rgb.size());
  for (size_t at = height / 4 * row; at + 2 < end; at += 3) {
    const int sum = int(uint8_t(shown.rgb[at])) + int(uint8_t(shown.rgb[at + 1])) +
                    int(uint8_t(shown.rgb[at + 2]));
    least = std::min(least, sum);
    most = std::max(most, sum);
  }
  return {least, most};
}

TEST_F(InAHeadset, PassThroughAddsNothingWhereNothingIs) {
  for (const bool pass_through : {false, true}) {
    MadeHeadset headset;
    headset.say("view 160 120");
    headset.say("pictures on");
    // Longer than the simulated hand's path, which may end before a busy machine has a picture.
    std::vector<std::string> more = {"--headset", "openxr",    "--device",
                                     "simulated", "--seconds", "600"};
    if (pass_through) more.emplace_back("--pass-through");
    Program program(feel(still_heart(folder), more));
    bool as_asked = false;
    wait_until([&] {
      headset.ask();
      const auto [least, most] = brightness(headset.shown());
      as_asked = most > 200 && (least == 0) == pass_through;
      return as_asked || program.ended();
    });
    ASSERT_TRUE(as_asked) << program.said();
    EXPECT_THAT(program.said(), Not(HasSubstr("does not show the room")));
    headset.say("exit");
    EXPECT_EQ(program.wait().exit_code, 0);
  }
}

TEST(WithoutAHeadset, SaysThatThereIsNoRuntime) {
  setenv("XR_RUNTIME_JSON", "/nowhere/at/all.json", 1);
  const Outcome outcome = run({"feel", "shell", "--headset", "openxr"});
  unsetenv("XR_RUNTIME_JSON");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("There is no OpenXR runtime: start one"));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST(WithoutAHeadset, AutoSaysWhyNobodySeesIt) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  setenv("XR_RUNTIME_JSON", "/nowhere/at/all.json", 1);
  const Outcome outcome = run({"feel", "shell", "--device", "simulated", "--seconds", "0.5"});
  unsetenv("XR_RUNTIME_JSON");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("nowhere, as there is no display and no headset"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("OpenXR")))
      << "no error about a headset that nobody named";
  EXPECT_EQ(outcome.err, "");
}

TEST(WithoutAHeadset, SaysWhichCallFailedOnlyWhenAsked) {
  setenv("XR_RUNTIME_JSON", "/nowhere/at/all.json", 1);
  const Outcome quiet = run({"feel", "heart", "--headset", "openxr"});
  const Outcome verbose = run({"feel", "heart", "--headset", "openxr", "--verbose"});
  unsetenv("XR_RUNTIME_JSON");
  EXPECT_EQ(quiet.exit_code, 2);
  EXPECT_THAT(quiet.err, Not(HasSubstr("returned")));
  EXPECT_EQ(verbose.exit_code, 2);
  EXPECT_THAT(verbose.err, HasSubstr("(xrEnumerateInstanceExtensionProperties returned -51.)"));
  // The message of the OpenXR loader, with the name of the manifest.
  EXPECT_THAT(verbose.err, HasSubstr("/nowhere/at/all.json"));
}

TEST(WithoutAHeadset, RefusesAControllerAndACalibrationThatIsNone) {
  const Outcome controller = run({"feel", "shell", "--headset", "off", "--device", "controller"});
  EXPECT_EQ(controller.exit_code, 2);
  EXPECT_THAT(controller.err, HasSubstr("--headset openxr"));
  const TemporaryFolder folder;
  std::ofstream(folder / "none.json") << "{}";
  const Outcome calibration =
      run({"feel", "shell", "--headset", "off", "--calibration", folder / "none.json"});
  EXPECT_EQ(calibration.exit_code, 2);
  EXPECT_THAT(calibration.err, HasSubstr("none.json"));
  const Outcome loss = run({"feel", "shell", "--on-headset-loss", "pray"});
  EXPECT_EQ(loss.exit_code, 2);
}

}  // namespace
}  // namespace palpate::app
