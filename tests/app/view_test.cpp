// `palpate view` as a user runs it, and the place of a cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "compute/volume/heart_phantom.h"
#include "module/scene/data_box.h"
#include "module/scene/look.h"
#include "module/session/scene_picture.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/charts/picture_file.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using charts::read_png;
using charts::ReadPicture;
using files::TemporaryFolder;
using ::testing::HasSubstr;

/// Share of the pixels that are redder than the background and the shapes of the scene.
double red_share(const ReadPicture& picture) {
  double red = 0.0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const glm::ivec3 c = picture.rgb(x, y);
      red += c.r > c.b + 25;
    }
  return red / std::max(1, picture.width * picture.height);
}

/// Share of the pixels in which two pictures differ by more than noise.
double changed_share(const ReadPicture& a, const ReadPicture& b) {
  if (a.width != b.width || a.height != b.height || a.width == 0) return 1.0;
  double changed = 0.0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const glm::ivec3 d = glm::abs(a.rgb(x, y) - b.rgb(x, y));
      changed += d.r + d.g + d.b > 30;
    }
  return changed / (a.width * a.height);
}

ReadPicture picture_of(std::vector<std::string> what, const TemporaryFolder& folder,
                       const std::string& name) {
  std::vector<std::string> arguments = {"view"};
  arguments.insert(arguments.end(), what.begin(), what.end());
  for (const std::string& more : {std::string("--picture"), std::string(folder / name),
                                  std::string("--picture-size"), std::string("192")})
    arguments.push_back(more);
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return read_png(folder / name);
}

TEST(CutBefore, GoesThroughWhatIsTouchedAndNeverTakesTheMiddle) {
  constexpr double kRadius = 0.1;
  const glm::dvec3 centre(0.02, -0.01, 0.03);
  for (const glm::dvec3 from :
       {glm::dvec3(0.2, 0.1, 0.5), glm::dvec3(-0.5, 0.0, 0.1), glm::dvec3(0.1, 0.5, -0.2)}) {
    const Eye eye = eye_at(centre + from, centre, 0.5, {100, 100});
    const glm::dvec3 towards = glm::normalize(from);
    for (const double before : {-0.2, -0.03, 0.0, 0.02, 0.04, 0.3}) {
      const glm::dvec3 touched = centre + before * towards + glm::dvec3(0.004, 0.002, -0.003);
      const ClipPlane cut = cut_before(eye, touched, centre, kRadius);
      EXPECT_NEAR(glm::length(cut.normal), 1.0, 1e-12);
      // The cut's face is visible: at less than 45 degrees.
      EXPECT_LT(glm::dot(cut.normal, towards), -std::sqrt(0.5));
      EXPECT_GE(glm::dot(cut.normal, centre), cut.offset_m - 1e-12) << "the middle is cut away";
      const glm::dvec3 front = centre + 0.9 * kRadius * towards;
      EXPECT_LT(glm::dot(cut.normal, front), cut.offset_m) << "nothing is cut away";
      if (before >= 0.02 && before <= 0.04) {
        EXPECT_NEAR(glm::dot(cut.normal, touched), cut.offset_m, 1e-12);
      }
    }
  }
}

TEST(EyeBefore, SeesAllOfABoxAndNotMuchMore) {
  const glm::dmat3 oblique =
      glm::mat3_cast(glm::angleAxis(0.7, glm::normalize(glm::dvec3(2.0, -1.0, 1.0))));
  for (const glm::dmat3& axes : {glm::dmat3(1.0), oblique})
    for (const glm::dvec3 edges :
         {glm::dvec3(0.128), glm::dvec3(0.16, 0.04, 0.1), glm::dvec3(0.02, 0.2, 0.02)}) {
      const auto corners_m = DataBox{glm::dvec3(0.1, 0.2, -0.3), axes, edges}.corners();
      const Eye eye = eye_before(corners_m, {300, 300});
      double furthest = 0.0;
      for (const glm::dvec3 corner : corners_m) {
        const glm::dvec3 seen = glm::conjugate(eye.orientation) * (corner - eye.position_m);
        furthest = std::max({furthest, std::abs(seen.x / seen.z) / eye.tan_right,
                             std::abs(seen.y / seen.z) / eye.tan_up});
      }
      EXPECT_LT(furthest, 1.0);
      EXPECT_GT(furthest, 0.9);
    }
}

TEST(View, DrawsTheHeartAndItsInside) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  EXPECT_GT(red_share(picture_of({"heart"}, folder, "built_in.png")), 0.12);
  // The same from a file, which is read in less time than the built-in heart is made.
  const std::string heart = written(heart_phantom(64), folder / "heart.seq.nrrd");
  const ReadPicture whole = picture_of({heart}, folder, "whole.png");
  ASSERT_EQ(whole.width, 192);
  EXPECT_GT(red_share(whole), 0.12);
  const ReadPicture open = picture_of({heart, "--cut-open"}, folder, "open.png");
  EXPECT_GT(red_share(open), 0.06) << "the cut leaves nothing";
  EXPECT_GT(changed_share(whole, open), 0.05) << "the cut is not visible";
  const ReadPicture systole = picture_of({heart, "--frame", "3"}, folder, "systole.png");
  EXPECT_GT(changed_share(whole, systole), 0.02);
  const ReadPicture bare = picture_of({heart, "--no-box"}, folder, "bare.png");
  EXPECT_GT(changed_share(whole, bare), 0.01);
}

TEST(View, HasSlicesBesideThePictureUnlessTheyAreNotWanted) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string shell = written(shell_phantom(32, 2), folder / "shell.seq.nrrd");
  const auto drawn = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"view", shell, "--picture", folder / name, "--picture-size", "256"});
    const Outcome outcome = run(more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read_png(folder / name);
  };
  const ReadPicture with = drawn("with.png", {}), without = drawn("without.png", {"--no-slices"});
  ASSERT_EQ(without.width, 256);
  ASSERT_GT(with.width, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) ASSERT_EQ(with.rgb(x, y), without.rgb(x, y));
  // Whole frames are not moved in slices either.
  const ReadPicture first = drawn("first.png", {"--whole-frames"});
  const ReadPicture between = drawn("between.png", {"--whole-frames", "--frame", "0.5"});
  EXPECT_EQ(changed_share(first, between), 0.0);
  EXPECT_GT(changed_share(first, drawn("moved.png", {"--frame", "0.5"})), 0.0);
  // The wall of the shell is bright in the slices, in the lowest of them, too.
  int bright = 0;
  for (int y = 150; y < 210; ++y)
    for (int x = 256; x < with.width; ++x) bright += with.rgb(x, y).g > 150;
  EXPECT_GT(bright, 300);
}

TEST(View, ShowsTheDerivedWallWhereItIsAsked) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string shell = written(shell_phantom(48, 1), folder / "shell.seq.nrrd");
  const ReadPicture without = picture_of({shell, "--no-slices"}, folder, "without.png");
  const ReadPicture region =
      picture_of({shell, "--wall", "region", "--no-slices"}, folder, "r.png");
  const ReadPicture shown =
      picture_of({shell, "--wall", "region", "--show-wall", "--no-slices"}, folder, "shown.png");
  const ReadPicture closed =
      picture_of({shell, "--show-wall", "--no-slices"}, folder, "closed.png");
  // Below a picture with a wall stands its name.
  ASSERT_GE(region.height, without.height);
  int changed = 0;
  for (int y = 0; y < without.height; ++y)
    for (int x = 0; x < without.width; ++x) changed += region.rgb(x, y) != without.rgb(x, y);
  EXPECT_GT(changed, 500) << "the wall is drawn";
  EXPECT_EQ(changed_share(region, shown), 0.0);
  EXPECT_EQ(changed_share(closed, without), 0.0)
      << "the iso-surface is the wall: it is seen already";
}

TEST(EyeBefore, LooksFromWhereItIsAsked) {
  const auto corners_m = straight_box(glm::dvec3(-0.1), glm::dvec3(0.1)).corners();
  const auto direction = [&](const SeenFrom& from) {
    return glm::normalize(eye_before(corners_m, {100, 100}, from).position_m);
  };
  EXPECT_LT(glm::distance(direction({0.0, 0.0, 1.0}), {0.0, 0.0, 1.0}), 1e-12) << "the front";
  EXPECT_LT(glm::distance(direction({90.0, 0.0, 1.0}), {1.0, 0.0, 0.0}), 1e-12) << "the left";
  EXPECT_NEAR(direction({{}, 60.0, 1.0}).y, std::sin(glm::radians(60.0)), 1e-12);
  const Eye near = eye_before(corners_m, {100, 100}, {{}, {}, 2.0});
  const Eye far = eye_before(corners_m, {100, 100});
  EXPECT_EQ(near.position_m, far.position_m);
  EXPECT_NEAR(near.tan_right, 0.5 * far.tan_right, 1e-12);
}

TEST(View, ShadowsDarkenWhatLiesDeepAndChangeNoShape) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const auto drawn = [&](const std::string& shadows) {
    return picture_of({heart, "--no-box", "--background", "none", "--shadows", shadows}, folder,
                      "shadows_" + shadows + ".png");
  };
  const ReadPicture none = drawn("0"), half = drawn("0.5"), all = drawn("1");
  ASSERT_EQ(none.width, 192);
  int darker = 0, covered = 0;
  for (int y = 0; y < none.height; ++y)
    for (int x = 0; x < none.width; ++x) {
      const size_t p = size_t(y) * size_t(none.width) + size_t(x);
      // Opacity has nothing to do with light.
      ASSERT_NEAR(none.pixels[p] >> 24, all.pixels[p] >> 24, 3) << x << ", " << y;
      if (none.pixels[p] >> 24 < 128) continue;
      ++covered;
      darker += all.rgb(x, y).r + 10 < none.rgb(x, y).r;
      ASSERT_LE(all.rgb(x, y).r, none.rgb(x, y).r + 3) << x << ", " << y;
      ASSERT_LE(all.rgb(x, y).r, half.rgb(x, y).r + 3) << x << ", " << y;
    }
  EXPECT_GT(darker, covered / 20);
}

TEST(View, IsTransparentOrLightBehindTheVolume) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const auto alpha = [](const ReadPicture& picture, int x, int y) {
    return picture.pixels[size_t(y) * size_t(picture.width) + size_t(x)] >> 24;
  };
  const ReadPicture dark = picture_of({heart, "--no-box"}, folder, "dark.png");
  const ReadPicture none =
      picture_of({heart, "--no-box", "--background", "none"}, folder, "none.png");
  const ReadPicture light =
      picture_of({heart, "--no-box", "--background", "light"}, folder, "light.png");
  ASSERT_EQ(none.width, 192);
  EXPECT_EQ(alpha(none, 2, 2), 0u);
  EXPECT_EQ(alpha(dark, 2, 2), 255u);
  EXPECT_GT(light.rgb(2, 2).g, 200);
  // Laid over the light ground it is what was drawn on that.
  int covered = 0;
  for (int y = 0; y < none.height; ++y)
    for (int x = 0; x < none.width; ++x) {
      const double share = alpha(none, x, y) / 255.0;
      if (share < 0.5) continue;
      ++covered;
      for (int c = 0; c < 3; ++c) {
        const double own = linear_from_srgb(none.rgb(x, y)[c] / 255.0 / share);
        const double ground = linear_from_srgb(light.rgb(2, y)[c] / 255.0);
        ASSERT_NEAR(linear_from_srgb(light.rgb(x, y)[c] / 255.0),
                    share * own + (1.0 - share) * ground, 0.03)
            << x << ", " << y;
      }
    }
  EXPECT_GT(covered, 1000);
}

TEST(View, PutsTheEyesTogetherAsAsked) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const auto drawn = [&](const std::string& how) {
    return picture_of({heart, "--stereo", how}, folder, how + ".png");
  };
  const ReadPicture parallel = drawn("parallel"), crossed = drawn("crossed");
  ASSERT_EQ(parallel.width, 2 * 192);
  ASSERT_EQ(crossed.width, 2 * 192);
  int differs = 0;
  for (int y = 0; y < 192; ++y)
    for (int x = 0; x < 192; ++x) {
      ASSERT_EQ(parallel.rgb(x, y), crossed.rgb(x + 192, y));
      ASSERT_EQ(parallel.rgb(x + 192, y), crossed.rgb(x, y));
      differs += parallel.rgb(x, y) != parallel.rgb(x + 192, y);
    }
  EXPECT_GT(differs, 1000);
  EXPECT_EQ(drawn("anaglyph").width, 192);
  EXPECT_EQ(drawn("mono").width, 192);
}

TEST(View, WritesAFilm) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const std::vector<std::string> view = {"view", heart, "--picture-size", "64", "--seconds", "0.2"};
  const auto film = [&](const std::string& name) {
    std::vector<std::string> words = view;
    words.insert(words.end(), {"--film", folder / name});
    return run(words);
  };
  EXPECT_THAT(film("beat.avi").err, HasSubstr("it ends in .webm, .mp4 or .gif"));
  // Without ffmpeg: its name is looked up on PATH.
  const std::string path = std::getenv("PATH");
  setenv("PATH", folder.path().c_str(), 1);
  const Outcome lacks = film("beat.gif");
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(lacks.err, HasSubstr("install the package ffmpeg"));
  EXPECT_FALSE(fs::exists(folder / "beat.gif"));
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "ffmpeg is missing";
  const Outcome outcome = film("beat.gif");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("0.2 s, 25 pictures a second"));
  std::ifstream stream(folder / "beat.gif", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  ASSERT_GT(bytes.size(), 1000u);
  EXPECT_EQ(bytes.substr(0, 6), "GIF89a");
  EXPECT_EQ(uint8_t(bytes[6]) + 256 * uint8_t(bytes[7]), 64) << "width";
  const auto height_of = [](const std::string& gif) {
    return uint8_t(gif.at(8)) + 256 * uint8_t(gif.at(9));
  };
  EXPECT_EQ(height_of(bytes), 64) << "there is no room for a bar of frames";
  // One control extension for each picture.
  size_t pictures = 0;
  for (size_t at = bytes.find("\x21\xf9\x04"); at != std::string::npos;
       at = bytes.find("\x21\xf9\x04", at + 1))
    ++pictures;
  EXPECT_EQ(pictures, 5u);
  // Where there is room the bar of frames stands below.
  const Outcome larger = run({"view", heart, "--picture-size", "256", "--seconds", "0.1",
                              "--no-slices", "--film", folder / "bar.gif"});
  ASSERT_EQ(larger.exit_code, 0) << larger.err;
  std::ifstream with_bar(folder / "bar.gif", std::ios::binary);
  EXPECT_GT(height_of({std::istreambuf_iterator<char>(with_bar), {}}), 256 + 20);
}

TEST(View, ShowsTheSameCycleAgainInAFilm) {
  NEEDS_DEVICE();
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "ffmpeg is missing";
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(5), folder / "heart.seq.nrrd");
  // 5 frames in 0.41 s: 10.25 pictures of 25 a second would not be whole ones.
  const auto pictures_of = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"view", heart,       "--fps", "12.195122", "--picture-size",
                                   "64",   "--seconds", "0.82",  "--film",    folder / "beat.gif"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("0.8 s, 24.39 pictures a second"));
    const std::string raw = folder / "raw";
    EXPECT_EQ(std::system(("ffmpeg -loglevel error -y -i " + std::string(folder / "beat.gif") +
                           " -vsync 0 -f rawvideo -pix_fmt rgb24 " + raw)
                              .c_str()),
              0);
    std::ifstream stream(raw, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(stream)), {});
    fs::remove(folder / "beat.gif");
    std::vector<std::string> pictures;
    for (size_t at = 0; at + 64 * 64 * 3 <= bytes.size(); at += 64 * 64 * 3)
      pictures.push_back(bytes.substr(at, 64 * 64 * 3));
    return pictures;
  };
  const std::vector<std::string> beats = pictures_of({"--no-slices"});
  ASSERT_EQ(beats.size(), 20u);
  int moved = 0;
  for (size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(beats[k], beats[k + 10]) << k;
    moved += beats[k] != beats[(k + 5) % 10];
  }
  EXPECT_GT(moved, 7);
  // While the view turns no picture is like another one.
  const std::vector<std::string> turning = pictures_of({"--no-slices", "--turn", "90"});
  ASSERT_EQ(turning.size(), 20u);
  for (size_t k = 0; k < 10; ++k) EXPECT_NE(turning[k], turning[k + 10]) << k;
}

TEST(View, CutsTheBreathingChestOpen) {
  NEEDS_DEVICE();
  const fs::path lung = fs::path(PALPATE_SHARED_DATA) / "lung" / "breathing.seq.nrrd";
  if (!fs::exists(lung)) GTEST_SKIP() << lung << " is missing";
  const TemporaryFolder folder;
  const ReadPicture whole = picture_of({lung}, folder, "whole.png");
  const ReadPicture open = picture_of({lung, "--cut-open"}, folder, "open.png");
  EXPECT_GT(red_share(open), 0.05) << "the box is empty";
  EXPECT_GT(changed_share(whole, open), 0.03) << "the cut is not visible";
}

TEST(View, WritesEveryFrameOfASequenceForTwoEyes) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string shell = written(small_heart(3), folder / "beat.seq.nrrd");
  const Outcome outcome =
      run({"view", shell, "--headless", folder / "pictures", "--picture-size", "128"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (int k = 0; k < 3; ++k) {
    const ReadPicture picture = read_png(folder / ("pictures/frame_" + std::to_string(k) + ".png"));
    EXPECT_EQ(picture.width, 256) << k;
    EXPECT_EQ(picture.height, 128 + 26) << k << ": a line below names the eyes";
  }
  EXPECT_FALSE(fs::exists(folder / "pictures/frame_3.png"));
}

TEST(View, ShowsAFieldAndVolumesOfOtherGridsTogether) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Grid grid = heart_grid(24);
  Field flow = still_field(grid);
  for (glm::vec3& v : flow.u_mm) v = {0.0F, 0.0F, 10.0F};
  const std::string field = written(flow, folder / "u.mha");
  const ReadPicture alone = picture_of({field, "--no-box"}, folder, "field.png");
  double coloured = 0.0;
  for (int y = 0; y < alone.height; ++y)
    for (int x = 0; x < alone.width; ++x) coloured += alone.colored(x, y);
  EXPECT_GT(coloured, 200.0) << "no stream tubes";
  const std::string a = written(shell_phantom(32, 1).frames[0], folder / "a.mha");
  const std::string b = written(shell_phantom(24, 1).frames[0], folder / "b.nii.gz");
  const ReadPicture one = picture_of({a}, folder, "one.png");
  const ReadPicture both = picture_of({a, field}, folder, "both.png");
  EXPECT_GT(changed_share(one, both), 0.01) << "the field is not shown beside the volume";
  picture_of({a, b}, folder, "grids.png");
}

TEST(View, OfAFileDoesNotDependOnItsName) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Volume frame = small_heart().frames[0];
  const std::string heart = written(frame, folder / "heart.mha"),
                    knee = written(frame, folder / "knee.mha");
  const ReadPicture one = picture_of({heart}, folder, "heart.png"),
                    other = picture_of({knee}, folder, "knee.png");
  EXPECT_EQ(changed_share(one, other), 0.0);
  EXPECT_GT(red_share(one), 0.02);
}

TEST(View, OfNothingIsAnErrorAndLevelAndWidthDecide) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string frame = written(small_heart().frames[0], folder / "frame.mha");
  const std::string picture = folder / "nothing.png";
  const Outcome nothing = run({"view", frame, "--look", "CT bone", "--look-level", "9000",
                               "--look-width", "100", "--picture", picture});
  EXPECT_EQ(nothing.exit_code, 2) << nothing.out;
  EXPECT_THAT(nothing.err, HasSubstr("Nothing of frame would be seen: its values are"));
  EXPECT_FALSE(fs::exists(picture));
  const ReadPicture soft = picture_of({frame, "--look-width", "3000"}, folder, "soft.png"),
                    hard = picture_of({frame, "--look-width", "300"}, folder, "hard.png");
  EXPECT_GT(changed_share(soft, hard), 0.02);
}

TEST(View, SaysInOneSentenceWhatIsWrong) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const TemporaryFolder folder;
  const std::string a = written(shell_phantom(16, 1).frames[0], folder / "a.mha");
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"view", a, "--headset", "off"}, "--picture FILE.png"},
      {{"view", "nothing.mha", "--picture", folder / "x.png"}, "'nothing.mha' does not exist"},
      {{"view", a, "nothing.mha", "--picture", folder / "x.png"}, "'nothing.mha' does not exist"},
      {{"view", a, "--picture", folder / "x.png", "--frame", "1"}, "There is no frame 1"},
      {{"view", a, "--picture", folder / "x.png", "--look", "odd"}, "'odd' is not known"},
      {{"view", a, "--picture", "/nowhere/x.png"}, "/nowhere/x.png"},
      {{"view", a, "--headless", folder / "a.mha/pictures", "--gpu", "abacus"}, "a.mha"},
  };
  for (const auto& [arguments, sentence] : cases) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    EXPECT_THAT(outcome.err, HasSubstr(sentence));
  }
  EXPECT_FALSE(fs::exists(folder / "x.png"));
}

/// Share of the pixels that are much more blue than red.
double blue_share(const ReadPicture& picture) {
  double blue = 0.0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const glm::ivec3 c = picture.rgb(x, y);
      blue += c.b > c.r + 60;
    }
  return blue / std::max(1, picture.width * picture.height);
}

TEST(View, AnX3dStyleColoursItsVolumeWhateverTheFileSaysOfItsSize) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Volume heart = small_heart(2).frames[0];
  heart.grid.spacing_mm = glm::dvec3(1.0);
  written(heart, folder / "heart.nrrd");
  heart.grid.spacing_mm = glm::dvec3(0.25);
  written(heart, folder / "small.nrrd");
  const auto drawn = [&](const std::string& file, const char* last_texel) {
    std::ofstream(folder / "scene.x3d")
        << "<X3D><Scene><VolumeData dimensions='0.1 0.1 0.1'><OpacityMapVolumeStyle><PixelTexture "
           "image='3 1 4 0 0 "
        << last_texel << "'/></OpacityMapVolumeStyle><ImageTexture3D url='" << file
        << "'/></VolumeData></Scene></X3D>";
    return picture_of({folder / "scene.x3d"}, folder, "picture.png");
  };
  const ReadPicture red = drawn("heart.nrrd", "0xFF000020");
  EXPECT_GT(red_share(red), 0.02);
  EXPECT_LT(blue_share(red), 0.001);
  const ReadPicture blue = drawn("heart.nrrd", "0x0000FF20");
  EXPECT_GT(blue_share(blue), 0.02);
  // The opacity is that of a sample, whatever the distance between samples.
  EXPECT_LT(changed_share(blue, drawn("small.nrrd", "0x0000FF20")), 0.002);
  const ReadPicture opaque = drawn("heart.nrrd", "0x0000FFFF");
  EXPECT_LT(changed_share(opaque, drawn("small.nrrd", "0x0000FFFF")), 0.002);
}

}  // namespace
}  // namespace palpate::app
