#include "module/scene/built_in.h"

#include <gtest/gtest.h>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "module/scene/analytic_data.h"
#include "module/scene/make_volume.h"

namespace palpate {
namespace {

TEST(BuiltInScenes, ShellHoldsAtItsWallAndNowhereElse) {
  const SceneSpec scene = shell_scene();
  const auto volume = build(scene.volumes.at(0));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->frames.size(), 4u);
  EXPECT_EQ(volume->times.cycle_s, 2.0);  // two frames a second
  EXPECT_EQ(volume->motions.at(0).steps.size(), 4u);
  const ModeSpec& wall = scene.modes.at(0);
  EXPECT_EQ(wall.volume, scene.volumes[0].name);
  EXPECT_EQ(wall.friction(700.0), 0.2);
  // Every voxel deep within lung or blood must let the hand through, every one deep within the wall
  // must hold it. Deep: also its neighbours at 4 mm, so that soft edges of 1.5 voxels do not count.
  const Grid grid = heart_grid(64);
  const Mask shell = shell_mask(grid, 0);
  int inside = 0, outside = 0;
  for (int z = 4; z < 60; ++z)
    for (int y = 4; y < 60; ++y)
      for (int x = 4; x < 60; ++x) {
        int around = 0;
        for (int d = 0; d < 7; ++d) {
          const glm::ivec3 step[] = {{0, 0, 0},  {2, 0, 0}, {-2, 0, 0}, {0, 2, 0},
                                     {0, -2, 0}, {0, 0, 2}, {0, 0, -2}};
          const glm::ivec3 p = glm::ivec3(x, y, z) + step[d];
          around += shell.values[size_t(p.x + 64 * (p.y + 64 * p.z))] > 0 ? 1 : 0;
        }
        if (around != 0 && around != 7) continue;
        const glm::dvec3 at = volume_from_lps(grid.lps_from_index(glm::dvec3(x, y, z)));
        const double strength = wall.strength(volume->frames[0]->scalar(at));
        if (around == 7) {
          ++inside;
          ASSERT_GT(strength, 4.0) << x << " " << y << " " << z;
        } else {
          ++outside;
          ASSERT_EQ(strength, 0.0) << x << " " << y << " " << z;
        }
      }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 10'000);
}

TEST(BuiltInScenes, HeartHoldsInAllTissueAndLetsThroughBloodAndLung) {
  const SceneSpec scene = heart_scene();
  const auto volume = build(scene.volumes.at(0));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->frames.size(), 8u);
  EXPECT_EQ(volume->times.cycle_s, 2.0);
  EXPECT_EQ(volume->motions.at(0).steps.size(), 8u);
  const ModeSpec& wall = scene.modes.at(0);
  // Well within the muscle the wall has its full strength, in every frame.
  for (int frame = 0; frame < 8; ++frame) {
    const Grid grid = heart_grid(64);
    const Mask muscle = heart_muscle(grid, frame);
    int held = 0, all = 0;
    for (size_t n = 0; n < grid.count(); n += 7) {
      if (!muscle.values[n]) continue;
      const glm::dvec3 index(int(n) % 64, int(n) / 64 % 64, int(n) / 4096);
      const glm::dvec3 at = volume_from_lps(grid.lps_from_index(index));
      ++all;
      held += wall.strength(volume->frames[size_t(frame)]->scalar(at)) > 4.0;
    }
    EXPECT_GT(all, 1000);
    // Edges, and the openings of valves, reduce it.
    EXPECT_GT(held, 0.85 * all) << "frame " << frame;
  }
  // In the middle of the left ventricle, and in the lung, it lets the hand through.
  for (const glm::dvec3 lps : {glm::dvec3(15.0, 0.0, -16.0), glm::dvec3(60.0, -60.0, 60.0)})
    EXPECT_EQ(wall.strength(volume->frames[0]->scalar(volume_from_lps(lps))), 0.0);
}

TEST(BuiltInScenes, MoleculeIsTurnedAndGuidesNearItsAtoms) {
  const SceneSpec scene = molecule_scene();
  const auto volume = build(scene.volumes.at(0));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_TRUE(volume->is_still());
  EXPECT_EQ(scene.volumes[0].drive.kind, DriveSpec::Kind::kTurn);
  EXPECT_EQ(scene.modes.at(0).kind, "follow");
  for (const glm::dvec3& atom : dichloroethane_atoms_m()) {
    const double slope = glm::length(volume->frames[0]->vector(1.3 * atom));
    EXPECT_GT(scene.modes[0].strength(slope), 1.0);
  }
  EXPECT_EQ(scene.modes[0].strength(0.0), 0.0);
}

}  // namespace
}  // namespace palpate
