// Modes through the C interface. Oracle: the same mode in C++.
#include "integration/scenes/c_modes.h"

#include <gtest/gtest.h>

#include "docs/examples/snap_mode.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

ModeKinds both_kinds() {
  ModeKinds kinds;
  add_snap(kinds);
  const PalModeKind* in_c = nullptr;
  EXPECT_EQ(pal_mode_kinds(PAL_MODE_VERSION, &in_c), 1U);
  EXPECT_TRUE(scenes::add_c_mode(*in_c, kinds));
  return kinds;
}

TEST(CModes, GiveTheForcesOfTheSameModeInCppBitByBit) {
  const ModeKinds kinds = both_kinds();
  const auto hand_of = [&](const char* kind) {
    SceneSpec spec = test::shell_spec(3.0, 0.0, 600.0);
    spec.modes[0].kind = kind;
    spec.modes[0].gain = 500.0;
    spec.modes[0].range_m = 0.004;
    auto scene = assemble(spec, {test::shell(4, 4.0)}, kinds);
    EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
    auto haptics = std::make_unique<Haptics>(test::unmetered(), test::Hand::device());
    haptics->adopt(Haptics::prepare(*scene));
    return haptics;
  };
  const auto in_cpp = hand_of("snap"), in_c = hand_of("snap-c");
  TickInput input;
  double most_n = 0.0;
  for (int k = 0; k < 3000; ++k) {
    input.now_ns += 1'000'000;
    input.reading.time_ns = input.now_ns;
    input.reading.fresh = true;
    input.reading.position_m = (0.026 + 0.003 * std::sin(1e-3 * k)) *
                               glm::normalize(glm::dvec3(0.5, 0.4, -0.3 + 1e-4 * k));
    const TickOutput expected = in_cpp->tick(input), got = in_c->tick(input);
    ASSERT_EQ(got.command.force_n, expected.command.force_n) << "tick " << k;
    ASSERT_EQ(got.proxy_m, expected.proxy_m) << "tick " << k;
    most_n = std::max(most_n, glm::length(got.wanted_n));
  }
  EXPECT_GT(most_n, 0.5);
}

TEST(CModes, ThatLackSomethingAreRefused) {
  const PalModeKind* in_c = nullptr;
  pal_mode_kinds(PAL_MODE_VERSION, &in_c);
  ModeKinds kinds;
  for (const int lacks : {0, 1, 2}) {
    PalModeKind kind = *in_c;
    if (lacks == 0) kind.name = nullptr;
    if (lacks == 1) kind.make = nullptr;
    if (lacks == 2) kind.place = nullptr;
    EXPECT_FALSE(scenes::add_c_mode(kind, kinds)) << lacks;
  }
}

TEST(CModes, OfAnotherVersionAreNone) {
  const PalModeKind* in_c = nullptr;
  EXPECT_EQ(pal_mode_kinds(PAL_MODE_VERSION + 1, &in_c), 0U);
}

}  // namespace
}  // namespace palpate
