// Scenes from frames that a program gives. Oracle: balls, whose surface is known.
#include "integration/loading/load_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "tests/scene/ball_frames.h"

namespace palpate::loading {
namespace {

/// A ball that grows by 3 mm from frame to frame, with one motion for all of them.
std::shared_ptr<const GivenVolume> growing_ball(size_t reference) {
  auto given = std::make_shared<GivenVolume>();
  for (int k = 0; k < 3; ++k)
    given->frames.frames.push_back(test::frame_of([k](glm::dvec3 x) {
      return 1000.0 * test::edge(test::kBallRadius_mm + 3.0 * k - glm::length(x));
    }));
  SequenceMotion& motion = given->motion.emplace();
  motion.reference = reference;
  motion.basis = {{0.0, 1.0, 2.0}, 3.0, 0};
  motion.terms.assign(3, still_field(given->frames.frames[0].grid));
  return given;
}

/// A derived wall is that of the frame that the motion carries.
TEST(LoadScene, DerivesTheWallOfTheReferenceFrame) {
  for (const size_t reference : {size_t(0), size_t(2)})
    for (const auto values : {CarriedValues::kReference, CarriedValues::kMean}) {
      SequenceChoices choices;
      choices.given["ball"] = growing_ball(reference);
      choices.wall = FeltWall::kRegion;
      choices.values = values;
      const auto scene = load_scene({"ball"}, choices);
      ASSERT_TRUE(scene) << scene.error().message;
      const FrameData& wall_mm = *scene->data.at(0)->segments.at(0).distance_mm.at(0);
      const double radius_m = 1e-3 * (test::kBallRadius_mm + 3.0 * double(reference));
      for (const glm::dvec3 way : {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1)})
        EXPECT_NEAR(wall_mm.scalar(radius_m * way), 0.0, 0.5) << reference;
    }
}

TEST(LoadScene, CanBeLookedAtWithoutAnythingToFeel) {
  const std::string text = R"({"volumes": [{"name": "shell", "source": "shell"}]})";
  SequenceChoices choices;
  const auto felt = load_scene_text(text, choices);
  ASSERT_FALSE(felt);
  EXPECT_THAT(felt.error().message, ::testing::HasSubstr("at modes: nothing would be felt"));
  choices.wall = FeltWall::kNotFelt;
  const auto seen = load_scene_text(text, choices);
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_TRUE(seen->spec.modes.empty());
  EXPECT_EQ(seen->data.size(), 1U);
}

TEST(LoadScene, TakesTheFrameOfASegmentationForNoDerivedWall) {
  SequenceChoices choices;
  auto given = std::make_shared<GivenVolume>(*growing_ball(0));
  given->motion.reset();
  choices.given["ball"] = given;
  choices.wall = FeltWall::kRegion;
  choices.segments_frame = 2;
  const auto scene = load_scene({"ball"}, choices);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->spec.volumes.at(0).segments.frame, 0U);
  const FrameData& wall_mm = *scene->data.at(0)->segments.at(0).distance_mm.at(0);
  EXPECT_NEAR(wall_mm.scalar({1e-3 * test::kBallRadius_mm, 0.0, 0.0}), 0.0, 0.5);
  // What stands still until the motion is known is the frame of the wall.
  EXPECT_EQ(scene->data.at(0)->frames.size(), 1U);
  EXPECT_NEAR(scene->data.at(0)->frames.at(0)->scalar({1e-3 * test::kBallRadius_mm, 0.0, 0.0}),
              500.0, 60.0);
}

}  // namespace
}  // namespace palpate::loading
