// The real window on a virtual screen (Xvfb), with a mouse that xdotool moves. Oracle: the colours
// of the picture, read from the screen.

#include "integration/desktop/window.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <thread>

#include "integration/desktop/camera.h"
#include "integration/desktop/force_plot.h"
#include "integration/desktop/help.h"
#include "module/haptics/servo/position_source.h"
#include "tests/desktop/virtual_display.h"

namespace palpate::desktop {
namespace {

using test::Screenshot;
using test::VirtualDisplay;

/// Left half red, right half blue, with a brighter upper half: any exchange of directions is
/// visible.
Picture quarters(int width, int height) {
  Picture picture;
  picture.width = width;
  picture.height = height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const uint32_t level = y < height / 2 ? 240 : 120;
      picture.colours.push_back(x < width / 2 ? level : level << 16);
    }
  return picture;
}

class OnAScreen : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why_not;
    display_ = VirtualDisplay::start(800, 600, why_not);
    if (!display_) GTEST_SKIP() << why_not;
    auto opened = Window::open("palpate", 640, 480);
    ASSERT_TRUE(opened) << opened.error().message;
    window_ = std::move(*opened);
  }
  void TearDown() override { window_.reset(); }

  /// Shows the picture until `done` is true, for a limited time: events arrive with a delay.
  template <class Done>
  bool show_until(const Picture& picture, Done done, std::span<const Overlay> overlays = {}) {
    for (int k = 0; k < 600; ++k) {
      window_->show(picture, overlays);
      if (done(window_->poll())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  /// The command that moves the mouse to a place of the window. Without a window manager the
  /// window's place on the screen does not change.
  static std::string to(int x, int y) {
    return "mousemove " + std::to_string(x) + " " + std::to_string(y);
  }

  std::unique_ptr<VirtualDisplay> display_;
  std::unique_ptr<Window> window_;
};

TEST_F(OnAScreen, ShowsThePicturesColoursTheRightWayRound) {
  const Picture picture = quarters(320, 240);
  Screenshot shot;
  const bool shown = show_until(picture, [&](const Input&) {
    shot = display_->screenshot();
    return shot.width == 800 && shot.at(100, 100) == 0xF00000;
  });
  ASSERT_TRUE(shown) << "the screen has " << std::hex << shot.at(100, 100);
  EXPECT_EQ(shot.at(500, 100), 0x0000F0u);
  EXPECT_EQ(shot.at(100, 400), 0x780000u);
  EXPECT_EQ(shot.at(500, 400), 0x000078u);
  EXPECT_EQ(shot.at(700, 550), 0x000000u) << "outside the window";
}

TEST_F(OnAScreen, LaysOverlaysOverThePicture) {
  charts::Bitmap half_white{20, 10, std::vector<uint32_t>(200, 0x80808080)};
  const Overlay overlay{&half_white, {50, 30}};
  Screenshot shot;
  const bool shown = show_until(quarters(320, 240),
                                [&](const Input&) {
                                  shot = display_->screenshot();
                                  return shot.at(60, 35) != 0 && shot.at(60, 35) != 0xF00000;
                                },
                                {&overlay, 1});
  ASSERT_TRUE(shown);
  // 128 of white over 240, 0, 0, of which 127 of 255 remain: 247.5, 128, 128, rounded up or down.
  EXPECT_NEAR(double(shot.at(60, 35) >> 16), 247.5, 1.0);
  EXPECT_NEAR(double(shot.at(60, 35) & 255), 128.0, 1.0);
  EXPECT_EQ(shot.at(49, 35), 0xF00000u);
  EXPECT_EQ(shot.at(60, 41), 0xF00000u);
}

/// What is shown already is not drawn again, unless the display has lost it.
TEST_F(OnAScreen, ShowsAPictureAgainThatWasOffTheScreen) {
  const Picture picture = quarters(320, 240);
  const auto is_seen = [&](const Input&) {
    return display_->screenshot().at(100, 100) == 0xF00000;
  };
  ASSERT_TRUE(show_until(picture, is_seen));
  ASSERT_TRUE(display_->act("search --name palpate windowmove 790 590"));
  ASSERT_TRUE(show_until(
      picture, [&](const Input&) { return display_->screenshot().at(100, 100) == 0x000000; }));
  ASSERT_TRUE(display_->act("search --name palpate windowmove 0 0"));
  EXPECT_TRUE(show_until(picture, is_seen));
}

TEST_F(OnAScreen, ShowsWhatHasChangedOfThePictureOrAnOverlay) {
  Picture picture = quarters(320, 240);
  charts::Bitmap white{20, 10, std::vector<uint32_t>(200, 0xffffffff)};
  Overlay overlay{&white, {50, 30}};
  const std::span<const Overlay> overlays(&overlay, 1);
  const auto has = [&](int x, int y, uint32_t colour) {
    return [=, this](const Input&) { return display_->screenshot().at(x, y) == colour; };
  };
  ASSERT_TRUE(show_until(picture, has(55, 35, 0xFFFFFF), overlays));
  // A place, a colour, the picture, and none any more.
  overlay.corner_px = {150, 30};
  EXPECT_TRUE(show_until(picture, has(155, 35, 0xFFFFFF), overlays));
  EXPECT_TRUE(show_until(picture, has(55, 35, 0xF00000), overlays));
  white.pixels.assign(200, 0xff00ff00);
  EXPECT_TRUE(show_until(picture, has(155, 35, 0x00FF00), overlays));
  for (uint32_t& colour : picture.colours) colour = 0x008000;
  EXPECT_TRUE(show_until(picture, has(55, 35, 0x008000), overlays));
  EXPECT_TRUE(show_until(picture, has(155, 35, 0x008000)));
}

TEST_F(OnAScreen, KeepsThePicturesShapeWhenTheWindowIsResized) {
  const Picture picture = quarters(200, 200);  // square: margins at the left and right
  Screenshot shot;
  ASSERT_TRUE(show_until(picture, [&](const Input&) {
    shot = display_->screenshot();
    return shot.at(100, 100) == 0xF00000;
  }));
  EXPECT_EQ(shot.at(40, 100) >> 16 & 255, 8u) << "the margin: 0.03 of 255";
  ASSERT_TRUE(display_->act("search --name palpate windowsize 300 500"));
  ASSERT_TRUE(show_until(picture, [&](const Input&) {
    shot = display_->screenshot();
    return window_->size_px().width == 300 && shot.at(10, 200) == 0xF00000;
  }));
  EXPECT_EQ(window_->size_px().height, 500);
  EXPECT_EQ(shot.at(290, 390), 0x000078u);
  EXPECT_EQ(shot.at(150, 50) >> 16 & 255, 8u) << "now the margin is above";
}

TEST_F(OnAScreen, TellsWhereTheMouseIsInThePicture) {
  const Picture picture = quarters(640, 480);
  ASSERT_TRUE(display_->act(to(320, 240)));
  Input input;
  ASSERT_TRUE(show_until(picture,
                         [&](const Input& now) {
                           input = now;
                           return now.in_window && std::abs(now.cursor.x) < 0.01 &&
                                  std::abs(now.cursor.y) < 0.01;
                         }))
      << input.cursor.x << ' ' << input.cursor.y;
  ASSERT_TRUE(display_->act(to(480, 120)));
  ASSERT_TRUE(show_until(picture, [&](const Input& now) {
    input = now;
    return now.moved;
  }));
  // A pixel is 2 / 640 of the width.
  EXPECT_NEAR(input.cursor.x, 0.5, 0.004);
  EXPECT_NEAR(input.cursor.y, 0.5, 0.005);
  EXPECT_NEAR(input.dragged.x, 160.0 / 480.0, 0.003);
  EXPECT_NEAR(input.dragged.y, 120.0 / 480.0, 0.003);
}

TEST_F(OnAScreen, HearsWheelButtonsAndKeys) {
  const Picture picture = quarters(64, 48);
  ASSERT_TRUE(show_until(picture, [](const Input&) { return true; }));
  ASSERT_TRUE(display_->act(to(320, 240) + " click --repeat 3 4"));
  double wheel = 0.0;
  EXPECT_TRUE(show_until(picture, [&](const Input& now) { return (wheel += now.wheel) >= 3.0; }));
  EXPECT_EQ(wheel, 3.0) << "away from the user must be positive";
  ASSERT_TRUE(display_->act("mousedown 1"));
  EXPECT_TRUE(show_until(picture, [](const Input& now) { return now.left && !now.right; }));
  ASSERT_TRUE(display_->act("mouseup 1 mousedown 3"));
  EXPECT_TRUE(show_until(picture, [](const Input& now) { return !now.left && now.right; }));
  ASSERT_TRUE(display_->act("mouseup 3 key space Left Right c 3 r o h plus minus"));
  std::vector<KeyAction> keys;
  int look = -1;
  show_until(picture, [&](const Input& now) {
    for (const KeyPress& press : now.keys) {
      keys.push_back(press.key);
      if (press.key == KeyAction::kLook) look = press.number;
    }
    return keys.size() >= 10;
  });
  EXPECT_THAT(keys, ::testing::ElementsAre(KeyAction::kPlay, KeyAction::kBack, KeyAction::kForward,
                                           KeyAction::kClip, KeyAction::kLook, KeyAction::kRecentre,
                                           KeyAction::kReset, KeyAction::kHelp, KeyAction::kNearer,
                                           KeyAction::kFurther));
  EXPECT_EQ(look, 2);
  EXPECT_FALSE(window_->closed());
  ASSERT_TRUE(display_->act("key Escape"));
  EXPECT_TRUE(show_until(picture, [&](const Input&) { return window_->closed(); }));
}

TEST_F(OnAScreen, LetsTheMouseMoveTheProbeTheRightWay) {
  const Picture picture = quarters(640, 480);
  Camera camera;  // looks along -z: right is +x, up is +y, away is -z
  camera.distance_m = 0.3;
  const Eye eye = eye_of(camera, {640, 480});
  Pointing pointing(glm::dvec3(0.0));
  PositionSource probe;
  int64_t now_ns = 0;
  glm::dvec3 at(0.0);
  // A hand as in the program: polled with the frames, exchanged a thousand times per second.
  const auto settle_at = [&](const std::string& deed, glm::dvec3 expected) {
    EXPECT_TRUE(display_->act(deed));
    const bool came = show_until(picture, [&](const Input& input) {
      if (input.in_window) pointing.point(eye, input.cursor, 1e-3 * input.wheel);
      probe.hold(pointing.place_m(), input.left ? 1 : 0);
      for (int k = 0; k < 50; ++k) at = probe.exchange_at(now_ns += 1'000'000).position_m;
      return glm::distance(at, expected) < 3e-4;  // a pixel is 0.3 mm * 0.64: two, and settling
    });
    EXPECT_TRUE(came) << deed << ": " << at.x << ' ' << at.y << ' ' << at.z;
  };
  const double half_height_m = 0.3 * std::tan(0.5 * camera.height_angle);
  settle_at(to(320, 240), {0.0, 0.0, 0.0});
  settle_at(to(440, 240), {0.5 * half_height_m, 0.0, 0.0});
  settle_at(to(440, 120), {0.5 * half_height_m, 0.5 * half_height_m, 0.0});
  settle_at(to(320, 240) + " click --repeat 5 4", {0.0, 0.0, -0.005});
  settle_at("click --repeat 2 5", {0.0, 0.0, -0.003});
}

TEST(Window, SaysInASentenceThatThereIsNoDisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const auto window = Window::open("palpate", 640, 480);
  ASSERT_FALSE(window);
  EXPECT_EQ(window.error().kind, ErrorKind::kNoDevice);
  EXPECT_THAT(window.error().message, ::testing::HasSubstr("No window could be opened"));
  EXPECT_THAT(window.error().message, ::testing::HasSubstr("desktop session"));
}

TEST(Window, PutsAPictureIntoItsMiddleAsLargeAsItCanBe) {
  const PicturePlace wide = place_of_picture({800.0, 600.0}, 2.0);
  EXPECT_EQ(wide.corner, glm::dvec2(0.0, 100.0));
  EXPECT_EQ(wide.size, glm::dvec2(800.0, 400.0));
  const PicturePlace high = place_of_picture({800.0, 600.0}, 0.5);
  EXPECT_EQ(high.corner, glm::dvec2(250.0, 0.0));
  EXPECT_EQ(high.size, glm::dvec2(300.0, 600.0));
  EXPECT_EQ(place_of_picture({800.0, 600.0}, 0.0).size, glm::dvec2(800.0, 600.0));
}

}  // namespace
}  // namespace palpate::desktop
