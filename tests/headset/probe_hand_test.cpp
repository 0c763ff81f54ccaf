// Which hand feels in a headset if there is no force device.
#include "integration/headset/probe_hand.h"

#include <gtest/gtest.h>

namespace palpate::headset {
namespace {

using By = ProbeHold::By;
constexpr double kFrame_s = 1.0 / 90.0;

xr::Hands with_controller(int side, glm::dvec3 place_m, bool trigger = false) {
  xr::Hands hands;
  xr::Controller& hand = hands.hand[size_t(side)];
  hand.active = true;
  hand.world_from_grip.position_m = place_m;
  hand.dead_man = trigger;
  return hands;
}

void add_fingers(xr::Hands& hands, int side, glm::dvec3 tip_m, bool pinches) {
  hands.fingers[size_t(side)] = {true, tip_m, pinches};
}

xr::Hands pinching(int side, bool pinches = true) {
  xr::Hands hands;
  add_fingers(hands, side, {0.1 * side, 1.0, 0.0}, pinches);
  return hands;
}

/// Equal frames: whether one of them requested a tube, and the result of the last one.
struct Frames {
  bool tube = false, keep = false;
  ProbeHold hold;
};
Frames frames(ProbeHand& probe, const xr::Hands& hands, double seconds) {
  Frames all;
  for (double t = 0.0; t < seconds; t += kFrame_s) {
    all.hold = probe.step(hands, kFrame_s);
    all.tube |= all.hold.asks_for_tube;
    all.keep |= all.hold.asks_to_keep;
  }
  return all;
}

TEST(ProbeHand, AControllerFeelsBeforeAnyFinger) {
  ProbeHand probe;
  EXPECT_EQ(probe.step({}, kFrame_s).by, By::kNobody);
  xr::Hands hands = with_controller(0, {1.0, 0.0, 0.0});
  add_fingers(hands, 1, {0.1, 1.0, 0.0}, true);
  ProbeHold hold = probe.step(hands, kFrame_s);
  EXPECT_EQ(hold.by, By::kController);
  EXPECT_EQ(hold.side, 0);
  EXPECT_EQ(hold.tip_m, glm::dvec3(1.0, 0.0, 0.0));
  EXPECT_EQ(hold.buttons, 0u);
  EXPECT_FALSE(hold.shown[1]) << "a hand that holds a controller is not drawn as a bare one";
  hands.hand[1] = with_controller(1, {2.0, 0.0, 0.0}, true).hand[1];
  hands.hand[1].world_from_aim = Pose{{3.0, 0.0, 0.0}};
  hold = probe.step(hands, kFrame_s);
  EXPECT_EQ(hold.side, 1) << "of two hands the right one";
  EXPECT_EQ(hold.tip_m, glm::dvec3(3.0, 0.0, 0.0)) << "the place it points from";
  EXPECT_EQ(hold.buttons, 1u);
}

TEST(ProbeHand, AFingerFeelsOnlyWhileItPinches) {
  ProbeHand probe;
  ProbeHold hold = probe.step(pinching(0, false), kFrame_s);
  EXPECT_EQ(hold.by, By::kNobody);
  EXPECT_TRUE(hold.shown[0]);
  EXPECT_FALSE(hold.shown[1]);
  hold = probe.step(pinching(0), kFrame_s);
  EXPECT_EQ(hold.by, By::kFinger);
  EXPECT_EQ(hold.side, 0);
  EXPECT_EQ(hold.tip_m, glm::dvec3(0.0, 1.0, 0.0));
  EXPECT_EQ(probe.step(pinching(0, false), kFrame_s).by, By::kNobody);
}

TEST(ProbeHand, TheFingerThatFeelsGoesOnWhenTheOtherHandPinchesToo) {
  ProbeHand probe;
  EXPECT_EQ(probe.step(pinching(0), kFrame_s).side, 0);
  xr::Hands both = pinching(0);
  add_fingers(both, 1, {0.1, 1.0, 0.0}, true);
  EXPECT_EQ(probe.step(both, kFrame_s).side, 0);
  EXPECT_EQ(probe.step(pinching(1), kFrame_s).side, 1) << "the first hand let go";
  ProbeHand fresh;
  EXPECT_EQ(fresh.step(both, kFrame_s).side, 1) << "if both begin at once, the right one";
}

TEST(ProbeHand, AShortPinchAsksForATubeOnceAndALongOneDoesNot) {
  ProbeHand probe;
  EXPECT_FALSE(frames(probe, pinching(1), 0.15).tube);
  EXPECT_TRUE(probe.step(pinching(1, false), kFrame_s).asks_for_tube);
  EXPECT_FALSE(frames(probe, pinching(1, false), 1.0).tube);
  frames(probe, pinching(1), 0.5);
  EXPECT_FALSE(frames(probe, pinching(1, false), 0.5).tube);
  // The other hand may tap while this one feels.
  frames(probe, pinching(1), 1.0);
  xr::Hands both = pinching(1);
  add_fingers(both, 0, {}, true);
  frames(probe, both, 0.1);
  add_fingers(both, 0, {}, false);
  const ProbeHold hold = probe.step(both, kFrame_s);
  EXPECT_TRUE(hold.asks_for_tube);
  EXPECT_EQ(hold.by, By::kFinger);
  EXPECT_EQ(hold.side, 1);
}

TEST(ProbeHand, ASecondTapSoonAfterAsksToKeep) {
  ProbeHand probe;
  const auto tap = [&] {
    Frames all = frames(probe, pinching(1), 0.1);
    const Frames open = frames(probe, pinching(1, false), 0.1);
    all.tube |= open.tube;
    all.keep |= open.keep;
    return all;
  };
  EXPECT_TRUE(tap().tube);
  const Frames second = tap();
  EXPECT_TRUE(second.keep);
  EXPECT_FALSE(second.tube);
  const Frames third = tap();
  EXPECT_TRUE(third.tube) << "the third tap is the first of the next pair";
  EXPECT_FALSE(third.keep);
  frames(probe, pinching(1, false), 0.6);
  EXPECT_TRUE(tap().tube) << "too late for a double tap";
  // Lost in between, or tapped with the other hand.
  frames(probe, {}, 0.05);
  EXPECT_TRUE(tap().tube);
  frames(probe, pinching(0), 0.1);
  const Frames other = frames(probe, pinching(0, false), 0.1);
  EXPECT_TRUE(other.tube);
  EXPECT_FALSE(other.keep);
}

TEST(ProbeHand, AHandThatIsLostHasNotTapped) {
  ProbeHand probe;
  frames(probe, pinching(1), 0.1);
  EXPECT_FALSE(frames(probe, {}, 0.5).tube);
  EXPECT_FALSE(frames(probe, pinching(1, false), 0.5).tube);
  frames(probe, pinching(1), 0.1);
  EXPECT_FALSE(frames(probe, with_controller(1, {}), 0.2).tube) << "the hand took a controller";
  EXPECT_FALSE(frames(probe, pinching(1, false), 0.5).tube);
}

}  // namespace
}  // namespace palpate::headset
