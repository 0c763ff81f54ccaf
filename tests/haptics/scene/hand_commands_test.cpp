// Commands of the hand: buttons and events on their way through the loop.
#include "module/haptics/scene/hand_commands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "module/haptics/scene_ticker.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using Kind = HandCommand::Kind;
using namespace test;

constexpr int64_t kMs = 1'000'000;

DeviceReading with(uint32_t buttons, DeviceFault fault = DeviceFault::kNone) {
  DeviceReading reading;
  reading.buttons = buttons;
  reading.fault = fault;
  return reading;
}

/// The commands of a button that is read once per millisecond, each with its millisecond.
std::vector<std::pair<int, Kind>> said(const std::vector<std::pair<int, DeviceReading>>& changes,
                                       int until_ms, uint32_t mask = 1) {
  CommandButton button(mask);
  std::vector<std::pair<int, Kind>> all;
  DeviceReading now = with(0);
  for (int ms = 0; ms < until_ms; ++ms) {
    for (const auto& [at, reading] : changes)
      if (at == ms) now = reading;
    if (const auto kind = button.step(now, ms * kMs)) all.emplace_back(ms, *kind);
  }
  return all;
}

using All = std::vector<std::pair<int, Kind>>;

TEST(CommandButton, LaysATubeWhenPressedAndClearsWhenHeldForASecond) {
  EXPECT_EQ(said({{10, with(1)}, {200, with(0)}}, 3000), (All{{10, Kind::kReleaseTube}}));
  EXPECT_EQ(said({{10, with(1)}, {2500, with(0)}}, 3000),
            (All{{10, Kind::kReleaseTube}, {1010, Kind::kClearTubes}}));
  EXPECT_EQ(said({{10, with(1)}, {20, with(0)}, {510, with(1)}, {520, with(0)}}, 3000),
            (All{{10, Kind::kReleaseTube}, {510, Kind::kReleaseTube}}));
}

TEST(CommandButton, KeepsWhenPressedTwiceWithinHalfASecond) {
  const auto presses = [](std::vector<int> at) {
    std::vector<std::pair<int, DeviceReading>> changes;
    for (const int ms : at) {
      changes.emplace_back(ms, with(1));
      changes.emplace_back(ms + 20, with(0));
    }
    return said(changes, 4000);
  };
  EXPECT_EQ(presses({10, 509}), (All{{10, Kind::kReleaseTube}, {509, Kind::kKeepTubes}}));
  EXPECT_EQ(presses({10, 100, 200, 300}), (All{{10, Kind::kReleaseTube},
                                               {100, Kind::kKeepTubes},
                                               {200, Kind::kReleaseTube},
                                               {300, Kind::kKeepTubes}}));
  EXPECT_EQ(said({{10, with(1)}, {20, with(0)}, {100, with(1)}}, 3000),
            (All{{10, Kind::kReleaseTube}, {100, Kind::kKeepTubes}}))
      << "what is kept is not cleared by the same press";
  EXPECT_EQ(said({{10, with(1)},
                  {20, with(0)},
                  {30, with(0, DeviceFault::kTimeout)},
                  {40, with(0)},
                  {100, with(1)},
                  {120, with(0)}},
                 3000),
            (All{{10, Kind::kReleaseTube}, {100, Kind::kReleaseTube}}))
      << "a fault comes between";
}

TEST(CommandButton, HearsOnlyItsOwnButtonsAndThoseOnce) {
  EXPECT_EQ(said({{10, with(4)}}, 3000, 3), All{});
  EXPECT_EQ(said({{10, with(1)}, {20, with(3)}, {30, with(2)}}, 500, 3),
            (All{{10, Kind::kReleaseTube}}))
      << "a second button while the first is down is the same press";
  EXPECT_EQ(said({{10, with(1)}}, 3000, 0), All{}) << "no button counts";
}

TEST(CommandButton, AButtonThatWasDownBeforeAnybodyLookedSaysNothing) {
  EXPECT_EQ(said({{0, with(1)}, {2000, with(0)}, {2010, with(1)}, {2020, with(0)}}, 3000),
            (All{{2010, Kind::kReleaseTube}}));
  // The same after a fault, during which buttons are ignored.
  EXPECT_EQ(said({{10, with(0, DeviceFault::kUnplugged)}, {20, with(1)}, {1500, with(0)}}, 3000),
            All{});
  EXPECT_EQ(said({{10, with(1)}, {20, with(1, DeviceFault::kTimeout)}, {30, with(1)}}, 3000),
            (All{{10, Kind::kReleaseTube}}))
      << "a press that a fault interrupts is not a long press";
}

TEST(SceneTicker, PassesCommandsOnInOrderWithTheirTick) {
  SceneTicker ticker({}, Hand::device());
  ticker.take_buttons(1);
  const auto scene = plan(shell_spec(6.0, 0.4, 700.0), {shell(2, 2.0)});
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_TRUE(ticker.offer(*scene));
  for (int ms = 1; ms <= 20; ++ms) {
    TickInput input;
    input.now_ns = ms * kMs;
    input.reading.position_m = {0.001 * ms, 0.05, 0.0};
    input.reading.time_ns = input.now_ns;
    input.reading.fresh = true;
    input.reading.buttons = ms == 7 ? 1 : 0;
    if (ms == 12) {
      input.event_count = 3;
      input.events[0] = {ControlEvent::Kind::kKeepTubes};
      input.events[1] = {ControlEvent::Kind::kRearm};
      input.events[2] = {ControlEvent::Kind::kClearTubes};
    }
    ticker.tick(input);
  }
  std::vector<std::pair<int, Kind>> all;
  HandCommand command;
  while (ticker.next_command(command)) {
    all.emplace_back(int(command.snapshot.now_ns / kMs), command.kind);
    // In free space the proxy is at the hand.
    EXPECT_NEAR(command.snapshot.proxy_m.x, 1e-9 * double(command.snapshot.now_ns), 5e-4);
    EXPECT_EQ(command.snapshot.volume_count, 1);
  }
  EXPECT_EQ(all, (All{{7, Kind::kReleaseTube}, {12, Kind::kKeepTubes}, {12, Kind::kClearTubes}}));
}

TEST(SceneTicker, TellsViewersHowTheGripIsHeldAlongTheWorldsAxes) {
  SceneTicker ticker({}, Hand::device());
  SceneSpec spec = shell_spec(6.0, 0.4, 700.0);
  // A quarter about y: the device's z is the world's x.
  spec.world_from_device.rotation = glm::dquat(std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0);
  const auto scene = plan(spec, {shell(2, 2.0)});
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_TRUE(ticker.offer(*scene));
  TickInput input;
  SceneSnapshot snapshot;
  const auto shaft = [&] {
    ticker.tick(input);
    EXPECT_TRUE(ticker.newest(0, snapshot));
    return snapshot.shaft;
  };
  EXPECT_EQ(shaft(), glm::dvec3(0.0)) << "it is not sensed";
  input.reading.grip.turns = true;
  EXPECT_LT(glm::distance(shaft(), glm::dvec3(1.0, 0.0, 0.0)), 1e-15);
  // A quarter about the device's x: the shaft goes down.
  input.reading.grip.device_from_grip = glm::dquat(std::sqrt(0.5), std::sqrt(0.5), 0.0, 0.0);
  EXPECT_LT(glm::distance(shaft(), glm::dvec3(0.0, -1.0, 0.0)), 1e-15);
}

TEST(SceneTicker, CommandsChangeNoForce) {
  const auto scene = plan(shell_spec(6.0, 0.4, 700.0), {shell(4, 2.0)});
  ASSERT_TRUE(scene);
  const auto forces = [&](bool commands) {
    SceneTicker ticker({}, Hand::device());
    if (commands) ticker.take_buttons(~0u);
    EXPECT_TRUE(ticker.offer(*scene));
    std::vector<glm::dvec3> all;
    for (int ms = 1; ms <= 4000; ++ms) {
      TickInput input;
      input.now_ns = ms * kMs;
      const double r = ms < 2500 ? 0.06 : std::max(0.02, 0.06 - 3e-5 * (ms - 2500));
      input.reading.position_m = {0.0, 0.0, r};
      input.reading.time_ns = input.now_ns;
      input.reading.fresh = true;
      input.reading.buttons = ms / 300 % 2;
      if (commands && ms % 500 == 0) {
        input.event_count = 1;
        input.events[0] = {ControlEvent::Kind::kReleaseTube};
      }
      all.push_back(ticker.tick(input).command.force_n);
    }
    return all;
  };
  const std::vector<glm::dvec3> without = forces(false);
  EXPECT_GT(glm::length(without.back()), 0.1);
  EXPECT_EQ(forces(true), without);
}

}  // namespace
}  // namespace palpate
