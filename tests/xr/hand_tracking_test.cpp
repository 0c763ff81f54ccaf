// Hands without controllers: fingertips, pinches, and lost hands.

#include "module/xr/hand_tracking.h"

#include <cmath>
#include <limits>

#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;

constexpr float kRadius_m = 0.008F;

/// A right hand with its forefinger at this place and its thumb at this distance (air between
/// them).
fake::FingerScript fingers_at(XrVector3f index, double gap_m) {
  return [=](XrTime) {
    const float apart = float(gap_m) + 2.0F * kRadius_m;
    return fake::SeenFingers{{index.x, index.y - apart, index.z}, index, 0xF, kRadius_m};
  };
}

class XrHandTracking : public XrTest {
 protected:
  void start() {
    headset();
    ASSERT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
    step();
  }
  const xr::Fingers& right_after(fake::FingerScript script) {
    runtime().script_fingers(1, std::move(script));
    step();
    return source.hands.fingers[1];
  }
};

TEST(Pinch, BeginsWhereFingersTouchAndEndsOnlyWellApart) {
  xr::Pinch pinch;
  EXPECT_FALSE(pinch.step(0.010));
  EXPECT_TRUE(pinch.step(0.003));
  EXPECT_TRUE(pinch.step(0.010)) << "a noisy tracker must not end the pinch";
  EXPECT_TRUE(pinch.step(-0.002)) << "fingers that press are flatter than their radii";
  EXPECT_FALSE(pinch.step(0.015));
  EXPECT_FALSE(pinch.step(0.010)) << "nor begin it again";
  EXPECT_TRUE(pinch.step(0.0));
  EXPECT_FALSE(pinch.step(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(pinch.step(0.010)) << "a hand that was lost must pinch again";
}

TEST_F(XrHandTracking, SeesTheFingertipAtTheTimeOfDisplay) {
  start();
  EXPECT_TRUE(headset_report().hand_tracking);
  EXPECT_FALSE(source.hands.fingers[1].seen);
  runtime().script_fingers(1, [](XrTime time) {
    const float z = float(-0.4 + 0.2 * double(time) * 1e-9);
    return fake::SeenFingers{{0.1F, 1.1F, z}, {0.1F, 1.2F, z}, 0xF, kRadius_m};
  });
  step();
  const xr::Fingers& right = source.hands.fingers[1];
  ASSERT_TRUE(right.seen);
  const double seconds = double(runtime().last_frame().display_time) * 1e-9;
  // Floats, about a metre.
  EXPECT_LT(glm::distance(right.fingertip_m, glm::dvec3(0.1, 1.2, -0.4 + 0.2 * seconds)), 1e-6);
  EXPECT_FALSE(right.pinches);
  EXPECT_FALSE(source.hands.fingers[0].seen);
}

TEST_F(XrHandTracking, PlacesTheFingertipInTheWorldThatTheRoomIsTakenFor) {
  start();
  const Pose device_in_room{{0.3, 1.0, -0.5}, glm::angleAxis(0.7, glm::dvec3(0.0, 1.0, 0.0))};
  headset_pointer()->colocation().keep(device_in_room, {});
  const xr::Fingers& right = right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.05));
  ASSERT_TRUE(right.seen);
  EXPECT_LT(glm::distance(right.fingertip_m, inverse(device_in_room)({0.1, 1.2, -0.4})), 1e-6);
}

TEST_F(XrHandTracking, TellsAPinchFromAnOpenHand) {
  start();
  EXPECT_FALSE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.03)).pinches);
  EXPECT_TRUE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.001)).pinches);
  EXPECT_TRUE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.009)).pinches);
  EXPECT_FALSE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.03)).pinches);
}

TEST_F(XrHandTracking, AHandThatIsLostIsNoHand) {
  start();
  const XrVector3f at{0.1F, 1.2F, -0.4F};
  const auto with = [&](XrSpaceLocationFlags flags, XrVector3f index, float radius) {
    return [=](XrTime) { return fake::SeenFingers{at, index, flags, radius}; };
  };
  const float nan = std::nanf("");
  const std::vector<std::pair<const char*, fake::FingerScript>> rows{
      {"not active", nullptr},
      {"no hand now", [](XrTime) { return std::optional<fake::SeenFingers>(); }},
      {"not valid", with(0, at, kRadius_m)},
      {"guessed, not seen", with(XR_SPACE_LOCATION_POSITION_VALID_BIT, at, kRadius_m)},
      {"not finite", with(0xF, {nan, 1.2F, -0.4F}, kRadius_m)},
      {"a radius that is none", with(0xF, at, nan)},
  };
  for (const auto& [what, lost] : rows) {
    ASSERT_TRUE(right_after(fingers_at(at, 0.0)).pinches) << what;
    const xr::Fingers& now = right_after(lost);
    EXPECT_FALSE(now.seen) << what;
    EXPECT_FALSE(now.pinches) << what;
    EXPECT_TRUE(headset_report().hand_tracking) << what;
  }
}

TEST_F(XrHandTracking, IsAtRestWithoutFocus) {
  start();
  ASSERT_TRUE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.0)).pinches);
  runtime().setup().automatic = false;
  runtime().announce(XR_SESSION_STATE_VISIBLE);
  const int located = runtime().calls("xrLocateHandJointsEXT");
  step();
  EXPECT_FALSE(source.hands.fingers[1].seen);
  EXPECT_EQ(runtime().calls("xrLocateHandJointsEXT"), located);
  EXPECT_FALSE(headset_report().hands.fingers[1].seen);
}

TEST_F(XrHandTracking, IsDoneWithoutWhereRuntimeOrHeadsetHaveNone) {
  runtime().setup().sees_hands = false;
  start();
  EXPECT_FALSE(headset_report().hand_tracking);
  EXPECT_EQ(runtime().calls("xrCreateHandTrackerEXT"), 0);
  close();
  runtime().reset();
  std::erase(runtime().setup().extensions, XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  start();
  EXPECT_FALSE(headset_report().hand_tracking);
  EXPECT_EQ(headset_report().no_hand_tracking, "");
  EXPECT_TRUE(source.hands.hand[1].active) << "controllers must still work";
}

TEST_F(XrHandTracking, ARuntimeThatRefusesIsNotAskedAgainAndAllElseGoesOn) {
  runtime().inject_always("xrCreateHandTrackerEXT", XR_ERROR_FEATURE_UNSUPPORTED);
  start();
  EXPECT_FALSE(headset_report().hand_tracking);
  EXPECT_EQ(headset_report().no_hand_tracking, "xrCreateHandTrackerEXT returned -8");
  EXPECT_EQ(headset_report().sessions, 1u) << "the session must go on";
  EXPECT_EQ(runtime().calls("xrLocateHandJointsEXT"), 0);
  close();
  runtime().reset();
  start();
  ASSERT_TRUE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.0)).pinches);
  runtime().inject_always("xrLocateHandJointsEXT", XR_ERROR_RUNTIME_FAILURE);
  step();
  EXPECT_FALSE(source.hands.fingers[1].seen);
  EXPECT_FALSE(headset_report().hand_tracking);
  EXPECT_EQ(headset_report().no_hand_tracking, "xrLocateHandJointsEXT returned -2");
  const int located = runtime().calls("xrLocateHandJointsEXT");
  step();
  EXPECT_EQ(runtime().calls("xrLocateHandJointsEXT"), located);
  EXPECT_EQ(headset_report().state, HeadsetState::kFocused);
  EXPECT_EQ(headset_report().sessions, 1u);
  EXPECT_TRUE(source.hands.hand[1].active);
}

/// As XrHandTracking, with the hands as the runtime's own input: no controllers are there.
class XrHandInteraction : public XrHandTracking {
 protected:
  void start_bare() {
    for (const int side : {0, 1}) runtime().script_hand(side, nullptr);
    start();
  }
  /// The runtime tells which profile is there in the frame after it has changed.
  const xr::Fingers& right_after_two(fake::FingerScript script) {
    right_after(script);
    return right_after(std::move(script));
  }
};

TEST_F(XrHandInteraction, TakesFingertipAndPinchFromTheRuntimeWhereNoJointsAreTracked) {
  std::erase(runtime().setup().extensions, XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  start_bare();
  EXPECT_FALSE(headset_report().hand_tracking) << "nobody is seen yet";
  const Pose device_in_room{{0.3, 1.0, -0.5}, glm::angleAxis(0.7, glm::dvec3(0.0, 1.0, 0.0))};
  headset_pointer()->colocation().keep(device_in_room, {});
  const xr::Fingers open = right_after_two(fingers_at({0.1F, 1.2F, -0.4F}, 0.05));
  ASSERT_TRUE(open.seen);
  EXPECT_FALSE(open.pinches);
  // Floats, about a metre.
  EXPECT_LT(glm::distance(open.fingertip_m, inverse(device_in_room)({0.1, 1.2, -0.4})), 1e-6);
  EXPECT_TRUE(headset_report().hand_tracking);
  EXPECT_FALSE(source.hands.hand[1].active) << "a bare hand is no controller";
  EXPECT_EQ(source.hands.hand[1].profile, "/interaction_profiles/ext/hand_interaction_ext");
  EXPECT_FALSE(source.hands.fingers[0].seen);
  EXPECT_TRUE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.0)).pinches);
  EXPECT_FALSE(right_after(fingers_at({0.1F, 1.2F, -0.4F}, 0.05)).pinches);
  // A controller is taken up again.
  runtime().script_hand(1, [](XrTime) { return XrPosef{{0, 0, 0, 1}, {0.2F, 1.1F, -0.4F}}; });
  step();
  EXPECT_TRUE(source.hands.hand[1].active);
  EXPECT_FALSE(source.hands.fingers[1].seen);
}

TEST_F(XrHandInteraction, AFingertipThatTheRuntimeGuessesIsNotSeen) {
  std::erase(runtime().setup().extensions, XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  start_bare();
  const XrVector3f at{0.1F, 1.2F, -0.4F};
  constexpr XrSpaceLocationFlags kGuessed =
      XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
  const std::vector<std::pair<const char*, fake::FingerScript>> rows{
      {"gone", nullptr},
      {"not valid",
       [&](XrTime) {
         return fake::SeenFingers{at, at, 0, kRadius_m};
       }},
      {"guessed",
       [&](XrTime) {
         return fake::SeenFingers{at, at, kGuessed, kRadius_m};
       }},
      {"not finite", [&](XrTime) {
         return fake::SeenFingers{at, {std::nanf(""), 1, 1}, 0xF, kRadius_m};
       }}};
  for (const auto& [what, lost] : rows) {
    ASSERT_TRUE(right_after_two(fingers_at(at, 0.0)).pinches) << what;
    const xr::Fingers& now = right_after(lost);
    EXPECT_FALSE(now.seen) << what;
    EXPECT_FALSE(now.pinches) << what;
  }
}

TEST_F(XrHandInteraction, TheJointsAreAskedForOnlyWhereTheRuntimeDoesNotSayMore) {
  start_bare();
  // 9 mm: apart by the joints, touching for this runtime.
  ASSERT_TRUE(right_after_two(fingers_at({0.1F, 1.2F, -0.4F}, 0.009)).pinches);
  const int located = runtime().calls("xrLocateHandJointsEXT");
  step();
  EXPECT_EQ(runtime().calls("xrLocateHandJointsEXT"), located + 1) << "of the left hand only";
  close();
  runtime().reset();
  std::erase(runtime().setup().extensions, "XR_EXT_hand_interaction");
  start_bare();
  const xr::Fingers& joints = right_after_two(fingers_at({0.1F, 1.2F, -0.4F}, 0.009));
  EXPECT_TRUE(joints.seen);
  EXPECT_FALSE(joints.pinches);
}

TEST_F(XrHandTracking, ALostSessionIsLostInTheseCallsToo) {
  start();
  runtime().script_fingers(1, fingers_at({0.1F, 1.2F, -0.4F}, 0.0));
  runtime().inject("xrLocateHandJointsEXT", 1, XR_ERROR_SESSION_LOST);
  step();
  EXPECT_NE(headset_report().state, HeadsetState::kFocused);
  EXPECT_FALSE(headset_report().hands.fingers[1].pinches);
  pass(2.0);
  ASSERT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
  step();
  EXPECT_TRUE(source.hands.fingers[1].pinches) << "the next session has it again";
  EXPECT_EQ(headset_report().sessions, 2u);
}

}  // namespace
}  // namespace palpate::test
