#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include "integration/charts/charts.h"
#include "integration/charts/figures.h"
#include "tests/charts/picture_file.h"

namespace palpate::charts {
namespace {

using testing::HasSubstr;

Volume ball(const Grid& grid, double radius_mm) {
  return filled_volume(grid, [&](glm::dvec3 x) { return glm::length(x) < radius_mm ? 1.f : 0.f; });
}

Field growth(const Grid& grid, double share) {
  return filled_field(grid, [&](glm::dvec3 x) { return share * x; });
}

Confidence full_confidence(const Grid& grid) {
  return {grid, std::vector<float>(grid.count(), 1.0f)};
}

// Both pages of one pair, with all columns; each must be written and must be a valid picture.
void expect_all_pictures(const Volume& fixed, const Volume& moving, const Field& field) {
  const ScratchFile file("all.png");
  const Confidence sure = full_confidence(field.grid);
  const Mask mask{fixed.grid, std::vector<uint8_t>(fixed.grid.count(), 1)};
  const Caption caption{"A title", "and numbers"};
  const PairPicture pair{&fixed, &moving, &field, &field, &sure, &mask};
  const std::vector<SequenceStep> moments = {{&fixed, &field, "frame 0", "t = 0 s"},
                                             {&moving, nullptr, "frame 1", ""}};
  const auto expect_written = [&](const Status& written, const char* what) {
    ASSERT_TRUE(written) << what << ": " << written.error().message;
    EXPECT_GT(read_png(file.path()).width, 200) << what;
    std::filesystem::remove(file.path());
  };
  expect_written(write_pair_overview(file.path(), pair, caption), "overview");
  expect_written(write_sequence_strip(file.path(), moments, caption), "strip");
}

TEST(Pictures, AreWrittenForAPairOnACoarserFieldGrid) {
  const Grid grid = centred_grid({24, 20, 16}, {2.0, 2.0, 3.0});
  expect_all_pictures(ball(grid, 12), ball(grid, 15), growth(coarsened(grid, glm::ivec3(4)), 0.2));
}

TEST(Pictures, AreWrittenForAllZeroVolumes) {
  const Grid grid = centred_grid({16, 16, 16}, glm::dvec3(1.0));
  const Volume zero = filled_volume(grid, [](glm::dvec3) { return 0.0f; });
  expect_all_pictures(zero, zero, still_field(grid));
}

TEST(Pictures, AreWrittenForConstantVolumes) {
  const Grid grid = centred_grid({16, 12, 8}, glm::dvec3(1.0));
  const Volume same = filled_volume(grid, [](glm::dvec3) { return -1024.0f; });
  expect_all_pictures(same, same, growth(grid, 0.1));
}

TEST(Pictures, AreWrittenForOneSlice) {
  const Grid grid = centred_grid({32, 24, 1}, glm::dvec3(1.5));
  expect_all_pictures(ball(grid, 8), ball(grid, 10), growth(grid, 0.2));
}

TEST(Pictures, AreWrittenForOneVoxel) {
  const Grid grid = centred_grid({1, 1, 1}, glm::dvec3(1.0));
  expect_all_pictures(ball(grid, 8), ball(grid, 8), growth(grid, 0.2));
}

TEST(Pictures, AreWrittenForNotANumber) {
  const Grid grid = centred_grid({16, 16, 16}, glm::dvec3(1.0));
  Volume broken = ball(grid, 5);
  broken.values[100] = std::numeric_limits<float>::quiet_NaN();
  broken.values[200] = std::numeric_limits<float>::infinity();
  Field field = growth(grid, 0.1);
  field.u_mm[300] = glm::vec3(std::numeric_limits<float>::quiet_NaN());
  field.u_mm[400] = glm::vec3(std::numeric_limits<float>::infinity());
  expect_all_pictures(broken, ball(grid, 6), field);
}

class PairPictures : public testing::Test {
 protected:
  const Grid grid_ = centred_grid({24, 24, 24}, glm::dvec3(2.0));
  const Volume fixed_ = ball(grid_, 12);
  const Volume moving_ = ball(grid_, 15);
  const Field field_ = growth(grid_, 0.2);
};

TEST_F(PairPictures, AreTheSameEveryTime) {
  const ScratchFile one("one.png");
  const ScratchFile two("two.png");
  const PairPicture pair{&fixed_, &moving_, &field_, nullptr, nullptr, nullptr};
  ASSERT_TRUE(write_pair_overview(one.path(), pair, {"Title", ""}));
  ASSERT_TRUE(write_pair_overview(two.path(), pair, {"Title", ""}));
  EXPECT_EQ(read_png(one.path()).pixels, read_png(two.path()).pixels);
}

TEST_F(PairPictures, DifferForDifferentFields) {
  const ScratchFile one("one.png");
  const ScratchFile two("two.png");
  const Field other = growth(grid_, 0.19);
  ASSERT_TRUE(write_pair_overview(one.path(), {&fixed_, &moving_, &field_}, {"Title", ""}));
  ASSERT_TRUE(write_pair_overview(two.path(), {&fixed_, &moving_, &other}, {"Title", ""}));
  EXPECT_NE(read_png(one.path()).pixels, read_png(two.path()).pixels);
}

TEST_F(PairPictures, GrowByAColumnForTruthAndForConfidence) {
  const ScratchFile file("columns.png");
  const Confidence sure = full_confidence(grid_);
  PairPicture pair{&fixed_, &moving_, &field_, nullptr, nullptr, nullptr};
  std::vector<int> widths;
  for (int columns = 0; columns < 3; ++columns) {
    if (columns == 1) pair.truth = &field_;
    if (columns == 2) pair.confidence = &sure;
    ASSERT_TRUE(write_pair_overview(file.path(), pair, {"Title", ""}));
    widths.push_back(read_png(file.path()).width);
  }
  EXPECT_GT(widths[1], widths[0] + 200);
  EXPECT_GT(widths[2], widths[1] + 200);
}

TEST_F(PairPictures, ShowAFoldInRedAndNoneWhereThereIsNone) {
  const ScratchFile file("fold.png");
  const auto red_pixels = [&] {
    const ReadPicture picture = read_png(file.path());
    int red = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const glm::ivec3 c = picture.rgb(x, y);
        if (c.x > 190 && c.y < 60 && c.z < 60) ++red;
      }
    }
    return red;
  };
  // Frames of one value: no colours of a difference beside the lattice's.
  const Volume same = filled_volume(grid_, [](glm::dvec3) { return 1.0f; });
  ASSERT_TRUE(write_pair_overview(file.path(), {&same, &same, &field_}, {"Title", ""}));
  EXPECT_EQ(red_pixels(), 0);
  // x - 1.5 x inverts every axis: det = -0.125.
  const Field inverted = growth(grid_, -1.5);
  ASSERT_TRUE(write_pair_overview(file.path(), {&same, &same, &inverted}, {"Title", ""}));
  EXPECT_GT(red_pixels(), 1000);
}

TEST_F(PairPictures, StripGrowsWithItsFramesButNotBeyondTwelve) {
  const ScratchFile file("strip.png");
  std::vector<int> heights;
  for (const size_t count : {2, 4, 12, 40}) {
    const std::vector<SequenceStep> moments(count, SequenceStep{&fixed_, &field_, "frame", ""});
    ASSERT_TRUE(write_sequence_strip(file.path(), moments, {"Title", ""}));
    heights.push_back(read_png(file.path()).height);
  }
  EXPECT_GT(heights[1], heights[0]);
  EXPECT_GT(heights[2], heights[1]);
  EXPECT_EQ(heights[3], heights[2]);
}

TEST_F(PairPictures, FocusIsWhereTheMotionIs) {
  const glm::dvec3 place(10.0, -6.0, 4.0);
  const Field local = filled_field(grid_, [&](glm::dvec3 x) {
    const glm::dvec3 r = x - place;
    return glm::dvec3(5.0, 0.0, 0.0) * std::exp(-0.5 * glm::dot(r, r) / 9.0);
  });
  // The bump is well inside, so that its mean is its middle, except for the sampling at 2 mm.
  EXPECT_LT(glm::length(focus_of(local) - place), 0.2);
  EXPECT_LT(glm::length(focus_of(still_field(grid_))), 1e-9);
}

TEST_F(PairPictures, RefuseAVolumeThatDoesNotFillItsGrid) {
  const ScratchFile file("short.png");
  Volume cut = fixed_;
  cut.values.pop_back();
  const auto written = write_pair_overview(file.path(), {&cut, &moving_, &field_}, {"Title", ""});
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(written.error().message, HasSubstr("the fixed frame has 13823 samples"));
  EXPECT_FALSE(std::filesystem::exists(file.path()));
}

TEST_F(PairPictures, RefuseAPairWithoutAField) {
  const ScratchFile file("none.png");
  const auto written = write_pair_overview(file.path(), {&fixed_, &moving_}, {"Title", ""});
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::kBadInput);
  EXPECT_FALSE(std::filesystem::exists(file.path()));
}

TEST_F(PairPictures, RefuseAnEmptySequence) {
  const auto written = write_sequence_strip("nowhere.png", {}, {"Title", ""});
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("no frame"));
}

TEST_F(PairPictures, SayWhenTheyCanNotBeWritten) {
  const std::string path = "/nowhere-at-all/picture.png";
  const auto written = write_sequence_strip(path, {{&fixed_}}, {"Title", ""});
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::kBadOutput);
  EXPECT_THAT(written.error().message, HasSubstr(path));
}

TEST_F(PairPictures, LeaveNothingBehindWhenTheDiskIsFull) {
  // /dev/full simulates a full disk: every write fails, opening does not.
  const ScratchFile link("full.png");
  const std::string partial = link.path() + ".partial-" + std::to_string(::getpid());
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  std::filesystem::create_symlink("/dev/full", partial);
  std::ofstream(link.path()) << "older";
  const auto written = write_sequence_strip(link.path(), {{&fixed_}}, {"Title", ""});
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::kBadOutput);
  EXPECT_THAT(written.error().message, HasSubstr("No space left"));
  EXPECT_FALSE(std::filesystem::is_symlink(partial));
  std::ifstream old(link.path());
  std::string text;
  old >> text;
  EXPECT_EQ(text, "older");
}

}  // namespace
}  // namespace palpate::charts
