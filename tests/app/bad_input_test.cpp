// Errors of a user: exit status 2, one sentence that names the file, and no file changed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// One sentence of the program that contains these words, and no result.
void expect_refused(const Outcome& result, const std::vector<std::string>& words) {
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, StartsWith("palpate: "));
  EXPECT_THAT(result.err, EndsWith(".\n"));
  for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word));
}

TEST(MotionCommand, NamesTheFileThatIsMissing) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2).frames[0], folder / "fixed.mha");
  const auto result = run({"motion", heart, folder / "absent.mha", "-o", folder / "u.mha"});
  expect_refused(result, {"absent.mha"});
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionCommand, RefusesATruncatedFile) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  std::filesystem::resize_file(heart, std::filesystem::file_size(heart) / 2);
  expect_refused(run({"motion", heart, "-o", folder / "out"}), {"heart.seq.nrrd"});
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionCommand, LeavesOldResultsAloneWhenTheLastFrameIsDamaged) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Sequence damaged = small_heart(3);
  damaged.frames[2].values[100] = std::numeric_limits<float>::quiet_NaN();
  const std::string heart = written(damaged, folder / "heart.seq.nrrd");
  std::filesystem::create_directory(folder / "out");
  files::write_bytes(folder / "out/motion_0_to_1.mha", "yesterday's");
  expect_refused(run({"motion", heart, "-o", folder / "out"}), {"heart.seq.nrrd", "frame 2"});
  EXPECT_EQ(files::read_bytes(folder / "out/motion_0_to_1.mha"), "yesterday's");
  size_t entries = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / "out"))
    ++entries;
  EXPECT_EQ(entries, 1U);
}

TEST(MotionCommand, ReplacesNaNWhereItIsAskedForAndMasksIt) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart(2);
  const Grid& grid = heart.frames[0].grid;
  Volume fixed = heart.frames[0], moving = heart.frames[1];
  Mask body{grid, std::vector<uint8_t>(grid.count(), 1)};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < 9; ++i) {
        body.values[grid.offset(i, j, k)] = 0;
        fixed.values[grid.offset(i, j, k)] = moving.values[grid.offset(i, j, k)] = 5.0F;
      }
  const std::string clean_fixed = written(fixed, folder / "clean_fixed.nii"),
                    clean_moving = written(moving, folder / "clean_moving.nii"),
                    mask = folder / "mask.nii";
  ASSERT_TRUE(files::write_mask(body, mask));
  for (size_t v = 0; v < body.values.size(); ++v)
    if (body.values[v] == 0)
      fixed.values[v] = moving.values[v] = std::numeric_limits<float>::quiet_NaN();
  const std::string nan_fixed = written(fixed, folder / "fixed.nii"),
                    nan_moving = written(moving, folder / "moving.nii");
  // Refused without the option, which the sentence names.
  expect_refused(run({"motion", nan_fixed, nan_moving, "-o", folder / "u.nii"}),
                 {"fixed.nii", "not finite", "--nan-as"});
  // With it the field is that of the mask.
  const Outcome with =
                    run({"motion", nan_fixed, nan_moving, "-o", folder / "u.nii", "--nan-as", "5"}),
                masked = run(
                    {"motion", clean_fixed, clean_moving, "-o", folder / "v.nii", "--mask", mask});
  ASSERT_EQ(with.exit_code, masked.exit_code) << with.err << masked.err;
  EXPECT_THAT(with.out, HasSubstr("NaN became 5"));
  EXPECT_EQ(files::read_bytes(folder / "u.nii"), files::read_bytes(folder / "v.nii"));
  // check and view take it too.
  const Outcome checked = run({"check", folder / "u.nii", "--fixed", nan_fixed, "--moving",
                               nan_moving, "--nan-as", "5", "--json"}),
                wanted = run({"check", folder / "v.nii", "--fixed", clean_fixed, "--moving",
                              clean_moving, "--mask", mask, "--json"});
  ASSERT_EQ(checked.exit_code, wanted.exit_code) << checked.err;
  EXPECT_EQ(checked.json()["match"], wanted.json()["match"]);
  expect_refused(run({"plan", nan_fixed}), {"--nan-as"});
  EXPECT_EQ(run({"plan", nan_fixed, "--nan-as", "5"}).exit_code, 0);
}

TEST(MotionCommand, SaysHowFarApartFramesAreThatDoNotOverlap) {
  const TemporaryFolder folder;
  const Volume frame = small_heart(2).frames[0];
  const std::string fixed = written(frame, folder / "fixed.mha");
  Volume away = frame;
  const double length_mm = frame.grid.size.x * frame.grid.spacing_mm.x;
  away.grid.origin_mm.x += length_mm + 500.0;
  const std::string moving = written(away, folder / "moving.mha");
  const std::vector<std::string> words = {"fixed.mha", "moving.mha", "do not overlap",
                                          "500 mm apart"};
  expect_refused(run({"motion", fixed, moving, "-o", folder / "u.mha"}), words);
  EXPECT_EQ(folder.entry_count(), 2U);
  const std::string field = written(still_field(frame.grid), folder / "u.mha");
  expect_refused(run({"check", field, "--fixed", fixed, "--moving", moving}), words);
}

TEST(MotionCommand, NeedsMoreThanOneFrame) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2).frames[0], folder / "one.mha");
  expect_refused(run({"motion", heart, "-o", folder / "out"}), {"one.mha", "one frame"});
}

TEST(MotionCommand, SaysWhichFrameOfASequenceHasAnotherSize) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart(3);
  const auto first = written(heart.frames[0], folder / "a.mha");
  const auto second = written(heart.frames[1], folder / "b.mha");
  const auto third = written(shell_phantom(40, 3).frames[2], folder / "c.mha");
  expect_refused(run({"motion", first, second, third, "-o", folder / "out"}), {"c.mha", "frame 2"});
}

TEST(MotionCommand, RefusesAnOutputThatCanNotBeWrittenBeforeItReadsAnything) {
  const TemporaryFolder folder;
  files::write_bytes(folder / "file", "not a folder");
  expect_refused(run({"motion", "absent_a.mha", "absent_b.mha", "-o", folder / "file/u.mha"}),
                 {"u.mha"});
  expect_refused(run({"motion", "absent.seq.nrrd", "-o", folder / "file/out"}), {"file"});
  expect_refused(run({"motion", "absent_a.mha", "absent_b.mha", "-o", folder / "u.tif"}),
                 {"u.tif"});
  expect_refused(run({"motion", "absent.seq.nrrd", "-o", folder / "u.mha"}), {"u.mha", "folder"});
  expect_refused(run({"motion", "a.mha", "b.mha", "-o", folder / "u.mha", "--cyclic"}),
                 {"u.mha", "folder"});
}

TEST(MotionCommand, RefusesAMaskOnAnotherGridAndAnEmptyOne) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const std::string other = written(shell_phantom(40, 2).frames[0], folder / "other.mha");
  expect_refused(run({"motion", heart, "-o", folder / "out", "--mask", other}),
                 {"other.mha", "40 x 40 x 40"});
  Volume nothing = small_heart(2).frames[0];
  std::fill(nothing.values.begin(), nothing.values.end(), 0.0F);
  const std::string empty = written(nothing, folder / "empty.mha");
  expect_refused(run({"motion", heart, "-o", folder / "out", "--mask", empty}), {"empty.mha"});
}

TEST(MotionCommand, NamesThePresetsWhenThereIsNoSuchOne) {
  expect_refused(run({"motion", "a.mha", "b.mha", "-o", "u.mha", "--preset", "turbo"}),
                 {"turbo", "balanced"});
}

TEST(MotionCommand, SaysWhenTheMemoryIsTooSmall) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  expect_refused(run({"motion", heart, "-o", folder / "out", "--memory-cap", "0.1"}), {"memory"});
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionCommand, NamesTheDevicesWhenThereIsNoSuchOne) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  expect_refused(run({"motion", heart, "-o", folder / "out", "--gpu", "abacus"}), {"abacus"});
}

TEST(Program, ExplainsItselfAndRefusesWhatItDoesNotKnow) {
  const Outcome help = run({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* command : {"motion", "check", "devices", "demo", "phantom"})
    EXPECT_THAT(help.out, HasSubstr(command));
  EXPECT_EQ(run({"motion", "--help"}).exit_code, 0);
  EXPECT_THAT(run({"--version"}).out, StartsWith("palpate "));
  EXPECT_EQ(run({"-V"}).out, run({"--version"}).out);
  expect_refused(run({}), {"--help"});
  expect_refused(run({"knead"}), {"--help"});
  expect_refused(run({"motion", "a.mha", "--fsat"}), {"--help"});
}

}  // namespace
}  // namespace palpate::app
