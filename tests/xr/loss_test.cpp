// What is lost comes back; what is missing from the start is reported in a sentence.

#include <cstdlib>
#include <fstream>

#include "tests/support/random.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;
using xr::HeadsetState;
using xr::Trouble;

class XrLoss : public XrTest {
 protected:
  /// Until focus, with a second per step, so that every retry is made.
  HeadsetState recover(int steps = 60) {
    for (int i = 0; i < steps && headset_report().state != HeadsetState::kFocused; ++i) {
      step();
      if (headset_report().state == HeadsetState::kWaiting) pass(1.0);
    }
    return headset_report().state;
  }
};

TEST_F(XrLoss, WaitsForAHeadsetThatIsOffAndSaysSoOnce) {
  runtime().setup().headset_on = false;
  headset();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kNoHeadset);
  EXPECT_THAT(headset_report().sentence, HasSubstr("switch it on"));
  for (int i = 0; i < 20; ++i) {
    pass(0.5);
    EXPECT_EQ(step().sentence, "");
  }
  EXPECT_GE(runtime().calls("xrGetSystem"), 10) << "must be polled each second";
  EXPECT_LE(runtime().calls("xrGetSystem"), 12);
  EXPECT_EQ(runtime().calls("xrCreateInstance"), 1);
  runtime().setup().headset_on = true;
  pass(1.0);
  EXPECT_THAT(step().sentence, HasSubstr("The headset is there"));
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, WaitsForARuntimeThatIsDown) {
  runtime().setup().runtime_up = false;
  headset();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kRuntimeDown);
  runtime().setup().runtime_up = true;
  pass(1.0);
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, SaysInOneSentenceThatThereIsNoRuntimeAndLooksAgainOnlyWhenAsked) {
  const std::string manifest = std::getenv("XR_RUNTIME_JSON");
  setenv("XR_RUNTIME_JSON", "/nonexistent/runtime.json", 1);
  xr::Headset& h = headset();
  EXPECT_EQ(step().state, HeadsetState::kNoRuntime);
  EXPECT_EQ(h.report().problem.trouble, Trouble::kNoRuntime);
  EXPECT_THAT(h.report().sentence, HasSubstr("There is no OpenXR runtime: start one"));
  setenv("XR_RUNTIME_JSON", manifest.c_str(), 1);
  pass(100.0);
  EXPECT_EQ(step().state, HeadsetState::kNoRuntime);
  EXPECT_EQ(runtime().calls("xrCreateInstance"), 0);
  h.look_again();
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, SaysWhichExtensionIsMissing) {
  std::erase(runtime().setup().extensions, "XR_KHR_vulkan_enable2");
  headset();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kUnsupported);
  EXPECT_THAT(headset_report().sentence, HasSubstr("XR_KHR_vulkan_enable2"));
  // Retried several times: the loader keeps its answer until a try has failed.
  runtime().reset();
  for (int i = 0; i < 3; ++i) {
    pass(6.0);
    step();
  }
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, SaysThatTheRuntimeWantsANewerVulkan) {
  runtime().setup().vulkan_minor = 3;
  headset();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kUnsupported);
  EXPECT_THAT(headset_report().sentence, HasSubstr("wants Vulkan 1.3"));
}

TEST_F(XrLoss, TakesUpASessionThatTheRuntimeTookAway) {
  headset();
  step_until(HeadsetState::kFocused);
  const XrSession first = runtime().session();
  runtime().announce(XR_SESSION_STATE_LOSS_PENDING);
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kSessionLost);
  EXPECT_EQ(runtime().session(), XrSession(XR_NULL_HANDLE));
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  EXPECT_NE(runtime().session(), first);
  EXPECT_EQ(headset_report().sessions, 2u);
  EXPECT_EQ(runtime().calls("xrCreateInstance"), 1) << "the runtime must stay";
  EXPECT_EQ(source.uses, 1) << "the device must stay, with all that was loaded onto it";

  runtime().lose_session();
  step();
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kSessionLost);
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, TakesUpARuntimeThatWentAway) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().inject("xrWaitFrame", 1, XR_ERROR_INSTANCE_LOST);
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kInstanceLost);
  runtime().setup().runtime_up = false;
  for (int i = 0; i < 5; ++i) {
    pass(1.0);
    EXPECT_EQ(step().state, HeadsetState::kWaiting);
  }
  runtime().setup().runtime_up = true;
  pass(1.0);
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  EXPECT_EQ(source.uses, 1) << "the same GPU draws: the device must stay";
  const int drawn = source.frames;
  step();
  EXPECT_EQ(source.frames, drawn + 1);
  EXPECT_EQ(runtime().last_frame().layers, 1u);

  runtime().lose_instance();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kInstanceLost);
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, ComesBackWithinTwoSecondsOfTheRuntime) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().setup().runtime_up = false;
  runtime().inject("xrEndFrame", 1, XR_ERROR_INSTANCE_LOST);
  for (int i = 0; i < 1000; ++i) step();
  ASSERT_EQ(headset_report().state, HeadsetState::kWaiting);
  runtime().setup().runtime_up = true;
  const int64_t back = now_ns_;
  while (headset_report().state != HeadsetState::kFocused && now_ns_ < back + int64_t(10e9)) step();
  EXPECT_LT(now_ns_ - back, int64_t(2e9));
}

TEST_F(XrLoss, MakesANewDeviceWhereTheRuntimeInsists) {
  runtime().setup().own_devices_only = true;
  headset();
  step_until(HeadsetState::kFocused);
  const auto first = headset_context();
  runtime().lose_instance();
  step();
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  EXPECT_EQ(source.uses, 2);
  EXPECT_EQ(source.drops, 1);
  EXPECT_NE(headset_context(), first);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
}

TEST_F(XrLoss, MakesANewDeviceWhereTheRuntimeKnowsNothingOfTheOldOne) {
  runtime().setup().own_vulkan_only = true;
  headset();
  step_until(HeadsetState::kFocused);
  runtime().lose_instance();
  step();
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  EXPECT_EQ(source.uses, 2);
  EXPECT_EQ(source.drops, 1);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
}

TEST_F(XrLoss, EndsWhenThePersonEndsTheSession) {
  xr::Headset& h = headset();
  step_until(HeadsetState::kFocused);
  for (const XrSessionState state :
       {XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_STOPPING})
    runtime().announce(state);
  EXPECT_EQ(step().state, HeadsetState::kIdle) << "stopped, but it may start again";
  runtime().announce(XR_SESSION_STATE_EXITING);
  EXPECT_EQ(step().state, HeadsetState::kEnded);
  EXPECT_EQ(runtime().alive(), "");
  pass(100.0);
  EXPECT_EQ(step().state, HeadsetState::kEnded) << "must not start again by itself";
  h.look_again();
  EXPECT_EQ(recover(), HeadsetState::kFocused);
}

TEST_F(XrLoss, StopsAndGoesOnAsTheHeadsetIsTakenOffAndPutOn) {
  headset();
  step_until(HeadsetState::kFocused);
  for (int round = 0; round < 3; ++round) {
    for (const XrSessionState state :
         {XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_STOPPING})
      runtime().announce(state);
    EXPECT_EQ(step().state, HeadsetState::kIdle);
    const uint64_t frames = runtime().frames();
    for (int i = 0; i < 5; ++i) EXPECT_EQ(step().state, HeadsetState::kIdle);
    EXPECT_EQ(runtime().frames(), frames) << "no frames while it does not run";
    runtime().announce(XR_SESSION_STATE_READY);
    EXPECT_EQ(recover(), HeadsetState::kFocused);
  }
  EXPECT_EQ(headset_report().sessions, 1u);
}

TEST_F(XrLoss, LeavesARuntimeThatDoesNotLetItGo) {
  xr::Headset& h = headset();
  step_until(HeadsetState::kFocused);
  runtime().setup().automatic = false;
  h.end(now_ns_);
  for (int i = 0; i < 100; ++i) step();
  EXPECT_EQ(h.report().state, HeadsetState::kFocused);
  pass(1.0);
  EXPECT_EQ(step().state, HeadsetState::kEnded);
  EXPECT_EQ(runtime().alive(), "");
}

TEST_F(XrLoss, AsksMoreAndMoreSeldomWhatIsAlwaysRefused) {
  runtime().inject_always("xrCreateSession", XR_ERROR_RUNTIME_FAILURE);
  headset();
  for (int i = 0; i < 100; ++i) {
    step();
    pass(1.0);
  }
  // After 1, 2, 4, 8, 16, 30, 30 s.
  EXPECT_GE(runtime().calls("xrCreateSession"), 7);
  EXPECT_LE(runtime().calls("xrCreateSession"), 9);
  EXPECT_EQ(headset_report().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kRefused);
}

TEST_F(XrLoss, GoesOnAfterTheSourceOrItsDeviceFailed) {
  source.refuse = true;
  headset();
  EXPECT_EQ(step().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kNoGraphics);
  source.refuse = false;
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  source.fails_once = Error{ErrorKind::kDeviceFailed, "The device was lost while drawing."};
  step();
  EXPECT_EQ(headset_report().state, HeadsetState::kWaiting);
  EXPECT_EQ(headset_report().problem.trouble, Trouble::kNoGraphics);
  pass(10.0);
  EXPECT_EQ(recover(), HeadsetState::kFocused);
  EXPECT_EQ(source.uses, 2) << "on a new device";
}

XrPosef posef(const xr::Pose& pose) {
  const glm::quat q(pose.rotation);
  const glm::vec3 p(pose.position_m);
  return {{q.x, q.y, q.z, q.w}, {p.x, p.y, p.z}};
}

TEST_F(XrLoss, KeepsThePictureOnTheDeviceThroughRecentringAndNewSessions) {
  // The true place of the device in a room that never moves. Guaranteed: 0.01 mm.
  Random random(7);
  const auto pose_of = [](const XrPosef& p) {
    return xr::Pose{{p.position.x, p.position.y, p.position.z},
                    glm::normalize(glm::dquat(p.orientation.w, p.orientation.x, p.orientation.y,
                                              p.orientation.z))};
  };
  xr::HeadsetOptions options;
  for (const xr::Origin origin :
       {xr::Origin::kStage, xr::Origin::kLocal, xr::Origin::kLocalFloor}) {
    close();
    runtime().reset();
    options.origin = origin;
    xr::Headset& h = headset(options);
    step_until(HeadsetState::kFocused);
    const auto base = origin == xr::Origin::kStage   ? XR_REFERENCE_SPACE_TYPE_STAGE
                      : origin == xr::Origin::kLocal ? XR_REFERENCE_SPACE_TYPE_LOCAL
                                                     : fake::kLocalFloor;
    const xr::Pose room_from_device{{0.3, 0.8, -0.4}, random.turn()};
    const xr::Pose world_from_device{{0.0, 1.0, 0.0}, random.turn()};
    h.colocation().keep(
        inverse(pose_of(runtime().room_from(base, runtime().now()))) * room_from_device,
        world_from_device);
    const xr::Pose world_from_room = world_from_device * inverse(room_from_device);
    int checked = 0;
    const auto check = [&] {
      step();
      if (runtime().last_frame().layers == 0) return;
      ++checked;
      const XrTime time = runtime().last_frame().display_time;
      xr::Pose room_from_eye = pose_of(runtime().room_from(XR_REFERENCE_SPACE_TYPE_VIEW, time));
      room_from_eye.position_m = room_from_eye(glm::dvec3(-0.0315, 0, 0));
      // The place of a point of the device relative to the eye, at an arm's length.
      const glm::dvec3 device = room_from_device.position_m;
      const glm::dvec3 truth = inverse(room_from_eye)(device);
      const glm::dvec3 seen = inverse(source.last->eyes[0].world_from_eye)(world_from_room(device));
      ASSERT_LT(glm::distance(truth, seen), 1e-5);
    };
    check();
    for (int i = 0; i < 40; ++i) {
      const auto space =
          random.chance(0.5) ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
      // The user turns and steps aside. The runtime's event has the pose of the change, or (for one
      // of the two spaces) has none.
      const xr::Pose moved{random.vector(1.0),
                           glm::angleAxis(random.draw(-3, 3), glm::dvec3(0, 1, 0))};
      runtime().recentre(space, runtime().now() + XrTime(random.draw(0, 5e7)), posef(moved),
                         random.chance(0.7));
      for (int frame = 0; frame < 6; ++frame) check();
      if (origin == xr::Origin::kStage && random.chance(0.2)) {
        runtime().announce(XR_SESSION_STATE_LOSS_PENDING);
        step();
        recover();
        EXPECT_FALSE(h.colocation().doubtful());
      }
    }
    EXPECT_GT(checked, 200) << "of 241 frames";
    EXPECT_FALSE(h.colocation().doubtful());
    runtime().lose_instance();
    step();
    recover();
    EXPECT_TRUE(h.colocation().doubtful()) << "a new runtime may have its stage elsewhere";
  }
}

}  // namespace
}  // namespace palpate::test
