// The program in its window, on a screen of Xvfb, with a mouse that xdotool moves.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <thread>

#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/app/ticks.h"
#include "tests/desktop/virtual_display.h"

namespace palpate::app {
namespace {

using test::Screenshot;
using test::VirtualDisplay;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

/// The share of the middle of a window of 1120 x 760 that is redder than the blue-grey background.
double share_of_flesh(const Screenshot& shot) {
  int red = 0, all = 0;
  for (int y = 230; y < 530; y += 5)
    for (int x = 410; x < 710; x += 5, ++all) {
      const uint32_t pixel = shot.at(x, y);
      red += int(pixel >> 16 & 255) > int(pixel & 255) + 25;
    }
  return double(red) / all;
}

TEST(Desktop, LetsAMousePressTheBeatingHeart) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const files::TemporaryFolder folder;
  const auto csv = folder / "ticks.csv";
  Program program(
      {"feel", "heart", "--headset", "none", "--device", "mouse", "--csv", csv.string()});
  ASSERT_TRUE(wait_until([&] { return share_of_flesh(display->screenshot()) > 0.1; }))
      << "no heart is visible";
  // The start ramp takes two seconds, during which the hand must be free.
  ASSERT_TRUE(display->act("mousemove 560 380 sleep 3"));
  ASSERT_TRUE(display->act("click --repeat 40 --delay 50 4 sleep 1"));
  ASSERT_TRUE(display->act("key Escape"));
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("mouse, as asked"));
  const Table ticks(csv);
  ASSERT_GT(ticks.size(), 1000u);
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) most_n = std::max(most_n, ticks.force(row));
  EXPECT_GT(most_n, 0.3) << "the heart's wall is felt";
  // The eye is in front (+z): the wheel moves the probe away from it, to -z.
  EXPECT_LT(ticks.number(ticks.size() - 1, "probe_z_m"), ticks.number(0, "probe_z_m") - 0.01);
}

/// Mean difference of two pictures in the middle of the window, of 255.
double apart(const Screenshot& a, const Screenshot& b) {
  double sum = 0.0;
  int count = 0;
  for (int y = 180; y < 580; y += 4)
    for (int x = 360; x < 760; x += 4)
      for (const int shift : {0, 8, 16}) {
        sum += std::abs(int(a.at(x, y) >> shift & 255) - int(b.at(x, y) >> shift & 255));
        ++count;
      }
  return sum / count;
}

/// Follows a CSV of ticks while the program writes it.
class NewestTick {
 public:
  explicit NewestTick(std::filesystem::path csv) : csv_(std::move(csv)) {}

  /// A column of the newest whole line; NaN before the first one.
  double number(const std::string& column) const {
    std::ifstream in(csv_, std::ios::binary);
    std::string header;
    std::getline(in, header);
    in.seekg(0, std::ios::end);
    const std::streamoff size = in.tellg();
    constexpr std::streamoff kWindow = 8192;  // of many lines
    in.seekg(std::max<std::streamoff>(std::streamoff(header.size()) + 1, size - kWindow));
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const size_t end = text.rfind('\n');
    const size_t before = end == std::string::npos ? end : text.rfind('\n', end - 1);
    if (before == std::string::npos) return NAN;
    std::stringstream names(header), cells(text.substr(before + 1, end - before - 1));
    std::string name, cell;
    while (std::getline(names, name, ',') && std::getline(cells, cell, ','))
      if (name == column) return std::stod(cell);
    return NAN;
  }

  /// Waits until the column rests for 0.3 s of ticks where `wanted` accepts it. Its value there;
  /// NaN if it never does.
  double rest(const std::string& column, const std::function<bool(double)>& wanted) const {
    double value = NAN, since_s = 0.0;
    const bool rests = wait_until([&] {
      const double now_s = number("t_s"), now = number(column);
      if (!(std::abs(now - value) < 1e-4)) {
        value = now;
        since_s = now_s;
      }
      return now_s - since_s > 0.3 && wanted(value);
    });
    return rests ? value : NAN;
  }

 private:
  std::filesystem::path csv_;
};

TEST(Desktop, KeysGoThroughTimeAndBringViewAndProbeBack) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const files::TemporaryFolder folder;
  const auto csv = folder / "ticks.csv";
  Program program(
      {"feel", "shell", "--headset", "none", "--device", "mouse", "--csv", csv.string()});
  ASSERT_TRUE(wait_until([&] { return share_of_flesh(display->screenshot()) > 0.1; }))
      << "no heart is visible";
  // Whether the picture rests for a while, which is several pictures on a busy machine, too.
  Screenshot before = display->screenshot();
  const auto rests_for = [&](int times) {
    int rested = 0;
    return wait_until([&] {
      std::this_thread::sleep_for(500ms);
      const Screenshot now = display->screenshot();
      rested = apart(std::exchange(before, now), now) < 0.2 ? rested + 1 : 0;
      return rested >= times;
    });
  };
  // The bar of frames below: a press at a quarter of it stays there until it is released.
  ASSERT_TRUE(display->act("mousemove 309 730 sleep 0.5 mousedown 1 sleep 1"));
  // What has passed of the cycle is light blue on the bar, up to the mouse.
  const auto has_passed = [](const Screenshot& shot, int x) {
    for (int y = 710; y < 750; ++y) {
      const uint32_t pixel = shot.at(x, y);
      if ((pixel & 255) > 220 && (pixel >> 16 & 255) < 120) return true;
    }
    return false;
  };
  int held_for = 0;
  ASSERT_TRUE(wait_until([&] {
    const Screenshot now = display->screenshot();
    held_for = has_passed(now, 285) && !has_passed(now, 335) ? held_for + 1 : 0;
    std::this_thread::sleep_for(300ms);
    return held_for >= 3;
  })) << "the bar does not hold the time";
  const NewestTick tick(csv);
  // 4 frames: a quarter is frame 1.
  const auto is_at = [](double wanted, double within) {
    return [=](double frame) { return std::abs(std::remainder(frame - wanted, 4.0)) < within; };
  };
  EXPECT_FALSE(std::isnan(tick.rest("frame_and_phase", is_at(1.0, 0.02))))
      << "the bar did not lead to frame 1 of 4, but to " << tick.number("frame_and_phase");
  ASSERT_TRUE(display->act("mouseup 1"));
  ASSERT_TRUE(wait_until([&] { return !is_at(1.0, 0.1)(tick.number("frame_and_phase")); }))
      << "time does not go on";
  ASSERT_TRUE(display->act("key space"));
  const auto anywhere = [](double) { return true; };
  const double paused = tick.rest("frame_and_phase", anywhere);
  ASSERT_FALSE(std::isnan(paused)) << "Space does not pause";
  // A step of a fortieth, a tenth of a frame here, starts where the picture shows the volume: on a
  // busy machine it may be behind the hand. From there, four steps forward and two back.
  ASSERT_TRUE(display->act("key Right"));
  const double first =
      tick.rest("frame_and_phase", [&](double frame) { return std::abs(frame - paused) > 1e-4; });
  ASSERT_TRUE(display->act("key --delay 100 Right Right Right Right"));
  EXPECT_FALSE(std::isnan(tick.rest("frame_and_phase", is_at(first + 0.4, 2e-3))))
      << "four steps on from " << first << " lead to " << tick.number("frame_and_phase");
  ASSERT_TRUE(display->act("key --delay 100 Left Left"));
  EXPECT_FALSE(std::isnan(tick.rest("frame_and_phase", is_at(first + 0.2, 2e-3))))
      << "two steps back lead to " << tick.number("frame_and_phase");
  ASSERT_TRUE(rests_for(2));
  // The view is rotated with the right button, and reset by O. The probe is moved out of the way
  // first.
  ASSERT_TRUE(display->act("mousemove 250 700 sleep 1"));
  ASSERT_TRUE(rests_for(1)) << "the picture never comes to rest";
  ASSERT_TRUE(display->act(
      "mousedown 3 sleep 0.3 mousemove_relative --sync 150 -60 sleep 0.3 mouseup 3 sleep 1"));
  double turned = 0.0;
  ASSERT_TRUE(wait_until([&] {
    turned = apart(before, display->screenshot());
    return turned > 1.0;
  })) << "the view did not turn";
  ASSERT_TRUE(display->act("mousemove_relative -- -150 60 key o sleep 1"));
  EXPECT_TRUE(wait_until([&] { return apart(before, display->screenshot()) < 0.3 * turned; }))
      << "O did not bring the view back";
  // The probe is moved far in with the wheel, and reset by R.
  ASSERT_TRUE(display->act("mousemove 560 380"));
  const double outside_m = tick.rest("probe_z_m", anywhere);
  ASSERT_TRUE(display->act("click --repeat 40 --delay 50 4"));
  const double deep_m =
      tick.rest("probe_z_m", [&](double depth_m) { return std::abs(depth_m - outside_m) > 0.01; });
  ASSERT_FALSE(std::isnan(deep_m)) << "the wheel does not move the probe";
  ASSERT_TRUE(display->act("key r"));
  EXPECT_FALSE(std::isnan(tick.rest("probe_z_m", [&](double depth_m) {
    return std::abs(depth_m - deep_m) > 0.01;
  }))) << "R does not move it back";
  ASSERT_TRUE(display->act("key Escape"));
  EXPECT_EQ(program.wait().exit_code, 0);
}

/// Mean difference of two pictures in a box of the screen, of 255.
double apart_in(const Screenshot& a, const Screenshot& b, int left, int top, int right,
                int bottom) {
  double sum = 0.0;
  int count = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x)
      for (const int shift : {0, 8, 16}) {
        sum += std::abs(int(a.at(x, y) >> shift & 255) - int(b.at(x, y) >> shift & 255));
        ++count;
      }
  return sum / count;
}

TEST(Desktop, AKeyAndTheMouseLayStreamTubesAndKeysKeepAndClearThem) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const files::TemporaryFolder folder;
  const std::string file = folder / "tubes.vtk";
  Program program({"feel", "molecule", "--headset", "none", "--device", "mouse", "--tubes", file});
  ASSERT_TRUE(program.wait_for("Shown     in a window"));
  ASSERT_TRUE(display->act("mousemove 560 380 sleep 3"));
  // The wheel moves the probe into the molecule.
  ASSERT_TRUE(display->act("click --repeat 40 --delay 50 4 sleep 1"));
  ASSERT_TRUE(display->act("key t sleep 1 key k sleep 1"));
  ASSERT_TRUE(display->act("mousemove 580 390 sleep 1 mousedown 1 sleep 0.2 mouseup 1 sleep 1"));
  ASSERT_TRUE(display->act("key t sleep 1 key x sleep 1"));
  ASSERT_TRUE(display->act("mousemove 550 380 sleep 1 mousedown 1 sleep 0.2 mouseup 1 sleep 1"));
  ASSERT_TRUE(display->act("key Escape"));
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Tubes     2 stream tubes, 1 of them kept"));
}

TEST(Desktop, HelpLeavesTheForcePlotFreeInANarrowWindow) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  const files::TemporaryFolder folder;
  // One frame: only the mouse moves.
  const std::string still = written(shell_phantom(24, 1).frames[0], folder / "still.mha");
  Program program(
      {"feel", still, "--headset", "none", "--device", "mouse", "--black-box", folder / "."});
  ASSERT_TRUE(wait_until([&] { return program.said().find(" Hz ") != std::string::npos; }));
  ASSERT_TRUE(display->act("search --sync --name palpate windowsize 480 740 mousemove 200 300"));
  // Where the help is, above the plot, whose own place is the lower right corner.
  const auto help_apart = [](const Screenshot& a, const Screenshot& b) {
    return apart_in(a, b, 20, 330, 270, 550);
  };
  // A picture at rest: the only frame stands still, and the plot of a zero force is a line.
  const auto at_rest = [&] {
    Screenshot before = display->screenshot();
    int rested = 0;
    EXPECT_TRUE(wait_until([&] {
      std::this_thread::sleep_for(500ms);
      const Screenshot now = display->screenshot();
      rested = apart_in(before, now, 20, 330, 460, 720) < 0.1 ? rested + 1 : 0;
      before = now;
      return rested >= 3;
    })) << "the picture never comes to rest";
    return before;
  };
  const auto after_h = [&](const Screenshot& from) {
    EXPECT_TRUE(display->act("key h"));
    EXPECT_TRUE(wait_until([&] { return help_apart(from, display->screenshot()) > 8.0; }))
        << "the key H neither shows nor hides the help";
    return at_rest();
  };
  const Screenshot without = after_h(at_rest());
  const Screenshot with = after_h(without);
  EXPECT_LT(apart_in(with, without, 140, 570, 460, 720), 3.0) << "the help covers the plot";
  ASSERT_TRUE(display->act("key Escape"));
  EXPECT_EQ(program.wait().exit_code, 0);
}

TEST(Desktop, ViewsAVolumeWithoutHandAndPlot) {
  NEEDS_DEVICE();
  std::string why_not;
  const auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << why_not;
  Program program({"view", "shell", "--headset", "none"});
  ASSERT_TRUE(wait_until([&] { return share_of_flesh(display->screenshot()) > 0.1; }))
      << "no volume is visible";
  ASSERT_TRUE(display->act("mousemove 560 380 sleep 1"));
  const auto bright_in = [&](glm::ivec2 low, glm::ivec2 high) {
    const Screenshot shot = display->screenshot();
    int bright = 0;
    for (int y = low.y; y < high.y; ++y)
      for (int x = low.x; x < high.x; ++x) bright += int(shot.at(x, y) >> 8 & 255) > 120;
    return bright;
  };
  // Slices stand at the right until a key hides them.
  const auto slices = [&] { return bright_in({905, 20}, {1105, 220}); };
  EXPECT_TRUE(wait_until([&] { return slices() > 2000; })) << "no slices are visible";
  ASSERT_TRUE(display->act("key s"));
  EXPECT_TRUE(wait_until([&] { return slices() < 200; })) << "the slices stay";
  // A bar of frames with its words stands at the bottom.
  EXPECT_GT(bright_in({20, 700}, {1105, 745}), 200);
  // The plot's plate has white letters; here is only the dark background.
  EXPECT_LT(bright_in({780, 590}, {1105, 690}), 200) << "a force plot is drawn";
  ASSERT_TRUE(display->act("key Escape"));
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Shown     in a window, as asked."));
  EXPECT_THAT(outcome.out, ::testing::Not(HasSubstr("Felt")));
}

TEST(Desktop, SaysThatThereIsNoDisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const Outcome outcome = run({"feel", "heart", "--headset", "none"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("No window could be opened"));
}

TEST(Desktop, RefusesAMouseWhereThereIsNoWindow) {
  const Outcome outcome = run({"feel", "heart", "--device", "mouse"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--headset none"));
}

}  // namespace
}  // namespace palpate::app
