// Hands with controllers of every kind, and without focus.

#include <map>

#include "module/xr/grab.h"
#include "module/xr/vibration.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;

class XrInput : public XrTest {
 protected:
  void start(const std::string& profile) {
    runtime().setup().profile = "/interaction_profiles/" + profile;
    headset();
    step_until(HeadsetState::kFocused);
    step();
    step();
  }
  const xr::Hands& after(const std::string& part, float value) {
    runtime().set_input("/user/hand/" + part, value);
    step();
    return source.hands;
  }
};

TEST_F(XrInput, LocatesHandsAtTheTimeOfDisplay) {
  runtime().script_hand(1, [](XrTime time) {
    return XrPosef{{0, 0, 0, 1}, {0.3F, 1.0F, float(-0.4 + 0.5 * double(time) * 1e-9)}};
  });
  start("khr/simple_controller");
  const XrTime time = runtime().last_frame().display_time;
  const xr::Controller& right = source.hands.hand[1];
  ASSERT_TRUE(right.active);
  EXPECT_TRUE(source.hands.focused);
  // Floats, about a metre.
  EXPECT_NEAR(right.world_from_grip.position_m.z, -0.4 + 0.5 * double(time) * 1e-9, 1e-6);
  EXPECT_NEAR(right.velocity_m_per_s.z, 0.5, 1e-3);
  ASSERT_TRUE(right.world_from_aim);
  EXPECT_NEAR(right.world_from_aim->position_m.x, 0.3, 1e-6);
  EXPECT_EQ(right.profile, "/interaction_profiles/khr/simple_controller");
  EXPECT_NEAR(source.hands.hand[0].velocity_m_per_s.z, 0.0, 1e-6);
}

TEST_F(XrInput, KnowsThatAControllerIsAway) {
  runtime().script_hand(0, nullptr);
  start("khr/simple_controller");
  EXPECT_FALSE(source.hands.hand[0].active);
  EXPECT_TRUE(source.hands.hand[1].active);
  EXPECT_EQ(source.hands.hand[0].profile, "");
  EXPECT_FALSE(after("left/input/select/click", 1).hand[0].grabs)
      << "there is no controller that could grab";
}

struct Case {
  const char* part;
  std::function<double(const xr::Hands&)> shown;
};

TEST_F(XrInput, HasEveryActOnEveryKindOfController) {
  const auto grabs = [](int h) {
    return [h](const xr::Hands& hands) { return double(hands.hand[size_t(h)].grabs); };
  };
  const auto dead = [](int h) {
    return [h](const xr::Hands& hands) { return double(hands.hand[size_t(h)].dead_man); };
  };
  const auto clip = [](int h) {
    return [h](const xr::Hands& hands) { return double(hands.hand[size_t(h)].clip); };
  };
  const auto play = [](const xr::Hands& hands) { return double(hands.play_pause); };
  const auto centre = [](const xr::Hands& hands) { return double(hands.recentre); };
  const auto next = [](const xr::Hands& hands) { return double(hands.preset_steps); };
  const auto back = [](const xr::Hands& hands) { return -double(hands.preset_steps); };
  const auto scrub = [](const xr::Hands& hands) { return hands.scrub; };
  const std::map<std::string, std::vector<Case>> all{{"khr/simple_controller",
                                                      {{"left/input/select/click", grabs(0)},
                                                       {"right/input/select/click", grabs(1)},
                                                       {"left/input/menu/click", play},
                                                       {"right/input/menu/click", dead(1)}}},
                                                     {"oculus/touch_controller",
                                                      {{"left/input/squeeze/value", grabs(0)},
                                                       {"right/input/squeeze/value", grabs(1)},
                                                       {"left/input/trigger/value", dead(0)},
                                                       {"right/input/trigger/value", dead(1)},
                                                       {"left/input/thumbstick/click", clip(0)},
                                                       {"right/input/thumbstick/click", clip(1)},
                                                       {"right/input/a/click", play},
                                                       {"right/input/b/click", centre},
                                                       {"left/input/y/click", next},
                                                       {"left/input/x/click", back},
                                                       {"right/input/thumbstick/x", scrub}}},
                                                     {"htc/vive_controller",
                                                      {{"left/input/squeeze/click", grabs(0)},
                                                       {"right/input/squeeze/click", grabs(1)},
                                                       {"left/input/trigger/value", dead(0)},
                                                       {"right/input/trackpad/click", clip(1)},
                                                       {"right/input/menu/click", play},
                                                       {"left/input/menu/click", centre},
                                                       {"left/input/trackpad/click", next},
                                                       {"left/input/trackpad/x", scrub}}},
                                                     {"valve/index_controller",
                                                      {{"left/input/squeeze/value", grabs(0)},
                                                       {"right/input/squeeze/value", grabs(1)},
                                                       {"right/input/trigger/value", dead(1)},
                                                       {"left/input/thumbstick/click", clip(0)},
                                                       {"right/input/a/click", play},
                                                       {"right/input/b/click", centre},
                                                       {"left/input/b/click", next},
                                                       {"left/input/a/click", back},
                                                       {"right/input/thumbstick/x", scrub}}},
                                                     {"microsoft/motion_controller",
                                                      {{"left/input/squeeze/click", grabs(0)},
                                                       {"right/input/squeeze/click", grabs(1)},
                                                       {"right/input/trigger/value", dead(1)},
                                                       {"left/input/thumbstick/click", clip(0)},
                                                       {"right/input/menu/click", play},
                                                       {"left/input/menu/click", centre},
                                                       {"right/input/trackpad/click", next},
                                                       {"left/input/trackpad/click", back},
                                                       {"right/input/thumbstick/x", scrub}}}};
  for (const auto& [profile, cases] : all) {
    start(profile);
    for (const Case& one : cases) {
      EXPECT_EQ(one.shown(source.hands), 0.0) << profile << " " << one.part << " before";
      EXPECT_EQ(one.shown(after(one.part, 1)), 1.0) << profile << " " << one.part;
      after(one.part, 0);
    }
    close();
  }
}

TEST_F(XrInput, TellsAPressOnceAndAHoldAsLongAsItLasts) {
  start("oculus/touch_controller");
  EXPECT_TRUE(after("right/input/a/click", 1).play_pause);
  EXPECT_FALSE(after("right/input/a/click", 1).play_pause);
  EXPECT_FALSE(after("right/input/a/click", 0).play_pause);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(after("right/input/trigger/value", 1).hand[1].dead_man);
  EXPECT_FALSE(after("right/input/trigger/value", 0.1F).hand[1].dead_man);
}

TEST_F(XrInput, IsAtRestWithoutFocus) {
  start("oculus/touch_controller");
  EXPECT_TRUE(after("left/input/squeeze/value", 1).hand[0].grabs);
  EXPECT_TRUE(after("right/input/trigger/value", 1).hand[1].dead_man);
  runtime().setup().automatic = false;
  runtime().announce(XR_SESSION_STATE_VISIBLE);
  const int synced = runtime().calls("xrSyncActions");
  step();
  EXPECT_EQ(headset_report().state, HeadsetState::kVisible);
  EXPECT_EQ(runtime().last_frame().layers, 1u) << "still shown";
  EXPECT_FALSE(source.hands.focused);
  EXPECT_FALSE(source.hands.hand[0].grabs);
  EXPECT_FALSE(source.hands.hand[1].dead_man);
  EXPECT_FALSE(source.hands.hand[0].active);
  EXPECT_EQ(runtime().calls("xrSyncActions"), synced);
  EXPECT_FALSE(xr::dead_man_held(headset_report().hands));
  runtime().announce(XR_SESSION_STATE_FOCUSED);
  step();
  EXPECT_TRUE(source.hands.hand[0].grabs);
  EXPECT_TRUE(xr::dead_man_held(headset_report().hands));
  // Without a picture, or without a session, the source gets no more frames; the report still shows
  // the hands.
  runtime().setup().should_render = false;
  step();
  EXPECT_TRUE(xr::dead_man_held(headset_report().hands));
  runtime().lose_session();
  step();
  EXPECT_FALSE(xr::dead_man_held(headset_report().hands));
}

TEST_F(XrInput, IsAtRestWhenTheRuntimeTakesTheFocusBeforeItSaysSo) {
  start("oculus/touch_controller");
  after("right/input/trigger/value", 1);
  runtime().inject("xrSyncActions", 1, XR_SESSION_NOT_FOCUSED);
  step();
  EXPECT_FALSE(source.hands.focused);
  EXPECT_FALSE(source.hands.hand[1].dead_man);
  step();
  EXPECT_TRUE(source.hands.hand[1].dead_man);
}

TEST_F(XrInput, VibratesForTwoFramesAndStopsOnce) {
  start("khr/simple_controller");
  xr::Headset& h = *headset_pointer();
  h.vibrate(1, xr::vibration(2.0, 4.0));
  ASSERT_EQ(runtime().haptics().size(), 1u);
  EXPECT_NEAR(runtime().haptics()[0].amplitude, xr::vibration(2.0, 4.0), 1e-6);
  EXPECT_EQ(runtime().haptics()[0].duration_ns, 2 * 11'111'111);
  h.vibrate(1, 0.0);
  h.vibrate(1, 0.0);
  h.vibrate(0, 0.0);
  EXPECT_EQ(runtime().stops(), 1);
  h.vibrate(0, 7.0);
  EXPECT_EQ(runtime().haptics().back().amplitude, 1.0F);
  runtime().setup().automatic = false;
  runtime().announce(XR_SESSION_STATE_VISIBLE);
  step();
  h.vibrate(1, 1.0);
  EXPECT_EQ(runtime().haptics().size(), 2u) << "vibrates without focus";
}

TEST_F(XrInput, DoesWithoutAKindOfControllerThatTheRuntimeDoesNotKnow) {
  runtime().inject("xrSuggestInteractionProfileBindings", 3, XR_ERROR_PATH_UNSUPPORTED);
  start("khr/simple_controller");
  EXPECT_TRUE(after("left/input/select/click", 1).hand[0].grabs);
}

}  // namespace
}  // namespace palpate::test
