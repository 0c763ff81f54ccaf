// Leaving out invisible samples does not change the picture.
#include "module/scene/analytic_data.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kSize{96, 96};

using SkipTest = ViewTest;

/// Largest difference of any channel of any pixel, of 255.
int difference(const Picture& a, const Picture& b) {
  int most = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int c = 0; c < 4; ++c)
        most = std::max(most, std::abs(channel(a, x, y, c) - channel(b, x, y, c)));
  return most;
}

Look shell_look() {
  Look look{"shell", {}, {}, 0.0};
  look.points = {
      {560.0, {0.9, 0.3, 0.2}, 0.0}, {620.0, {0.9, 0.5, 0.3}, 0.6}, {700.0, {0.9, 0.6, 0.4}, 0.0}};
  return look;
}

Look fog_look() {
  Look look{"fog", {}, {}, 0.0};
  look.points = {{90.0, {0.4, 0.5, 0.9}, 0.001},
                 {350.0, {0.9, 0.3, 0.2}, 0.004},
                 {1000.0, {1.0, 0.8, 0.6}, 0.2}};
  return look;
}

TEST_F(SkipTest, ChangesNoPixelByMoreThanOneStep) {
  const auto heart = beating_heart();
  RendererOptions all{kSize, 1};
  all.skip_empty = false;
  all.count_samples = true;
  RendererOptions skips{kSize, 1};
  skips.count_samples = true;
  // With fewer samples the fog would lose too much light over four steps.
  all.samples_per_voxel = skips.samples_per_voxel = 1.0;
  auto everywhere = renderer(all), skipping = renderer(skips);
  set(*everywhere, {heart});
  set(*skipping, {heart});
  // The look, the phase and the eye change one after the other, and the renderer must handle each.
  struct Case {
    Look look;
    FramePointer at;
    glm::dvec3 from;
  };
  for (const Case& c : {Case{shell_look(), {0, 0.0}, {0.1, 0.08, 0.2}},
                        Case{shell_look(), {0, 0.55}, {0.1, 0.08, 0.2}},
                        Case{fog_look(), {0, 0.55}, {0.1, 0.08, 0.2}},
                        Case{fog_look(), {2, 0.3}, {0.02, 0.01, 0.0}},
                        Case{step_look(625.0), {2, 0.3}, {-0.2, 0.0, 0.01}}}) {
    ViewScene scene;
    scene.volumes = {{heart, {}, c.at, c.look}};
    const Eye eye = eye_at(c.from, {0.0, 0.002, 0.001}, 0.6, kSize);
    const Picture one = draw(*everywhere, scene, {eye}, kSize)[0];
    const Picture other = draw(*skipping, scene, {eye}, kSize)[0];
    EXPECT_LE(difference(one, other), 1) << c.look.name << " frame " << c.at.frame;
    const ViewStatistics a = everywhere->statistics(), b = skipping->statistics();
    EXPECT_LT(b.samples_taken, a.samples_taken) << c.look.name;
  }
}

TEST_F(SkipTest, OfACarriedHeartChangesNoPixelByMoreThanOneStepAtAnyTime) {
  const auto heart = carried_heart(true);
  RendererOptions all{kSize, 1};
  all.skip_empty = false;
  auto everywhere = renderer(all), skipping = renderer({kSize, 1});
  set(*everywhere, {heart});
  set(*skipping, {heart});
  // Consecutive pictures have very different times.
  for (const FramePointer at : {FramePointer{0, 0.5}, {2, 0.9}, {1, 0.0}, {3, 0.99}})
    for (const Look& look : {shell_look(), fog_look(), step_look(625.0)}) {
      ViewScene scene;
      scene.volumes = {{heart, {}, at, look}};
      const Eye eye = eye_at({0.1, 0.08, 0.2}, {0.0, 0.002, 0.001}, 0.6, kSize);
      const Picture one = draw(*everywhere, scene, {eye}, kSize)[0];
      const Picture other = draw(*skipping, scene, {eye}, kSize)[0];
      EXPECT_LE(difference(one, other), 1)
          << look.name << " frame " << at.frame << " phase " << at.phase;
    }
}

/// A block that moves, with one motion for all times; its border values extend outside.
std::shared_ptr<const MovingVolume> shifted_block() {
  constexpr int kEdge = 96;
  MovingVolume own =
      *still_volume(kEdge, 1.0, [](glm::dvec3 x) { return x.x > 30.0 ? 1.0 : 0.2 + 0.001 * x.y; });
  own.times = {{0.0, 0.5}, 1.0};
  own.frames.push_back(own.frames[0]);
  SequenceMotion motion;
  motion.basis = {own.times.times_s, own.times.cycle_s, 0};
  Grid grid;
  grid.size = glm::ivec3(12);
  grid.spacing_mm = glm::dvec3(8.0);
  grid.origin_mm = glm::dvec3(-44.0);
  motion.terms = {still_field(grid), still_field(grid)};
  for (glm::vec3& u : motion.terms[1].u_mm) u = glm::vec3(-30.0F, 0.0F, 0.0F);
  return std::make_shared<const MovingVolume>(*carried(own, motion));
}

TEST_F(SkipTest, SeesTheBorderThatMotionPullsIn) {
  // Beyond the border the border's value continues: it must not be left out where the border moves
  // inwards by 30 voxels.
  const auto block = shifted_block();
  RendererOptions all{kSize, 1};
  all.skip_empty = false;
  auto everywhere = renderer(all), skipping = renderer({kSize, 1});
  set(*everywhere, {block});
  set(*skipping, {block});
  ViewScene scene;
  scene.volumes = {{block, {}, {1, 0.0}, step_look(0.7)}};
  const Eye eye = eye_at({0.1, 0.08, 0.2}, {0, 0, 0}, 0.6, kSize);
  const Picture one = draw(*everywhere, scene, {eye}, kSize)[0];
  const Picture other = draw(*skipping, scene, {eye}, kSize)[0];
  EXPECT_LE(difference(one, other), 1);
  scene.volumes[0].pointer = {0, 0.0};
  EXPECT_GT(difference(one, draw(*everywhere, scene, {eye}, kSize)[0]), 100);
}

TEST_F(SkipTest, ReadsNothingThatWasNotMade) {
  // Here the smallest value is the most opaque: places that were never written would be visible.
  MovingVolume made;
  made.name = "molecule";
  made.times.times_s = {0.0};
  made.frames = {dichloroethane()};
  const auto molecule = std::make_shared<const MovingVolume>(made);
  RendererOptions all{kSize, 1};
  all.skip_empty = false;
  auto everywhere = renderer(all), skipping = renderer({kSize, 1});
  set(*everywhere, {molecule});
  set(*skipping, {molecule});
  ViewScene scene;
  scene.volumes = {{molecule, {}, {}, *preset_look("molecule")}};
  const Eye eye = eye_at({0.06, 0.08, 0.22}, {0, 0, 0}, 0.75, kSize);
  const Picture one = draw(*everywhere, scene, {eye}, kSize)[0];
  const Picture other = draw(*skipping, scene, {eye}, kSize)[0];
  EXPECT_LE(difference(one, other), 1);
  EXPECT_GT(channel(one, kSize.width / 2, kSize.height / 2, 3), 30);
}

TEST_F(SkipTest, TakesFewSamplesMoreThanAreNeededForTheWall) {
  const auto heart = beating_heart();
  RendererOptions options{kSize, 1};
  options.count_samples = true;
  auto view = renderer(options);
  set(*view, {heart});
  ViewScene scene;
  scene.volumes = {{heart, {}, {1, 0.4}, *preset_look("phantom")}};
  draw(*view, scene, {eye_at({0.1, 0.08, 0.2}, {0, 0, 0}, 0.6, kSize)}, kSize);
  const ViewStatistics found = view->statistics();
  RecordProperty("taken_per_needed",
                 std::to_string(double(found.samples_taken) / double(found.samples_needed)));
  EXPECT_GT(found.samples_needed, 1000U);
  // Measured 2.15: such an opaque wall needs two segments, which have three ends, and one segment
  // more is sampled in the cell before it.
  EXPECT_LT(double(found.samples_taken), 2.4 * double(found.samples_needed));
}

TEST_F(SkipTest, FollowsTheLookWithoutBeingTold) {
  const auto heart = beating_heart();
  auto view = renderer({kSize, 1});
  set(*view, {heart});
  ViewScene scene;
  const Eye eye = eye_at({0.1, 0.08, 0.2}, {0, 0, 0}, 0.6, kSize);
  scene.volumes = {{heart, {}, {0, 0.5}, step_look(5000.0)}};
  const Picture nothing = draw(*view, scene, {eye}, kSize)[0];
  scene.volumes[0].look = step_look(625.0);
  const Picture wall = draw(*view, scene, {eye}, kSize)[0];
  scene.volumes[0].look = step_look(5000.0);
  const Picture nothing_again = draw(*view, scene, {eye}, kSize)[0];
  EXPECT_EQ(channel(nothing, kSize.width / 2, kSize.height / 2, 3), 0);
  EXPECT_EQ(channel(wall, kSize.width / 2, kSize.height / 2, 3), 255);
  EXPECT_EQ(nothing.colours, nothing_again.colours);
}

}  // namespace
}  // namespace palpate::test
