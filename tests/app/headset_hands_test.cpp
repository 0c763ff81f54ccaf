// What hands with controllers do to the scene, in the program as a user runs it. Evidence: the
// pictures that reach the runtime, and the force. No test here measures time: the machine may be
// busy.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include "integration/files/scene/calibration_file.h"
#include "tests/app/headset_play.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

constexpr const char* kTouch = "/interaction_profiles/oculus/touch_controller";
const std::string kLeft = "/user/hand/left/input/", kRight = "/user/hand/right/input/";
/// The eyes' first place, and the scene's middle at that time: 0.45 m in front of them and 0.15 m
/// below them.
constexpr glm::dvec3 kFirstEyes_m{0.0, 1.6, 0.0}, kScenesMiddle_m{0.0, 1.45, -0.45};
/// The eyes' place after the scene was placed.
constexpr glm::dvec3 kEyes_m{0.0, 1.45, -0.25};
/// Angles of the runtime's eyes: of the left eye to the left and to the right, and up.
constexpr double kOut = 0.9, kIn = 0.7, kUp = 0.8, kHalfApart_m = 0.0315;

/// The parts of the left eye's picture that are redder than the blue-grey background ("flesh"), and
/// their places in the room from depth and angles.
struct Flesh {
  /// Left and right of the room's plane x = 0: share of the picture.
  double left = 0.0, right = 0.0;
  glm::dvec3 middle_m{0.0};  ///< mean
  double leftmost_m = 1e9, rightmost_m = -1e9;
  /// The width of a pixel at this distance.
  double pixel_m = 0.0;
  double all() const { return left + right; }
  double width_m() const { return rightmost_m - leftmost_m; }
};
Flesh flesh_of(const MadeHeadset::Shown& shown) {
  Flesh flesh;
  const int width = shown.width / 2;
  const size_t pixels = size_t(width) * size_t(shown.height);
  if (pixels == 0 || shown.depth_m.size() != 2 * pixels) return flesh;
  const double low = -std::tan(kOut), high = std::tan(kIn), top = std::tan(kUp);
  int count = 0;
  for (int y = 0; y < shown.height; ++y)
    for (int x = 0; x < width; ++x) {
      const double ahead_m = shown.depth_m[size_t(y) * size_t(width) + size_t(x)];
      const size_t at = 3 * (size_t(y) * size_t(shown.width) + size_t(x));
      const bool red = int(uint8_t(shown.rgb[at])) > int(uint8_t(shown.rgb[at + 2])) + 25;
      if (!red || !std::isfinite(ahead_m)) continue;
      const glm::dvec2 tangents(low + (high - low) * (x + 0.5) / width,
                                top - 2.0 * top * (y + 0.5) / shown.height);
      const glm::dvec3 place = kEyes_m + glm::dvec3(-kHalfApart_m, 0.0, 0.0) +
                               ahead_m * glm::dvec3(tangents.x, tangents.y, -1.0);
      (place.x < 0.0 ? flesh.left : flesh.right) += 1.0 / double(pixels);
      flesh.middle_m += place;
      flesh.pixel_m += ahead_m * (high - low) / width;
      flesh.leftmost_m = std::min(flesh.leftmost_m, place.x);
      flesh.rightmost_m = std::max(flesh.rightmost_m, place.x);
      ++count;
    }
  if (count == 0) return flesh;
  flesh.middle_m /= double(count);
  flesh.pixel_m /= double(count);
  return flesh;
}

/// The program in a headset whose controllers have all buttons.
class HandsInAHeadset : public InAHeadset {
 protected:
  /// view: size of the picture of an eye; rate_hz: a slower display allows a finer picture.
  void start(const std::string& scene, std::vector<std::string> more, const char* view = "128 96",
             double rate_hz = 30.0) {
    // Here and not earlier: every program that is started would read it.
    headset.emplace();
    headset->say(std::string("profile ") + kTouch);
    // The pictures are measured: no controller is to hide a part of the heart.
    headset->say("without XR_EXT_interaction_render_model");
    headset->say("pictures on");
    headset->say(std::string("view ") + view);
    headset->say(fmt::format("rate {}", rate_hz));
    more.insert(more.begin(), {"--headset", "openxr", "--no-box"});
    program.emplace(feel(scene, more));
    ASSERT_TRUE(wait_until([&] { return program->ended() || flesh().all() > 0.001; }))
        << program->said();
    ASSERT_FALSE(program->ended()) << program->wait().err;
    // Closer, after the scene was placed.
    headset->say("head " + text_of(kEyes_m));
    frames_pass();
  }
  /// The simulated hand at rest, away from the still heart.
  std::vector<std::string> at_rest(glm::dvec3 place_m) {
    return {"--device", "simulated", "--hand",
            "firm",     "--path",    path_file(folder, {{0.0, place_m}, {600.0, place_m}})};
  }

  Flesh flesh() {
    headset->ask();
    return flesh_of(headset->shown());
  }
  /// Waits until earlier commands have taken effect and were drawn.
  void frames_pass(size_t count = 3) {
    const auto frames = [&] { return std::stoul("0" + headset->ask()["frames"]); };
    const size_t before = frames();
    ASSERT_TRUE(wait_until([&] { return frames() > before + count; })) << program->said();
  }
  void press(const std::string& part, double value) {
    headset->say(fmt::format("input {} {}", part, value));
    frames_pass();
  }
  void tap(const std::string& part) {
    headset->say("tap " + part);
    frames_pass();
  }
  void hand(int side, glm::dvec3 place_m) {
    headset->say(fmt::format("hand {} {}", side, text_of(place_m)));
    frames_pass();
  }
  void glide(int side, glm::dvec3 by_m, double seconds = 0.6) {
    headset->say(fmt::format("glide {} {} {}", side, text_of(by_m), seconds));
  }

  void end() {
    headset->say("exit");
    const Outcome outcome = program->wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(headset->left(), HasSubstr("violations 0"));
  }

  std::optional<MadeHeadset> headset;
  std::optional<Program> program;
};

TEST_F(HandsInAHeadset, TwoHandsThatGoApartEnlargeWhatIsSeenAndWhatIsFelt) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  std::vector<std::string> more = at_rest(way.start_m);
  more.insert(more.end(), {"--csv", folder / "ticks.csv"});
  start(scene, more);
  hand(0, kScenesMiddle_m - glm::dvec3(0.06, 0.0, 0.0));
  hand(1, kScenesMiddle_m + glm::dvec3(0.06, 0.0, 0.0));
  const Flesh before = flesh();
  press(kLeft + "squeeze/value", 1.0);
  press(kRight + "squeeze/value", 1.0);
  EXPECT_FALSE(program->said().find("touching") != std::string::npos) << program->said();
  // The factor that brings the surface 8 mm past the hand that feels.
  const double factor = (glm::length(way.start_m) + 0.008) / glm::length(way.surface_m);
  const glm::dvec3 apart((factor - 1.0) * 0.06, 0.0, 0.0);
  glide(0, -apart);
  glide(1, apart);
  ASSERT_TRUE(says(*program, "touching")) << program->said();
  frames_pass(12);
  const Flesh after = flesh();
  // Each edge in the picture is right to one pixel.
  EXPECT_NEAR(after.width_m(), factor * before.width_m(),
              2.0 * (after.pixel_m + factor * before.pixel_m));
  EXPECT_GT(after.width_m(), before.width_m() + 0.01);
  // Scaled about the middle between the hands: distances from it are multiplied by the factor.
  const glm::dvec3 wanted = kScenesMiddle_m + factor * (before.middle_m - kScenesMiddle_m);
  EXPECT_NEAR(after.middle_m.x, wanted.x, 1.5 * after.pixel_m);
  EXPECT_NEAR(after.middle_m.y, wanted.y, 1.5 * after.pixel_m);
  press(kLeft + "squeeze/value", 0.0);
  press(kRight + "squeeze/value", 0.0);
  end();
  const Table ticks(folder / "ticks.csv");
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) most_n = std::max(most_n, ticks.force(row));
  EXPECT_GT(most_n, 0.5) << "the wall was moved 8 mm past the hand";
  expect_no_jump(ticks);
}

TEST_F(HandsInAHeadset, APalmCutsTheVolumeAndTheCutStaysInItUntilItIsTappedAway) {
  const std::string scene = still_heart(folder);
  constexpr int kWidth = 96;
  // The hand must not be in front of the part that is measured.
  start(scene, at_rest({-0.07, 0.05, 0.0}), "96 72", 15.0);
  // Shares of the picture are compared, so each picture must be drawn in full. On a busy machine
  // the program draws half of the pixels, which are few of the heart.
  const auto in_full = [&] {
    Flesh found;
    EXPECT_TRUE(wait_until([&] {
      found = flesh();
      return headset->shown().width == 2 * kWidth;
    }));
    return found;
  };
  const Flesh whole = in_full();
  EXPECT_GT(whole.right, whole.left / 2);
  // The right palm points to the left; its side is kept.
  hand(1, kScenesMiddle_m);
  press(kRight + "thumbstick/click", 1.0);
  frames_pass(8);
  const Flesh held = in_full();
  EXPECT_LT(held.right, held.left / 10);
  EXPECT_NEAR(held.left, whole.left, 0.25 * whole.left);
  press(kRight + "thumbstick/click", 0.0);
  hand(1, kScenesMiddle_m + glm::dvec3(0.3, 0.0, 0.0));
  const Flesh left = in_full();
  EXPECT_LT(left.right, left.left / 10) << "the cut is where the hand is";
  // The cut is fixed to the volume: moving the volume moves the cut.
  constexpr double kQuick_s = 0.15;
  hand(0, kScenesMiddle_m);
  press(kLeft + "squeeze/value", 1.0);
  glide(0, {0.08, 0.0, 0.0}, kQuick_s);
  // Also during a fast motion: a cut that is ahead of the volume, or behind it, would show less or
  // more.
  const auto as_wide_until = [&](const std::function<bool(const Flesh&)>& there) {
    double most_pixels = 0.0;
    EXPECT_TRUE(wait_until([&] {
      const Flesh now = flesh();
      most_pixels = std::max(most_pixels, 2.0 * std::abs(now.width_m() - left.width_m()) /
                                              (left.pixel_m + now.pixel_m));
      return there(now);
    }));
    EXPECT_LT(most_pixels, 2.0) << "wider or narrower by this number of pixels";
  };
  as_wide_until([&](const Flesh& now) { return now.middle_m.x > left.middle_m.x + 0.07; });
  // The rest of the way.
  frames_pass(8);
  const Flesh moved = flesh();
  EXPECT_NEAR(moved.leftmost_m, left.leftmost_m + 0.08, left.pixel_m + moved.pixel_m);
  EXPECT_NEAR(moved.rightmost_m, left.rightmost_m + 0.08, left.pixel_m + moved.pixel_m);
  glide(0, {-0.08, 0.0, 0.0}, kQuick_s);
  as_wide_until([&](const Flesh& now) { return now.middle_m.x < left.middle_m.x + 0.01; });
  frames_pass(8);
  press(kLeft + "squeeze/value", 0.0);
  // A place where a cut that is still there would be visible.
  hand(1, kScenesMiddle_m);
  tap(kRight + "thumbstick/click");
  EXPECT_TRUE(wait_until([&] {
    const Flesh now = flesh();
    return now.rightmost_m > whole.rightmost_m - whole.pixel_m - now.pixel_m &&
           now.right > 0.7 * whole.right;
  })) << flesh().rightmost_m
      << " m instead of " << whole.rightmost_m;
  end();
}

TEST_F(HandsInAHeadset, AHandPausesScrubsBackAndForthAndPlaysTheHeart) {
  const auto phase = [](const Table& ticks, size_t row) {
    return ticks.number(row, "frame_and_phase");
  };
  std::vector<std::string> more = at_rest({0.0, 0.0, 0.07});
  more.insert(more.end(), {"--csv", folder / "ticks.csv"});
  start("shell", more, "64 48", 15.0);
  hand(1, {0.3, 1.3, -0.3});
  tap(kRight + "a/click");
  frames_pass(8);
  // Back, forth and back, so that each step differs from the motion of the beat before and after
  // it.
  for (const double way : {-1.0, 1.0, -1.0}) {
    press(kRight + "thumbstick/x", way);
    frames_pass(10);
    press(kRight + "thumbstick/x", 0.0);
    frames_pass();
  }
  // A stick that does not return to its middle.
  press(kRight + "thumbstick/x", 0.1);
  frames_pass(8);
  tap(kRight + "a/click");
  frames_pass(20);
  end();
  const Table ticks(folder / "ticks.csv");
  // Intervals in which the phase went in one direction, modulo the beat.
  constexpr double kFrames = 4.0;
  // Half speed, as in the scene.
  constexpr double kFramesPerSecond = 2.0;
  struct Stretch {
    char way;
    double from_s, to_s, moved;
  };
  std::vector<Stretch> stretches;
  for (size_t row = 1; row < ticks.size(); ++row) {
    double step = phase(ticks, row) - phase(ticks, row - 1);
    step -= kFrames * std::round(step / kFrames);
    const double t = ticks.number(row, "t_s");
    if (std::abs(step) < 1e-4) continue;
    const char way = step > 0 ? '+' : '-';
    if (stretches.empty() || stretches.back().way != way) stretches.push_back({way, t, t, 0.0});
    stretches.back().to_s = t;
    stretches.back().moved += step;
  }
  std::string said;
  for (const Stretch& one : stretches)
    said +=
        fmt::format("{} {:.3f} .. {:.3f} s: {:.3f}\n", one.way, one.from_s, one.to_s, one.moved);
  ASSERT_EQ(stretches.size(), 5u) << said;
  for (const size_t scrubbed : {size_t(1), size_t(2), size_t(3)}) {
    const Stretch& one = stretches[scrubbed];
    // A quarter of the beat per second, from the first step to the last. Frames that are late count
    // as 0.1 s at most, so a slow machine takes longer.
    const double most = 0.25 * kFrames * (one.to_s - one.from_s + 0.1);
    EXPECT_GT(std::abs(one.moved), 0.05 * kFrames) << said;
    EXPECT_LT(std::abs(one.moved), most + 0.02) << said;
  }
  for (const size_t beats : {size_t(0), size_t(4)}) {
    const Stretch& one = stretches[beats];
    EXPECT_NEAR(one.moved, kFramesPerSecond * (one.to_s - one.from_s), 0.05 * kFrames) << said;
  }
}

TEST_F(HandsInAHeadset, PresetsChangeTheLookAndComeBack) {
  const std::string scene = still_heart(folder);
  start(scene, at_rest(way_to_surface(scene, folder).start_m), "64 48", 15.0);
  hand(0, {-0.3, 1.3, -0.3});
  const auto full = [&] {
    EXPECT_TRUE(wait_until([&] {
      headset->ask();
      return headset->shown().width == 2 * 64;
    }));
    return headset->shown().rgb;
  };
  const std::string found = full();
  tap(kLeft + "y/click");
  const std::string first = full();
  tap(kLeft + "y/click");
  const std::string second = full();
  EXPECT_NE(first, second);
  EXPECT_NE(found, second);
  tap(kLeft + "x/click");
  EXPECT_TRUE(wait_until([&] { return full() == first; }));
  end();
}

TEST_F(HandsInAHeadset, TextHangsBesideTheVolumeUntilItsButtonIsPressed) {
  const std::string scene = still_heart(folder);
  start(scene, at_rest(way_to_surface(scene, folder).start_m), "64 48", 15.0);
  const auto hangs = [&](const char* count) {
    return wait_until([&] { return headset->ask()["quads"] == count; });
  };
  EXPECT_TRUE(hangs("1")) << program->said();
  tap(kLeft + "menu/click");
  EXPECT_TRUE(hangs("0"));
  tap(kLeft + "menu/click");
  EXPECT_TRUE(hangs("1"));
  end();
}

TEST_F(HandsInAHeadset, NoTextHangsWhereNoneIsWanted) {
  const std::string scene = still_heart(folder);
  std::vector<std::string> more = at_rest(way_to_surface(scene, folder).start_m);
  more.push_back("--no-panel");
  start(scene, more, "64 48", 15.0);
  frames_pass(30);
  EXPECT_EQ(headset->ask()["quads"], "0");
  end();
}

TEST_F(HandsInAHeadset, AButtonBringsTheVolumeBackBeforeThePerson) {
  start(still_heart(folder), {"--device", "controller"});
  hand(1, kScenesMiddle_m + glm::dvec3(0.25, 0.0, 0.0));
  const Flesh before = flesh();
  press(kRight + "squeeze/value", 1.0);
  glide(1, {0.15, 0.1, 0.0});
  ASSERT_TRUE(wait_until([&] { return flesh().middle_m.x > before.middle_m.x + 0.10; }));
  frames_pass(12);
  press(kRight + "squeeze/value", 0.0);
  tap(kRight + "b/click");
  // The same place relative to the head as at the start of the test, to one pixel.
  const glm::dvec3 wanted = before.middle_m + kEyes_m - kFirstEyes_m;
  EXPECT_TRUE(wait_until([&] {
    const Flesh now = flesh();
    return glm::distance(now.middle_m, wanted) < 1.5 * now.pixel_m;
  })) << text_of(flesh().middle_m)
      << " instead of " << text_of(wanted);
  end();
}

TEST_F(HandsInAHeadset, ARecentringOfTheRuntimeLeavesThePictureOnTheDevice) {
  const std::string scene = still_heart(folder);
  const Way way = way_to_surface(scene, folder);
  files::StoredCalibration stored;
  stored.calibration.stage_from_device = {kScenesMiddle_m,
                                          glm::angleAxis(0.5, glm::dvec3(0.0, 1.0, 0.0))};
  stored.calibration.used = stored.calibration.all = 12;
  stored.device = stored.headset = stored.runtime = "made";
  ASSERT_TRUE(files::write_calibration(folder / "room.json", stored));
  std::vector<std::string> more = {
      "--device",      "simulated",
      "--hand",        "none",
      "--path",        path_file(folder, {{0.0, way.start_m}, {600.0, way.start_m}}),
      "--calibration", folder / "room.json"};
  start(scene, more, "64 48", 15.0);
  const auto depths = [&] {
    EXPECT_TRUE(wait_until([&] {
      headset->ask();
      return headset->shown().width == 2 * 64;
    }));
    return headset->shown().depth_m;
  };
  // RMS distance of surfaces from their earlier place, along the eyes' axes, without edges.
  const auto apart_m = [](const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0.0;
    int count = 0;
    EXPECT_EQ(a.size(), b.size());
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      const double step = double(a[i]) - double(b[i]);
      if (!std::isfinite(a[i]) || !std::isfinite(b[i]) || std::abs(step) > 1e-3) continue;
      sum += step * step;
      ++count;
    }
    EXPECT_GT(count, 60);
    return std::sqrt(sum / std::max(count, 1));
  };
  depths();
  frames_pass();
  const std::vector<float> before = depths();
  // The limit: the change that a head motion of 0.01 mm makes.
  double limit_m = 1.0;
  for (const glm::dvec3 aside :
       {glm::dvec3(1e-5, 0, 0), glm::dvec3(0, 1e-5, 0), glm::dvec3(0, 0, 1e-5)}) {
    headset->say("head " + text_of(kEyes_m + aside));
    frames_pass();
    limit_m = std::min(limit_m, apart_m(depths(), before));
  }
  headset->say("head " + text_of(kEyes_m));
  frames_pass();
  EXPECT_GT(limit_m, 1e-6);
  for (const char* origin : {"0.4 0 -0.3 0 0.2588190 0 0.9659258",
                             "-1.2 0.1 0.7 0 -0.7071068 0 0.7071068", "0.05 0 0.02"}) {
    headset->say(std::string("recentre ") + origin);
    frames_pass();
    const double off_m = apart_m(depths(), before);
    EXPECT_LT(off_m, limit_m) << "after " << origin;
  }
  end();
}

}  // namespace
}  // namespace palpate::app
