// What is felt where no scene file says it. Oracle: balls, whose surface is known.
#include "integration/loading/choose_wall.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scene/ball_frames.h"

namespace palpate::loading {
namespace {

using test::edge;
using test::kBallRadius_mm;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<NoteKind> kinds_of(const ChosenWall& chosen) {
  std::vector<NoteKind> kinds;
  for (const Note& note : chosen.notes) kinds.push_back(note.kind);
  return kinds;
}

/// A ball of 1000 in 0: at 500 its surface is closed.
Volume clean_ball() {
  return test::frame_of(
      [](glm::dvec3 x) { return 1000.0 * edge(kBallRadius_mm - glm::length(x)); });
}

WallFrame seen(const Volume& frame) {
  WallFrame of;
  of.add(0, frame);
  return of;
}

/// The distance of a wall from the ball's, along an axis.
double off_the_ball_mm(const Volume& distance_mm) {
  double out_mm = 0.0;
  while (out_mm < 30.0 &&
         sample(distance_mm, distance_mm.grid.index_from_lps({out_mm, 0.0, 0.0})) > 0.0)
    out_mm += 0.05;
  return std::abs(out_mm - kBallRadius_mm);
}

TEST(ChooseWall, TakesTheSurfaceBetweenTheMainGroupsOfValues) {
  const auto chosen = choose_wall(seen(clean_ball()), {}, true, "ball.mha");
  ASSERT_TRUE(chosen) << chosen.error().message;
  ASSERT_TRUE(chosen->mode);
  EXPECT_FALSE(chosen->derived);
  EXPECT_EQ(chosen->mode->kind, "surface");
  EXPECT_EQ(chosen->mode->strength(1000.0), 4.0);
  EXPECT_EQ(chosen->mode->strength(0.0), 0.0);
  EXPECT_EQ(chosen->mode->friction(500.0), 0.2);
  EXPECT_THAT(kinds_of(*chosen), ElementsAre(NoteKind::kSurfaceAt, NoteKind::kClosedSurface));
  const double found = chosen->notes[0].numbers[0];
  EXPECT_NEAR(found, 500.0, 50.0);
  EXPECT_DOUBLE_EQ(chosen->mode->strength(found), 2.0);
}

/// A hot core of 12 mm in a ball: at the scale that needs 8 mm on each side it holds no hand, but
/// the ball around it does.
TEST(ChooseWall, TakesWhatIsAroundASurfaceThatIsTooThinToHoldAHand) {
  const Volume frame = test::frame_of([](glm::dvec3 x) {
    const double r = glm::length(x);
    return 100.0 * edge(kBallRadius_mm - r) + 600.0 * edge(6.0 - r);
  });
  WallFrame seen_small = seen(frame);
  seen_small.half_mm = 8.0;
  const auto around = choose_wall(seen_small, {}, true, "hot.mha");
  ASSERT_TRUE(around) << around.error().message;
  EXPECT_THAT(kinds_of(*around), ElementsAre(NoteKind::kThinReplaced, NoteKind::kRegionWall));
  ASSERT_TRUE(around->derived);
  EXPECT_LT(around->derived->iso_value, 100.0);
  EXPECT_LT(off_the_ball_mm(around->derived->distance_mm), 1.0);

  SequenceChoices values;
  values.wall = FeltWall::kValues;
  const auto asked = choose_wall(seen_small, values, true, "hot.mha");
  ASSERT_TRUE(asked) << asked.error().message;
  EXPECT_TRUE(asked->mode);
  EXPECT_EQ(kinds_of(*asked).back(), NoteKind::kThinSurface);

  // Shown large enough, the core itself is felt.
  WallFrame seen_large = seen(frame);
  seen_large.half_mm = 2.0;
  const auto core = choose_wall(seen_large, {}, true, "hot.mha");
  ASSERT_TRUE(core) << core.error().message;
  EXPECT_THAT(kinds_of(*core), ElementsAre(NoteKind::kSurfaceAt, NoteKind::kClosedSurface));
}

TEST(ChooseWall, TakesWhatIsAsked) {
  SequenceChoices choices;
  choices.iso_value = 700.0;
  choices.width = 100.0;
  choices.strength_n = 3.0;
  choices.friction = 0.5;
  const auto chosen = choose_wall(seen(clean_ball()), choices, true, "ball.mha");
  ASSERT_TRUE(chosen) << chosen.error().message;
  ASSERT_TRUE(chosen->mode);
  EXPECT_EQ(chosen->mode->strength(649.0), 0.0);
  EXPECT_DOUBLE_EQ(chosen->mode->strength(700.0), 1.5);
  EXPECT_EQ(chosen->mode->strength(751.0), 3.0);
  EXPECT_EQ(chosen->mode->friction(0.0), 0.5);
  EXPECT_THAT(kinds_of(*chosen), ElementsAre(NoteKind::kClosedSurface));

  choices.iso_value = 1001.0;
  const auto none = choose_wall(seen(clean_ball()), choices, true, "ball.mha");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(none.error().message, HasSubstr("'ball.mha' has values from"));
}

TEST(ChooseWall, ReplacesASurfaceWithHolesOnlyWhereAMotionCarriesTheOther) {
  const WallFrame spotted = seen(test::spotted_ball());
  const auto derived = choose_wall(spotted, {}, true, "ball.mha");
  ASSERT_TRUE(derived) << derived.error().message;
  EXPECT_FALSE(derived->mode);
  ASSERT_TRUE(derived->derived);
  EXPECT_LT(off_the_ball_mm(derived->derived->distance_mm), 3.0);  // not a spot of 4 mm
  EXPECT_EQ(derived->segments.from, SegmentsFrom::kRegion);
  ASSERT_EQ(derived->segments.parts.size(), 1u);
  EXPECT_EQ(derived->segments.parts[0].strength_n, 4.0);
  EXPECT_EQ(derived->segments.parts[0].friction, 0.2);
  EXPECT_THAT(kinds_of(*derived), ElementsAre(NoteKind::kSurfaceReplaced, NoteKind::kRegionWall));
  EXPECT_GT(derived->notes[0].numbers[1], kClosedWall);

  SequenceChoices asks_for_values, asks_for_a_value, asks_for_a_width;
  asks_for_values.wall = FeltWall::kValues;
  asks_for_a_value.iso_value = 150.0;
  asks_for_a_width.width = 20.0;
  for (const auto& [choices, can_carry] :
       {std::pair{SequenceChoices(), false}, std::pair{asks_for_values, true},
        std::pair{asks_for_a_value, true}, std::pair{asks_for_a_width, true}}) {
    const auto values = choose_wall(spotted, choices, can_carry, "ball.mha");
    ASSERT_TRUE(values) << values.error().message;
    EXPECT_TRUE(values->mode);
    EXPECT_FALSE(values->derived);
    EXPECT_EQ(kinds_of(*values).back(), NoteKind::kOpenSurface);
  }
}

TEST(ChooseWall, DerivesWhatIsAsked) {
  for (const FeltWall wall : {FeltWall::kRegion, FeltWall::kRidges}) {
    SequenceChoices choices;
    choices.wall = wall;
    choices.strength_n = 2.0;
    WallFrame frame;
    frame.number = 3;
    frame.add(3, clean_ball());
    const auto chosen = choose_wall(frame, choices, false, "ball.mha");
    ASSERT_TRUE(chosen) << chosen.error().message;
    EXPECT_FALSE(chosen->mode);
    ASSERT_TRUE(chosen->derived);
    EXPECT_LT(off_the_ball_mm(chosen->derived->distance_mm), 0.3);
    EXPECT_EQ(chosen->segments.from,
              wall == FeltWall::kRegion ? SegmentsFrom::kRegion : SegmentsFrom::kRidges);
    EXPECT_EQ(chosen->segments.parts.at(0).strength_n, 2.0);
    const bool region = wall == FeltWall::kRegion;
    EXPECT_THAT(kinds_of(*chosen),
                ElementsAre(region ? NoteKind::kRegionWall : NoteKind::kRidgeWall));
    EXPECT_EQ(chosen->notes[0].numbers[region ? 1 : 0], 3.0);
  }
}

/// A bright thing of two voxels is no region, and its surface is a wall all the same.
TEST(ChooseWall, FallsBackToTheValuesOnlyIfNothingWasAsked) {
  const WallFrame speck = seen(test::frame_of(
      [](glm::dvec3 x) { return glm::length(x - glm::dvec3(0.5)) < 1.2 ? 100.0 : 0.0; }));
  SequenceChoices choices;
  const auto usual = choose_wall(speck, choices, true, "speck.mha");
  ASSERT_TRUE(usual) << usual.error().message;
  EXPECT_TRUE(usual->mode);
  choices.wall = FeltWall::kRegion;
  const auto asked = choose_wall(speck, choices, true, "speck.mha");
  ASSERT_FALSE(asked);
  EXPECT_THAT(asked.error().message, HasSubstr("'speck.mha' has nothing large enough"));
}

TEST(ChooseWall, GuidesAlongVectors) {
  WallFrame lengths = seen(clean_ball());
  lengths.of_vectors = true;
  SequenceChoices choices;
  const auto usual = choose_wall(lengths, choices, true, "flow.mha");
  ASSERT_TRUE(usual) << usual.error().message;
  ASSERT_TRUE(usual->mode);
  EXPECT_EQ(usual->mode->kind, "follow");
  EXPECT_EQ(usual->mode->strength(0.0), 0.0);
  EXPECT_NEAR(usual->mode->strength(500.0), 2.0, 1e-6);  // half of the longest
  EXPECT_EQ(usual->mode->strength(1000.0), 4.0);
  EXPECT_THAT(kinds_of(*usual), ElementsAre(NoteKind::kAlongVectors));

  choices.iso_value = 200.0;  // a step
  const auto asked = choose_wall(lengths, choices, true, "flow.mha");
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->mode->strength(199.0), 0.0);
  EXPECT_EQ(asked->mode->strength(201.0), 4.0);
  EXPECT_THAT(asked->notes, IsEmpty());

  choices.wall = FeltWall::kRidges;
  const auto derived = choose_wall(lengths, choices, true, "flow.mha");
  ASSERT_FALSE(derived);
  EXPECT_THAT(derived.error().message, HasSubstr("walls are derived from scalars"));
}

TEST(ChooseWall, SaysNothingOfAWallThatIsNotFelt) {
  SequenceChoices choices;
  choices.wall = FeltWall::kNotFelt;
  for (const Volume& frame : {clean_ball(), test::spotted_ball()}) {
    const auto chosen = choose_wall(seen(frame), choices, true, "ball.mha");
    ASSERT_TRUE(chosen) << chosen.error().message;
    EXPECT_TRUE(chosen->mode);
    EXPECT_THAT(chosen->notes, IsEmpty());
  }
}

TEST(WallFrame, HasTheRangeOfAllFramesAndTheValuesOfOne) {
  const auto constant = [](double value) {
    return test::frame_of([value](glm::dvec3) { return value; }, glm::dvec3(32.0));
  };
  WallFrame frame;
  frame.number = 1;
  for (size_t k = 0; k < 3; ++k) frame.add(k, constant(10.0 - double(k)));
  EXPECT_EQ(frame.low, 8.0F);
  EXPECT_EQ(frame.high, 10.0F);
  EXPECT_EQ(frame.values.values, constant(9.0).values);
}

}  // namespace
}  // namespace palpate::loading
