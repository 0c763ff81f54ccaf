// Modes through the C interface. Oracle: the same mode in C++.
#include "integration/loading/c_modes.h"

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
  EXPECT_TRUE(loading::add_c_mode(*in_c, kinds));
  return kinds;
}

TEST(CModes, GiveTheForcesOfTheSameModeInCppBitByBit) {
  const ModeKinds kinds = both_kinds();
  const auto hand_of = [&](const char* kind) {
    SceneSpec spec = test::shell_spec(3.0, 0.0, 600.0);
    spec.modes[0].kind = kind;
    spec.modes[0].gain = 500.0;
    spec.modes[0].range_m = 0.004;
    auto scene = plan(spec, {test::shell(4, 4.0)}, kinds);
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
    EXPECT_FALSE(loading::add_c_mode(kind, kinds)) << lacks;
  }
}

/// A mode in C++ behind the C interface: a surface on a plane, which throws when the test sets it
/// to.
struct Throwing {
  static inline bool makes = true, throws = false, destroys = true;
  static inline int placed = 0;
  static void* make(const PalModeSpec*, char*, size_t) {
    if (!makes) throw std::runtime_error("no room for a mode");
    static int any;
    return &any;
  }
  static void place(const void*, const PalModeSite* site) {
    ++placed;
    if (throws) throw std::runtime_error("no such table");
    const double position_m[3] = {0.0, 0.0, 0.0}, outward[3] = {0.0, 0.0, 1.0};
    site->surface(site, position_m, outward, 3.0, 0.0);
  }
  static void destroy(void*) {
    if (!destroys) throw 17;
  }
  static constexpr PalModeKind kKind{"throwing", 0, &make, &place, &destroy};
};

TEST(CModes, ThatThrowAreLeftOutAndTheForceFollowsSlowly) {
  ModeKinds kinds;
  ASSERT_TRUE(loading::add_c_mode(Throwing::kKind, kinds));
  SceneSpec spec = test::shell_spec(3.0, 0.0, 600.0);
  spec.modes[0].kind = "throwing";
  Throwing::makes = false;
  const auto none = plan(spec, {test::shell(4, 4.0)}, kinds);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("no room for a mode"), std::string::npos)
      << none.error().message;
  Throwing::makes = true;
  Throwing::destroys = false;
  {
    auto scene = plan(spec, {test::shell(4, 4.0)}, kinds);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto* const mode = dynamic_cast<const ForeignMode*>((*scene)->modes[0].mode.get());
    ASSERT_TRUE(mode);
    EXPECT_STREQ(mode->failure(), "");
    Haptics haptics(test::unmetered(), test::Hand::device());
    haptics.adopt(Haptics::prepare(*scene));
    TickInput input;
    const auto tick = [&](double z_m) {
      input.now_ns += 1'000'000;
      input.reading.time_ns = input.now_ns;
      input.reading.fresh = true;
      input.reading.position_m = {0.0, 0.0, z_m};
      return haptics.tick(input);
    };
    TickOutput output;
    for (int k = 0; k < 4000; ++k) output = tick(std::max(-0.002, 0.002 - 2e-6 * k));
    const double pressed_n = glm::length(output.command.force_n);
    ASSERT_GT(pressed_n, 0.5);
    Throwing::throws = true;
    Throwing::placed = 0;
    double worst_step_n = 0.0;
    glm::dvec3 last_n = output.command.force_n;
    for (int k = 0; k < 1000; ++k) {
      output = tick(-0.002);
      worst_step_n = std::max(worst_step_n, glm::length(output.command.force_n - last_n));
      last_n = output.command.force_n;
    }
    EXPECT_EQ(Throwing::placed, 1) << "place() is called again";
    EXPECT_LT(glm::length(last_n), 0.01);
    EXPECT_LT(worst_step_n, 0.06);
    EXPECT_STREQ(mode->failure(),
                 "A mode threw an exception, and is left out from now on: no such table");
  }
  Throwing::throws = false;
  Throwing::destroys = true;
}

TEST(CModes, OfAnotherVersionAreNone) {
  const PalModeKind* in_c = nullptr;
  EXPECT_EQ(pal_mode_kinds(PAL_MODE_VERSION + 1, &in_c), 0U);
}

}  // namespace
}  // namespace palpate
