// The program from files to files, on phantoms whose motion is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "compute/motion/quality.h"
#include "integration/files/read_volume.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

// At 48^3 the wall of the heart is four voxels thick and its texture is under-sampled: fields miss
// it by 0.2 to 0.35 voxel, a field of zeros by 1.8.
constexpr double kSmallHeartVoxels = 0.5;

Field field_in(const std::filesystem::path& path) {
  auto field = files::read_field(path);
  EXPECT_TRUE(field) << (field ? "" : field.error().message);
  return field ? std::move(*field) : Field{};
}

double error_on_the_wall(const Field& field, int fixed, int moving, int frames = 4) {
  const Grid grid = heart_grid(kHeartSize);
  const Mask wall = shell_mask(grid, fixed, frames);
  const auto error = endpoint_error(field, shell_truth(grid, fixed, moving, frames), &wall);
  EXPECT_TRUE(error);
  return error ? error->voxels.mean : 1e9;
}

TEST(MotionOfAPair, IsRightAndKeepsTheGeometryInEveryFormat) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.mha");
  const std::string moving = written(heart.frames[1], folder / "moving.nii.gz");
  for (const char* name : {"u.mha", "u.nrrd", "u.nii.gz"}) {
    const Outcome result = run({"motion", fixed, moving, "-o", folder / name});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("Memory"));
    EXPECT_THAT(result.out, HasSubstr("Verdict   ok"));
    const Field field = field_in(folder / name);
    EXPECT_TRUE(same_geometry(field.grid, heart.frames[0].grid)) << name;
    EXPECT_EQ(folds(field).folded, 0U);
    EXPECT_LT(error_on_the_wall(field, 0, 1), kSmallHeartVoxels) << name;
  }
}

TEST(MotionOfAPair, ComesWithInverseConfidenceAndPicture) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.mha");
  const std::string moving = written(heart.frames[1], folder / "moving.mha");
  const Outcome result = run({"motion", fixed, moving, "-o", folder / "u.mha", "--inverse",
                              "--confidence", "--pictures", "--quiet"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out + result.err, "");
  const Field field = field_in(folder / "u.mha");
  const Field inverse = field_in(folder / "u_inverse.mha");
  const auto consistency = inverse_consistency(field, inverse, field.grid);
  ASSERT_TRUE(consistency);
  // The inverse is solved to a thousandth of a voxel at samples; between them both are trilinear,
  // which over a voxel of 2.7 mm with the curvature of this motion costs a few hundredths.
  EXPECT_LT(consistency->voxels.mean, 0.05);
  const auto confidence = files::read_volume(folder / "u_confidence.mha");
  ASSERT_TRUE(confidence) << confidence.error().message;
  const auto [low, high] =
      std::minmax_element(confidence->values.begin(), confidence->values.end());
  EXPECT_GE(*low, 0.0F);
  EXPECT_LE(*high, 1.0F);
  EXPECT_GT(*high, *low);
  EXPECT_EQ(files::read_bytes(folder / "u.png").substr(1, 3), "PNG");
  EXPECT_EQ(folder.entry_count(), 6U);
}

TEST(MotionOfAPair, ResamplesAMovingVolumeOnAnotherGrid) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string fixed = written(small_heart().frames[0], folder / "fixed.mha");
  const std::string moving = written(shell_phantom(64, 4).frames[1], folder / "moving.mha");
  const Outcome result = run({"motion", fixed, moving, "-o", folder / "u.mha"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_LT(error_on_the_wall(field_in(folder / "u.mha"), 0, 1), kSmallHeartVoxels);
}

TEST(MotionOfASequence, WritesAFieldPerPairAndASummary) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(), folder / "heart.seq.nrrd");
  const Outcome result = run({"motion", heart, "-o", folder / "new/out", "--cyclic", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (int k = 0; k < 4; ++k) {
    const int next = (k + 1) % 4;
    const std::string name = "motion_" + std::to_string(k) + "_to_" + std::to_string(next) + ".mha";
    EXPECT_LT(error_on_the_wall(field_in(folder / "new/out" / name), k, next), kSmallHeartVoxels)
        << name;
  }
  const auto summary = result.json();
  EXPECT_EQ(summary["pairs"].size(), 4U);
  EXPECT_EQ(summary["verdict"]["word"], "ok");
  EXPECT_EQ(summary["pairs"][3]["field"], "motion_3_to_0.mha");
  EXPECT_EQ(summary["pairs"][0]["evidence"]["folds"]["folded"], 0);
  EXPECT_LT(summary["cycle_drift"]["voxels"]["mean"], 0.5);
  EXPECT_EQ(summary, nlohmann::json::parse(std::ifstream(folder / "new/out/summary.json")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "new/out"), {}), 5);
  EXPECT_EQ(folder.entry_count(), 2U);
}

TEST(MotionOfASequence, PadsFrameNumbersAndReplacesOldResults) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(24, 11), folder / "heart.seq.nrrd");
  std::filesystem::create_directory(folder / "out");
  files::write_bytes(folder / "out/motion_00_to_01.nrrd", "old");
  const Outcome result = run({"motion", heart, "-o", folder / "out", "--preset", "fast", "--format",
                              "nrrd", "--coarse", "--no-verdict", "--inverse"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Field field = field_in(folder / "out/motion_00_to_01.nrrd");
  EXPECT_LT(field.grid.size.x, 24);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/motion_09_to_10.nrrd"));
  EXPECT_TRUE(same_geometry(field_in(folder / "out/inverse_10_to_09.nrrd").grid, field.grid));
}

TEST(MotionOfASequence, StopsAtCtrlCWithoutATrace) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(96, 6), folder / "heart.seq.nrrd");
  Program program({"motion", heart, "-o", folder / "out", "--preset", "best"});
  ASSERT_TRUE(program.wait_for("Memory"));
  program.signal(SIGINT);
  const Outcome result = program.wait();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("Stopped"));
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionOfASequence, StopsAtCtrlCWhileFieldsAreAlreadyWaiting) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(64, 12), folder / "heart.seq.nrrd");
  Program program({"motion", heart, "-o", folder / "out"});
  ASSERT_TRUE(program.wait_for("Frame 1 to 2"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait().exit_code, 1);
  EXPECT_EQ(folder.entry_count(), 1U);
}

/// What must never be called ok: the exit code says suspect or failed, and why.
void expect_distrusted(const Volume& fixed, const Volume& moving) {
  const TemporaryFolder folder;
  const Outcome result = run({"motion", written(fixed, folder / "fixed.mha"),
                              written(moving, folder / "moving.mha"), "-o", folder / "u.mha"});
  EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("\n          - "));
  EXPECT_TRUE(std::filesystem::exists(folder / "u.mha"));
}

TEST(Verdict, DistrustsSwappedSubjects) {
  NEEDS_DEVICE();
  Volume other = sliding_phantom(kHeartSize, 5.0).fixed;
  const Volume heart = small_heart().frames[0];
  other.grid = heart.grid;
  expect_distrusted(heart, other);
  expect_distrusted(other, heart);
}

TEST(Verdict, DistrustsAnEmptyFrame) {
  NEEDS_DEVICE();
  const Volume heart = small_heart().frames[0];
  const Volume empty{heart.grid, std::vector<float>(heart.values.size(), 0.0F)};
  expect_distrusted(heart, empty);
  expect_distrusted(empty, heart);
}

TEST(Verdict, DistrustsAShiftByTwentyCentimetres) {
  NEEDS_DEVICE();
  const Sequence heart = small_heart();
  expect_distrusted(heart.frames[0], shifted(heart.frames[1], 200.0));
}

TEST(Verdict, DistrustsASequenceWithAForeignFrame) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Sequence heart = small_heart();
  heart.frames[2].values = sliding_phantom(kHeartSize, 5.0).fixed.values;
  const Outcome result =
      run({"motion", written(heart, folder / "heart.seq.nrrd"), "-o", folder / "out", "--quiet"});
  EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.exit_code;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("Frame 1 to 2: "));
}

TEST(Demo, MakesEstimatesComparesAndDraws) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  for (const auto& [phantom, last] :
       {std::pair("heart", "motion_7_to_0.png"), std::pair("shell", "motion_3_to_0.png")}) {
    const std::string out = folder / phantom;
    const Outcome result = run({"demo", "-o", out, "--phantom", phantom, "--size", "48"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("beat.png"));
    for (const char* name : {"summary.txt", "beat.png", "motion_0_to_1.mha", last})
      EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / name)) << name;
  }
}

}  // namespace
}  // namespace palpate::app
