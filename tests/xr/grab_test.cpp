// Grabbing on values: the point under a hand stays under it.

#include "module/xr/grab.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/xr/random_pose.h"

namespace palpate::test {
namespace {

using xr::Grab;
using xr::Hands;
using xr::Pose;

Hands hands_at(const Pose& left, const Pose& right, bool grabs_left, bool grabs_right) {
  Hands hands;
  hands.focused = true;
  hands.hand[0].active = hands.hand[1].active = true;
  hands.hand[0].world_from_grip = left;
  hands.hand[1].world_from_grip = right;
  hands.hand[0].grabs = grabs_left;
  hands.hand[1].grabs = grabs_right;
  return hands;
}

Transform somewhere(Random& random) {
  return {random.vector(0.5), random.turn(), glm::dvec3(random.draw(0.5, 2.0))};
}

Pose nudged(const Pose& pose, Random& random) {
  return {pose.position_m + random.vector(0.01),
          glm::normalize(random.small_turn(0.1) * pose.rotation)};
}

// Sums of a few hundred steps with double rounding, on lengths of a metre.
constexpr double kRounding = 1e-12;

TEST(Grab, WithOneHandKeepsTheVolumeRigidInTheHand) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    Grab grab;
    Transform volume = somewhere(random);
    Pose hand = random_pose(random, 0.5);
    const size_t side = seed % 2;
    const auto at = [&](const Pose& pose) {
      return side ? hands_at({}, pose, false, true) : hands_at(pose, {}, true, false);
    };
    volume = grab.drag(volume, at(hand));
    const glm::dvec3 point = volume.volume_from_world(hand.position_m + random.vector(0.2));
    const glm::dvec3 in_hand = inverse(hand)(volume.world_from_volume(point));
    const glm::dvec3 scale = volume.scale;
    for (int i = 0; i < 300; ++i) {
      hand = nudged(hand, random);
      volume = grab.drag(volume, at(hand));
    }
    EXPECT_LT(glm::distance(inverse(hand)(volume.world_from_volume(point)), in_hand), kRounding)
        << "seed " << seed;
    EXPECT_EQ(volume.scale, scale) << "seed " << seed;
  }
}

TEST(Grab, WithTwoHandsKeepsWhatIsUnderEachHandUnderIt) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    Grab grab({1e-3, 1e3, 1e-3});
    Transform volume = somewhere(random);
    Pose left = random_pose(random, 0.1), right = random_pose(random, 0.1);
    right.position_m += glm::dvec3(0.6, 0.0, 0.0);
    volume = grab.drag(volume, hands_at(left, right, true, true));
    const glm::dvec3 under_left = volume.volume_from_world(left.position_m);
    const glm::dvec3 under_right = volume.volume_from_world(right.position_m);
    for (int i = 0; i < 300; ++i) {
      left = nudged(left, random);
      right = nudged(right, random);
      // Far enough apart that the hands set the scale.
      if (glm::distance(left.position_m, right.position_m) < 0.1)
        right.position_m = left.position_m + glm::dvec3(0.2, 0.0, 0.0);
      volume = grab.drag(volume, hands_at(left, right, true, true));
    }
    EXPECT_LT(glm::distance(volume.world_from_volume(under_left), left.position_m), 1e-10)
        << "seed " << seed;
    EXPECT_LT(glm::distance(volume.world_from_volume(under_right), right.position_m), 1e-10)
        << "seed " << seed;
    EXPECT_NEAR(glm::length(volume.rotation), 1.0, kRounding) << "seed " << seed;
  }
}

TEST(Grab, ScalesByTheQuotientOfTheHandsDistances) {
  Grab grab;
  Transform volume;
  volume = grab.drag(volume, hands_at({{-0.1, 0, 0}}, {{0.1, 0, 0}}, true, true));
  for (int i = 1; i <= 100; ++i) {
    const double half = 0.1 + 0.002 * i;
    volume = grab.drag(volume, hands_at({{-half, 0, 0}}, {{half, 0, 0}}, true, true));
  }
  EXPECT_NEAR(volume.scale.x, 3.0, kRounding);
  EXPECT_NEAR(volume.scale.z, 3.0, kRounding);
}

TEST(Grab, RollsByTheMeanOfBothHandsAboutTheLineBetweenThem) {
  Grab grab;
  Transform volume;
  const auto turned = [](double angle) { return glm::angleAxis(angle, glm::dvec3(1.0, 0.0, 0.0)); };
  volume = grab.drag(volume, hands_at({{-0.2, 0, 0}}, {{0.2, 0, 0}}, true, true));
  for (int i = 1; i <= 50; ++i) {
    const Pose left{{-0.2, 0, 0}, turned(0.02 * i)}, right{{0.2, 0, 0}, turned(0.06 * i)};
    volume = grab.drag(volume, hands_at(left, right, true, true));
  }
  // The left hand has turned by 1 rad, the right one by 3: 2 on average.
  EXPECT_LT(glm::length(volume.rotation - turned(2.0)), kRounding);
}

TEST(Grab, NeverJumpsWhenHandsTakeHoldAndLetGo) {
  int still = 0;
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    Grab grab;
    Transform volume = somewhere(random);
    Pose left = random_pose(random, 0.2), right = random_pose(random, 0.2);
    bool holds_left = false, holds_right = false;
    std::array<bool, 2> held{};
    for (int i = 0; i < 300; ++i) {
      left = nudged(left, random);
      right = nudged(right, random);
      if (random.chance(0.1)) holds_left = !holds_left;
      if (random.chance(0.1)) holds_right = !holds_right;
      Hands hands = hands_at(left, right, holds_left, holds_right);
      hands.focused = !random.chance(0.05);
      hands.hand[0].active = !random.chance(0.05);
      const Transform before = volume;
      volume = grab.drag(volume, hands);
      // Only a hand that held on before and still does may move the volume. The scale stays within
      // its limits, and all stays finite.
      bool may_move = false;
      for (size_t side = 0; side < 2; ++side) {
        const bool holds = hands.focused && hands.hand[side].active && hands.hand[side].grabs;
        may_move |= held[side] && holds;
        held[side] = holds;
      }
      if (!may_move) {
        ASSERT_EQ(volume.translation_m, before.translation_m) << "seed " << seed;
        ASSERT_EQ(volume.rotation, before.rotation) << "seed " << seed;
        ASSERT_EQ(volume.scale, before.scale) << "seed " << seed;
        ++still;
      }
      ASSERT_GT(volume.scale.x, 0.1 * 0.999) << "seed " << seed;
      ASSERT_LT(volume.scale.x, 10.0 * 1.001) << "seed " << seed;
      ASSERT_TRUE(std::isfinite(volume.translation_m.x + volume.rotation.w)) << "seed " << seed;
    }
  }
  EXPECT_GT(still, 10000) << "of 60,000 steps";
}

TEST(Grab, StaysFiniteWhenTheHandsMeet) {
  Grab grab;
  Transform volume;
  volume = grab.drag(volume, hands_at({{-0.2, 0, 0}}, {{0.2, 0, 0}}, true, true));
  for (const double half : {0.1, 0.01, 0.0, 0.0, 0.01, 0.2}) {
    volume = grab.drag(volume, hands_at({{-half, 0, 0}}, {{half, 0, 0}}, true, true));
    EXPECT_TRUE(std::isfinite(volume.scale.x + volume.translation_m.x + volume.rotation.w));
  }
  // Hands that meet and part again below 30 mm do not change the scale.
  EXPECT_NEAR(volume.scale.x, 0.5, kRounding);
}

TEST(Grab, FollowsTheHandThatStaysWhenTheOtherJoinsOrLeaves) {
  Grab grab;
  Transform volume;
  double x = 0.0;
  const auto move = [&](bool left, bool right) {
    x += 0.01;
    volume = grab.drag(volume, hands_at({{x, 0, 0}}, {{x + 0.4, 0, 0}}, left, right));
  };
  move(true, false);
  const double start = x;
  move(true, false);
  move(true, true);
  move(true, true);
  move(false, true);
  move(false, true);
  EXPECT_NEAR(volume.translation_m.x, x - start, kRounding);
}

TEST(ClipPlane, LiesInTheFlatHandAndKeepsThePalmsSide) {
  const Pose grip{{0.1, 1.2, -0.3}, glm::angleAxis(0.5, glm::dvec3(0, 0, 1))};
  for (const int hand : {0, 1}) {
    const xr::CutPlane plane = xr::clip_plane(grip, hand);
    EXPECT_EQ(plane.point_m, grip.position_m);
    EXPECT_NEAR(glm::length(plane.normal), 1.0, kRounding);
    // The plane contains the grip's y and z axes.
    EXPECT_NEAR(glm::dot(plane.normal, grip.rotation * glm::dvec3(0, 1, 0)), 0.0, kRounding);
    EXPECT_NEAR(glm::dot(plane.normal, grip.rotation * glm::dvec3(0, 0, 1)), 0.0, kRounding);
  }
  // Palms face each other when both hands are held out: the side between them is kept.
  EXPECT_GT(xr::clip_plane({}, 0).normal.x, 0.0);
  EXPECT_LT(xr::clip_plane({}, 1).normal.x, 0.0);
}

TEST(BroughtTo, PutsTheCentreThereWithItsFrontToTheViewer) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Transform volume = somewhere(random);
    const glm::dvec3 centre = random.vector(0.1), target = random.vector(1.0),
                     viewer = random.vector(2.0);
    const Transform moved = xr::brought_to(volume, centre, target, viewer);
    EXPECT_LT(glm::distance(moved.world_from_volume(centre), target), kRounding) << seed;
    const glm::dvec3 front = moved.rotation * glm::dvec3(0, 0, 1);
    glm::dvec3 towards = viewer - target;
    towards.y = 0;
    EXPECT_LT(glm::distance(front, glm::normalize(towards)), 1e-9) << seed;
    EXPECT_EQ(moved.scale, volume.scale);
    EXPECT_LT(glm::distance(moved.rotation * glm::dvec3(0, 1, 0), glm::dvec3(0, 1, 0)), kRounding)
        << "not upright, seed " << seed;
  }
}

}  // namespace
}  // namespace palpate::test
