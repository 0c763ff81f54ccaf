#include "docs/examples/snap_mode.h"

#include <gtest/gtest.h>

#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

// The example mode of the documentation, used as a user would.
TEST(SnapMode, HoldsTheHandOnTheIsoSurfaceFromBothSides) {
  ModeKinds kinds;
  add_snap(kinds);
  SceneSpec spec = test::shell_spec(3.0, 0.0, 600.0);
  spec.modes[0].kind = "snap";
  spec.modes[0].gain = 500.0;
  spec.modes[0].range_m = 0.004;
  const auto scene = plan(spec, {test::shell(1, 1.0)}, kinds);
  ASSERT_TRUE(scene) << scene.error().message;
  Haptics haptics(test::unmetered(), test::Hand::device());
  haptics.adopt(Haptics::prepare(*scene));
  for (const double probe : {0.0255, 0.0245}) {
    TickInput input;
    TickOutput out;
    for (int i = 0; i < 50; ++i) {
      input.now_ns += 1'000'000;
      input.reading.time_ns = input.now_ns;
      input.reading.position_m = {probe, 0.0, 0.0};
      out = haptics.tick(input);
    }
    // The foot point is found with the local slope: after a few frames it is on the surface.
    EXPECT_NEAR(out.proxy_m.x, 1e-3 * test::kOuterMm, 5e-6) << probe;
    EXPECT_GT(glm::length(out.wanted_n), 0.2);
  }
}

TEST(SnapMode, IsRefusedWithoutAReach) {
  ModeKinds kinds;
  add_snap(kinds);
  SceneSpec spec = test::shell_spec(3.0, 0.0, 600.0);
  spec.modes[0].kind = "snap";
  const auto scene = plan(spec, {test::shell(1, 1.0)}, kinds);
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("range_m"), std::string::npos);
}

}  // namespace
}  // namespace palpate
