// What a person in a headset reads: the text's drawing, and what the buttons are said to do.
#include "integration/headset/room_panel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <thread>

#include "module/xr/bindings.h"

namespace palpate::headset {
namespace {

using ::testing::Contains;
using ::testing::Not;
using ::testing::Pair;

TEST(ButtonHelpTest, NamesThePartsOfTheController) {
  const auto help =
      button_help("/interaction_profiles/oculus/touch_controller", "Hold to feel the force");
  EXPECT_THAT(help, Contains(Pair("squeeze", "Grab the volume")));
  EXPECT_THAT(help, Contains(Pair("trigger", "Hold to feel the force")));
  EXPECT_THAT(help, Contains(Pair("right A", "Play or pause")));
  EXPECT_THAT(help, Contains(Pair("left Y", "Next look")));
  EXPECT_THAT(help, Contains(Pair("left menu", "Show or hide the text")));
  EXPECT_THAT(help, Contains(Pair("right stick sideways", "Move through time")));
}

TEST(ButtonHelpTest, HasALineForEachUseOfEveryController) {
  for (const xr::Profile& profile : xr::profiles()) {
    // Bare hands have lines of their own.
    if (profile.of_bare_hands) continue;
    size_t uses = 0;
    for (const xr::ActSpec& act : xr::acts())
      uses += act.kind != xr::ActKind::kPose && act.kind != xr::ActKind::kVibration &&
              std::any_of(profile.bindings.begin(), profile.bindings.end(),
                          [&](const xr::InputBinding& one) { return one.act == act.act; });
    EXPECT_EQ(button_help(profile.path, "tube").size(), uses) << profile.path;
    EXPECT_EQ(button_help(profile.path, "").size(), uses - 1) << "a trigger without use";
  }
  EXPECT_TRUE(button_help("/interaction_profiles/unknown", "tube").empty());
}

/// Pixels that differ from the panel's ground within a part of its height.
size_t inked(const charts::Bitmap& bitmap, double from, double to) {
  size_t count = 0;
  for (int y = int(from * bitmap.height); y < int(to * bitmap.height); ++y)
    for (int x = 0; x < bitmap.width; ++x)
      count += bitmap.pixels[size_t(y) * size_t(bitmap.width) + size_t(x)] != bitmap.pixels[0];
  return count;
}

TEST(RoomPanelTest, WritesLongSentencesInSeveralLinesWithinItsWidth) {
  RoomText text;
  text.state = "short";
  const charts::Bitmap one = draw_room_panel(text);
  text.state =
      "Move the hand to free space: the force comes up slowly once nothing is touched, and only "
      "then can the scene be felt as it is.";
  const charts::Bitmap many = draw_room_panel(text);
  ASSERT_EQ(many.width, kRoomPanelWidth_px);
  ASSERT_EQ(many.height, kRoomPanelHeight_px);
  EXPECT_EQ(inked(one, 0.07, 1.0), 0u);
  EXPECT_GT(inked(many, 0.07, 1.0), 0u) << "no second line";
  // No ink in the last column: nothing is cut off.
  for (int y = 0; y < many.height; ++y)
    ASSERT_EQ(many.pixels[size_t(y + 1) * size_t(many.width) - 1], many.pixels[0]);
}

TEST(RoomPanelTest, ShowsTheSlicesAndTheButtons) {
  RoomText text;
  text.state = "touching";
  const size_t before = inked(draw_room_panel(text), 0.9, 1.0);
  EXPECT_EQ(before, 0u);
  text.help = {{"squeeze", "Grab the volume"}, {"right A", "Play or pause"}};
  EXPECT_GT(inked(draw_room_panel(text), 0.9, 1.0), 0u);
  auto slices = std::make_shared<OrthogonalSlices>();
  for (Slice& slice : slices->planes) {
    slice.width = slice.height = 4;
    slice.values.assign(16, 1.0F);
    slice.contours_px.clear();
  }
  text.slices = slices;
  const charts::Bitmap beside = draw_room_panel(text);
  const size_t white = size_t(std::count(beside.pixels.begin(), beside.pixels.end(), 0xffffffffU));
  EXPECT_GT(white, 50'000u) << "three slices of white";
}

TEST(RoomPanelTest, IsDrawnAgainOnlyWhenItSaysSomethingElse) {
  RoomPanel panel;
  RoomText text;
  text.state = "touching";
  int64_t now_ns = 0;
  const auto next = [&](const std::function<bool()>& drawn, int tries = 60'000) {
    for (int i = 0; i < tries && !drawn(); ++i) {
      panel.want(text, now_ns += 10'000'000);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return drawn();
  };
  ASSERT_TRUE(next([&] { return panel.newest() != nullptr; }));
  const auto first = panel.newest();
  EXPECT_EQ(first->width, kRoomPanelWidth_px);
  EXPECT_EQ(first->colours[0] & 255U, uint32_t(14)) << "red of the ground is in the lowest byte";
  EXPECT_FALSE(next([&] { return panel.newest() != first; }, 200)) << "two seconds";
  text.state = "nothing is touched";
  EXPECT_TRUE(next([&] { return panel.newest() != first; }));
}

}  // namespace
}  // namespace palpate::headset
