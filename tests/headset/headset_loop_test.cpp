// The headset's loop as a host runs it, without the program: a session of the host's, the loop, and
// the tests' OpenXR runtime, whose records are checked.
#include "integration/headset/headset_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>

#include "compute/volume/phantom.h"
#include "integration/loading/load_scene.h"
#include "module/haptics/servo/position_source.h"
#include "tests/support/device.h"
#include "tests/xr/runtime/control.h"

namespace palpate::headset {
namespace {

using namespace std::chrono_literals;
using test::fake::control;
using Kind = HeadsetEvent::Kind;

/// Runs before the OpenXR loader is used; no other thread runs yet.
[[maybe_unused]] const int kChosen = [] {
  setenv("XR_RUNTIME_JSON", PALPATE_FAKE_RUNTIME, 1);
  return 0;
}();

/// The shell as one frame that a program has in memory.
LoadedScene shell_in_memory() {
  auto given = std::make_shared<loading::GivenVolume>();
  given->frames = shell_phantom(32, 1, 1, 0.0);
  loading::SequenceChoices choices;
  choices.given["shell"] = given;
  auto scene = loading::load_scene({"shell"}, choices);
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return scene ? std::move(*scene) : LoadedScene{};
}

/// A host with a session whose device is a position source behind a headset's gate.
class HostWithHeadset : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::device().context) GTEST_SKIP() << test::device().why_not;
    control().reset();
    LoadedScene scene = shell_in_memory();
    make_movable(scene);
    auto source = std::make_unique<PositionSource>();
    position = source.get();
    gate = std::make_unique<GatedDevice>(std::move(source));
    SessionOptions options;
    GatedDevice::guard(options.haptics.safety);
    options.servo.real_time = {.priority = 0, .lock_memory = false, .cores_awake = false};
    auto started = Session::start(scene, *gate, options);
    ASSERT_TRUE(started) << started.error().message;
    session = std::move(*started);
  }
  void TearDown() override {
    if (loop) loop->end();
    if (session) session->stop();
    loop.reset();
    EXPECT_EQ(control().alive(), "");
    EXPECT_THAT(control().violations(), ::testing::IsEmpty());
  }

  void start_loop(const HeadsetLoopOptions& options, bool has_controller) {
    loop = std::make_unique<HeadsetLoop>(options);
    HeadsetScene scene;
    scene.session = session.get();
    scene.gate = gate.get();
    scene.controller = has_controller ? position : nullptr;
    scene.sound = false;
    loop->begin(scene);
  }
  SceneSnapshot newest() {
    session->newest(SnapshotReader::kLive, snapshot_);
    return snapshot_;
  }
  /// Waits until the condition is true; false after a minute.
  bool until(const std::function<bool()>& so) {
    for (int k = 0; k < 6000; ++k) {
      for (HeadsetEvent& event : loop->news()) events.push_back(std::move(event));
      if (so()) return true;
      std::this_thread::sleep_for(10ms);
    }
    return false;
  }
  int heard(Kind kind) const {
    return int(std::count_if(events.begin(), events.end(),
                             [&](const HeadsetEvent& event) { return event.kind == kind; }));
  }

  PositionSource* position = nullptr;
  std::unique_ptr<GatedDevice> gate;
  std::unique_ptr<Session> session;
  std::unique_ptr<HeadsetLoop> loop;
  std::vector<HeadsetEvent> events;

 private:
  SceneSnapshot snapshot_;
};

TEST_F(HostWithHeadset, IsSeenOnlyOnceThePictureIsShownAndItsControllerMovesTheProbe) {
  loop = std::make_unique<HeadsetLoop>();
  EXPECT_TRUE(loop->found().headset);
  ASSERT_TRUE(until([&] { return newest().cause == Cause::kUnseen; })) << word(newest().cause);
  loop.reset();

  start_loop({}, true);
  ASSERT_TRUE(until([&] { return newest().cause != Cause::kUnseen; })) << word(newest().cause);
  // A hand's breadth to the right: in the world the probe moves as far as the hand in the room.
  uint64_t scripted = 0;  // frames shown when the hand was moved
  const auto at = [&](float x_m) {
    control().script_hand(1, [x_m](XrTime) { return XrPosef{{0, 0, 0, 1}, {x_m, 1.45F, -0.4F}}; });
    scripted = control().frames();
  };
  at(0.0F);
  glm::dvec3 before(0.0);
  const auto rests = [&] {
    const glm::dvec3 last = std::exchange(before, newest().probe_m);
    // Frames on a busy machine are far apart: the probe rests, too, before the hand is read anew.
    return newest().cause != Cause::kDevice && glm::distance(last, before) < 1e-7 &&
           control().frames() > scripted + 5;
  };
  ASSERT_TRUE(until([&] { return heard(Kind::kNoCalibration) == 0 && rests(); }));
  const glm::dvec3 from_m = before;
  at(0.03F);
  ASSERT_TRUE(until([&] { return glm::distance(newest().probe_m, from_m) > 0.01 && rests(); }));
  EXPECT_NEAR(glm::distance(before, from_m), 0.03, 1e-4);
  // The renderer is made while frames run; the first ones have no picture.
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  loop->end();
  EXPECT_GT(loop->numbers().drawn, 0u);
  EXPECT_EQ(loop->numbers().sessions, 1u);
  EXPECT_EQ(heard(Kind::kNoCalibration), 0) << "a controller needs no calibration";
}

TEST_F(HostWithHeadset, HearsOnceThatItsDeviceIsNotCalibrated) {
  start_loop({}, false);
  ASSERT_TRUE(until([&] { return heard(Kind::kNoCalibration) > 0; }));
  const uint64_t frames = control().frames();
  // Nor is it reported again in the next session, for which the world is placed anew.
  control().lose_session();
  ASSERT_TRUE(until([&] { return control().calls("xrCreateSession") == 2; }));
  ASSERT_TRUE(until([&] { return control().frames() > frames + 50; }));
  EXPECT_EQ(heard(Kind::kNoCalibration), 1);
  EXPECT_EQ(heard(Kind::kNoPassThrough), 0) << "pass-through was not requested";
}

TEST_F(HostWithHeadset, KeepsTheVolumeBeforeAPersonWhoRecentresOrSaysOnceThatItMayStayBehind) {
  const auto says_so = [&] {
    return std::count_if(events.begin(), events.end(), [](const HeadsetEvent& event) {
      return event.sentence.find("XR_EXT_local_floor") != std::string::npos;
    });
  };
  start_loop({}, true);
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  EXPECT_EQ(control().last_frame().space, test::fake::kLocalFloor);
  EXPECT_EQ(says_so(), 0);
  loop.reset();

  control().reset();
  std::erase(control().setup().extensions, "XR_EXT_local_floor");
  start_loop({}, true);
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  EXPECT_EQ(control().last_frame().space, XR_REFERENCE_SPACE_TYPE_STAGE);
  control().lose_session();
  ASSERT_TRUE(until([&] { return control().calls("xrCreateSession") == 2; }));
  const uint64_t frames = control().frames();
  ASSERT_TRUE(until([&] { return control().frames() > frames + 10; }));
  EXPECT_EQ(says_so(), 1);
  loop.reset();

  // A calibrated device stands in the room: its world stays there.
  control().reset();
  start_loop({.calibrated = true}, true);
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  EXPECT_EQ(control().last_frame().space, XR_REFERENCE_SPACE_TYPE_STAGE);
}

TEST_F(HostWithHeadset, HearsOnceWhichRateTheDisplayHasAndEachChangeByTheRuntime) {
  const auto times_said = [&](const char* what) {
    return std::count_if(events.begin(), events.end(), [&](const HeadsetEvent& event) {
      return event.sentence.find(what) != std::string::npos;
    });
  };
  const auto frames_pass = [&] {
    const uint64_t frames = control().frames();
    return until([&] { return control().frames() > frames + 5; });
  };
  start_loop({}, true);
  ASSERT_TRUE(until([&] { return times_said(": a picture needs ") > 0; }));
  loop.reset();

  events.clear();
  control().reset();
  start_loop({.refresh_hz = 120.0}, true);
  ASSERT_TRUE(until([&] { return times_said("The display is to run at") > 0; }));
  EXPECT_EQ(times_said("The display is to run at 120 Hz, of 72, 90, 120."), 1);
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("has changed the display's rate"), 0) << "its own request";
  control().change_rate(72.0);
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("has changed the display's rate to 72 Hz."), 1);
  // In the next session the choice is made again, and not told again.
  control().lose_session();
  ASSERT_TRUE(until([&] { return control().calls("xrRequestDisplayRefreshRateFB") == 2; }));
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("The display is to run at"), 1);
  EXPECT_EQ(times_said("has changed the display's rate"), 1);
  loop.reset();

  events.clear();
  control().reset();
  std::erase(control().setup().extensions, XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME);
  start_loop({.refresh_hz = 120.0}, true);
  ASSERT_TRUE(until([&] { return times_said("stays as it is") > 0; }));
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("stays as it is"), 1);
}

TEST_F(HostWithHeadset, SeesItsControllersOrHearsOnceWhyNot) {
  const auto times_said = [&](const std::string& what) {
    return std::count_if(events.begin(), events.end(), [&](const HeadsetEvent& event) {
      return event.sentence.find(what) != std::string::npos;
    });
  };
  // Pixels of the green trigger, in both eyes; nothing else is green.
  const auto green = [&] {
    int found = 0;
    for (const test::fake::Picture& picture : control().pictures())
      for (const auto& light : picture.light)
        found += light[1] > 0.1F && light[1] > 4.0F * std::max(light[0], light[2]);
    return found;
  };
  const auto prepare = [&] {
    if (loop) loop.reset();
    events.clear();
    control().reset();
    control().setup().keep_pictures = true;
    control().setup().view_width = 320;
    control().setup().view_height = 240;
    control().script_hand(1, [](XrTime) { return XrPosef{{0, 0, 0, 1}, {0.1F, 1.65F, -0.3F}}; });
  };
  const auto frames_pass = [&] {
    const uint64_t frames = control().frames();
    return until([&] { return control().frames() > frames + 5; });
  };
  prepare();
  start_loop({}, true);
  ASSERT_TRUE(until([&] { return green() > 4; }));
  // Pressed into the grip it is not seen.
  control().setup().trigger_y = 0.0F;
  ASSERT_TRUE(until([&] { return green() == 0; }));
  EXPECT_EQ(times_said("drawn"), 0);

  prepare();
  std::erase(control().setup().extensions, "XR_EXT_interaction_render_model");
  start_loop({}, true);
  ASSERT_TRUE(until([&] { return times_said("(XR_EXT_interaction_render_model)") > 0; }));
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("Controllers are not drawn"), 1);
  EXPECT_EQ(green(), 0);

  prepare();
  control().setup().model = {1, 2, 3};
  start_loop({}, true);
  ASSERT_TRUE(until(
      [&] { return times_said("A controller is not drawn. The model can not be read") > 0; }));
  ASSERT_TRUE(until([&] { return control().last_frame().layers > 0; }));
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("A controller is not drawn"), 1) << "of both for the same reason";

  prepare();
  control().inject_always("xrCreateRenderModelEXT", XR_ERROR_LIMIT_REACHED);
  start_loop({.details = true}, true);
  ASSERT_TRUE(until([&] {
    return times_said(
               "The runtime does not give the shapes of its controllers: "
               "xrCreateRenderModelEXT returned -10.") > 0;
  }));
  ASSERT_TRUE(frames_pass());
  EXPECT_EQ(times_said("controllers"), 1);
}

TEST_F(HostWithHeadset, HearsThatTheHeadsetShowsNoRoom) {
  control().setup().blend_modes = {XR_ENVIRONMENT_BLEND_MODE_OPAQUE};
  start_loop({.pass_through = true}, false);
  EXPECT_TRUE(until([&] { return heard(Kind::kNoPassThrough) > 0; }));
}

}  // namespace
}  // namespace palpate::headset
