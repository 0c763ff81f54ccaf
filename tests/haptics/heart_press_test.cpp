// A hand that leans on the heart phantom's left ventricle for a minute of beats.
#include <gtest/gtest.h>

#include "compute/volume/heart_phantom.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "module/scene/transform.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

struct Leaning {
  /// Smallest and largest force, and its largest change in a millisecond.
  double least_n = 1e9, most_n = 0.0, step_n = 0.0;
  int lost = 0, held = 0;  ///< ticks
};

/// From 20 mm in front of a surface to `depth_m` behind it in a second, then still.
Leaning lean(test::Hand& hand, glm::dvec3 surface_m, glm::dvec3 out, double depth_m, int ticks) {
  Leaning found;
  for (int i = 0; i < 2500; ++i) hand.to(surface_m + 0.02 * out);
  glm::dvec3 before(0.0);
  for (int i = 0; i < ticks; ++i) {
    const double way = std::min(1.0, i / 1000.0);
    const TickOutput tick = hand.to(surface_m + (0.02 - way * (0.02 + depth_m)) * out);
    found.held += tick.frozen;
    if (i > 0) found.step_n = std::max(found.step_n, glm::distance(tick.command.force_n, before));
    before = tick.command.force_n;
    if (i < 1500) continue;
    const double force_n = glm::length(tick.command.force_n);
    found.least_n = std::min(found.least_n, force_n);
    found.most_n = std::max(found.most_n, force_n);
    // The hand fell through the wall: in the chamber behind it there is no force, or it points
    // inwards.
    found.lost += !tick.command.in_contact || glm::dot(tick.command.force_n, out) <= 0.0;
  }
  return found;
}

test::Hand hand_on(SceneSpec scene) {
  scene.world_from_device = {};
  auto volume = build(scene.volumes.front());
  if (!volume) throw std::runtime_error(volume.error().message);
  return test::Hand(scene, {std::make_shared<const MovingVolume>(std::move(*volume))});
}

TEST(HeartPress, HoldsForAMinuteOfBeatsWithoutSteps) {
  // The free wall of the left ventricle, away from the septum, LPS mm.
  const glm::dvec3 middle(15.0, 0.0, -16.0), away = glm::normalize(glm::dvec3(0.54, 0.83, -0.13));
  double t = 45.0;
  while (t > 0.0 && heart_value(middle + t * away, 0) < 350.0) t -= 0.01;
  test::Hand heart = hand_on(heart_scene());
  const Leaning found =
      lean(heart, volume_from_lps(middle + t * away), volume_from_lps(1e3 * away), 0.006, 60'000);
  EXPECT_EQ(found.lost, 0);
  EXPECT_EQ(found.held, 0);
  EXPECT_GT(found.least_n, 0.3);
  EXPECT_LT(found.most_n, 5.0);
  // The general target: README, known limits.
  EXPECT_LT(found.step_n, 0.05);
}

}  // namespace
}  // namespace palpate
