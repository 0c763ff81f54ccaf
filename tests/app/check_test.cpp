// palpate check, on fields whose measures are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "compute/motion/quality.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

// Floats of positions around 100 mm.
constexpr double kRounding = 1e-4;

/// An anisotropic grid, so that millimetres, the field's voxels and the finest voxels differ.
Grid box() {
  return {{20, 16, 12}, {1.0, 2.0, 4.0}, {0.0, 0.0, 0.0}, glm::dmat3(1.0)};
}

Field translation(const Grid& grid, glm::vec3 u_mm) {
  return {grid, std::vector<glm::vec3>(grid.count(), u_mm)};
}

TEST(CheckCommand, GivesTheEndpointErrorInMillimetresAndBothKindsOfVoxels) {
  const TemporaryFolder folder;
  const auto field = written(translation(box(), {0, 0, 0}), folder / "u.mha");
  const auto truth = written(translation(box(), {0, 3, 4}), folder / "truth.nrrd");
  const Outcome result = run({"check", field, "--truth", truth, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto error = result.json()["endpoint_error"];
  EXPECT_NEAR(error["mm"]["mean"], 5.0, kRounding);
  EXPECT_NEAR(error["voxels"]["max"], 5.0, kRounding);  // of the finest axis, 1 mm
  EXPECT_NEAR(error["voxels_of_each_axis"]["p95"], std::sqrt(1.5 * 1.5 + 1.0), kRounding);
  EXPECT_THAT(run({"check", field, "--truth", truth}).out, HasSubstr("Endpoint error, mm"));
}

TEST(CheckCommand, SaysHowMuchOfTheFieldTheTruthCovers) {
  const TemporaryFolder folder;
  const auto field = written(translation(box(), {0, 0, 0}), folder / "u.mha");
  Grid part = box();
  part.size = {10, 16, 6};
  const auto truth = written(translation(part, {0, 0, 0}), folder / "truth.mha");
  const Outcome quarter = run({"check", field, "--truth", truth, "--json"});
  EXPECT_NEAR(quarter.json()["endpoint_error"]["covered_share"], 0.25, kRounding);
  EXPECT_THAT(run({"check", field, "--truth", truth}).out,
              HasSubstr("the truth: 25.0 % of the field"));
  const auto whole = written(translation(box(), {0, 0, 0}), folder / "whole.mha");
  EXPECT_THAT(run({"check", field, "--truth", whole}).out, testing::Not(HasSubstr("of the field")));
}

TEST(CheckCommand, CountsFolds) {
  const TemporaryFolder folder;
  Field field = translation(box(), {0, 0, 0});
  field.u_mm[field.grid.offset(10, 8, 6)] = {1.5F, 0, 0};  // passes its right neighbour
  const auto json = run({"check", written(field, folder / "u.mha"), "--json"}).json();
  EXPECT_EQ(json["folds"]["folded"], folds(field).folded);
  EXPECT_GE(json["folds"]["folded"], 2);
  EXPECT_NEAR(json["folds"]["min_determinant"], -0.5, kRounding);
}

TEST(CheckCommand, ReadsLandmarksAndFollowedPoints) {
  const TemporaryFolder folder;
  const auto field = written(translation(box(), {1, 0, 0}), folder / "u.mha");
  files::write_bytes(folder / "fixed.csv", "x,y,z\n2,4,8\n5,6,7\n");
  files::write_bytes(folder / "moving.csv", "x,y,z\n3,4,8\n6,6,9\n");
  auto json =
      run({"check", field, "--landmarks", folder / "fixed.csv", folder / "moving.csv", "--json"})
          .json();
  EXPECT_NEAR(json["target_registration_error_mm"]["mean"], 1.0, kRounding);
  EXPECT_NEAR(json["target_registration_error_mm"]["max"], 2.0, kRounding);

  files::write_bytes(folder / "points.csv",
                     "# followed\npoint,x0,y0,z0,x1,y1,z1,x2,y2,z2\n"
                     "0,9,9,9,2,4,8,3,4,8\n1,9,9,9,5,6,7,6,6,9\n");
  json = run({"check", field, "--points", folder / "points.csv", "--frames", "1", "2", "--json"})
             .json();
  EXPECT_NEAR(json["target_registration_error_mm"]["max"], 2.0, kRounding);
  const Outcome absent =
      run({"check", field, "--points", folder / "points.csv", "--frames", "1", "7"});
  EXPECT_EQ(absent.exit_code, 2);
  EXPECT_THAT(absent.err, HasSubstr("x7, y7, z7"));
}

TEST(CheckCommand, GoesThereAndBackAndAroundTheCycle) {
  const TemporaryFolder folder;
  const auto there = written(translation(box(), {1, 0, 0}), folder / "there.mha");
  const auto back = written(translation(box(), {-1, 0.5F, 0}), folder / "back.mha");
  const auto json = run({"check", there, "--against", back, "--cycle", back, "--json"}).json();
  EXPECT_NEAR(json["inverse_consistency"]["everywhere"]["mm"]["mean"], 0.5, kRounding);
  EXPECT_NEAR(json["cycle_drift"]["everywhere"]["mm"]["max"], 0.5, kRounding);
}

TEST(CheckCommand, TakesDistancesInsideTheMask) {
  const TemporaryFolder folder;
  Field truth = translation(box(), {0, 0, 0});
  Volume mask{box(), std::vector<float>(box().count(), 0.0F)};
  truth.u_mm[0] = {3, 0, 0};
  mask.values[0] = mask.values[1] = 1.0F;
  const auto json = run({"check", written(translation(box(), {0, 0, 0}), folder / "u.mha"),
                         "--truth", written(truth, folder / "truth.mha"), "--mask",
                         written(mask, folder / "mask.nrrd"), "--json"})
                        .json();
  EXPECT_EQ(json["endpoint_error"]["mm"]["count"], 2);
  EXPECT_NEAR(json["endpoint_error"]["mm"]["mean"], 1.5, kRounding);
}

TEST(CheckCommand, TrustsTheTruthAndNotStillness) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const Grid& grid = heart.frames[0].grid;
  const auto fixed = written(heart.frames[0], folder / "fixed.mha");
  const auto moving = written(heart.frames[1], folder / "moving.mha");
  const auto truth = written(shell_truth(grid, 0, 1), folder / "truth.mha");
  const auto still = written(still_field(grid), folder / "still.mha");
  const Outcome good = run({"check", truth, "--fixed", fixed, "--moving", moving, "--opencv"});
  EXPECT_EQ(good.exit_code, 0) << good.out;
  EXPECT_THAT(good.out, HasSubstr("OpenCV: "));
  const Outcome bad = run({"check", still, "--fixed", fixed, "--moving", moving, "--json"});
  EXPECT_NE(bad.exit_code, 0);
  EXPECT_NE(bad.json()["verdict"]["word"], "ok");
  EXPECT_FALSE(bad.json()["verdict"]["reasons"].empty());
}

TEST(CheckCommand, RefusesWhatIsNoFieldAndHalfAPair) {
  const TemporaryFolder folder;
  const auto image = written(small_heart(2).frames[0], folder / "image.mha");
  const Outcome no_field = run({"check", image});
  EXPECT_EQ(no_field.exit_code, 2);
  EXPECT_THAT(no_field.err, HasSubstr("image.mha"));
  const auto field = written(translation(box(), {0, 0, 0}), folder / "u.mha");
  const Outcome half = run({"check", field, "--fixed", image});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_THAT(half.err, HasSubstr("--moving"));
}

TEST(PhantomCommand, WritesTheSequenceAndItsTruth) {
  const TemporaryFolder folder;
  const Outcome made = run({"phantom", "heart", "-o", folder / "heart.seq.nrrd", "--size", "32",
                            "--frames", "3", "--truth", folder / "truth"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const auto json =
      run({"check", folder / "truth/truth_0_to_1.mha", "--cycle", folder / "truth/truth_1_to_2.mha",
           folder / "truth/truth_2_to_0.mha", "--mask", folder / "truth/wall_0.mha", "--json"})
          .json();
  // The error of trilinear interpolation between samples of 4 mm, for fields that change over 20
  // mm.
  EXPECT_LT(json["cycle_drift"]["everywhere"]["mm"]["max"], 0.3);
  EXPECT_GT(json["motion_mm"]["max"], 1.0);
  EXPECT_EQ(
      run({"phantom", "sliding", "-o", folder / "s.seq.nrrd", "--size", "48", "--shift", "40"})
          .exit_code,
      2);
}

TEST(DevicesCommand, NamesADefaultOrSaysWhyThereIsNone) {
  const Outcome table = run({"devices"});
  const Outcome json = run({"devices", "--json"});
  EXPECT_EQ(table.exit_code, json.exit_code);
  size_t defaults = 0;
  const nlohmann::json listed = json.json();
  for (const auto& device : listed["vulkan"]) defaults += device["default"] == true;
  EXPECT_EQ(defaults, json.exit_code == 0 ? 1U : 0U);
  if (json.exit_code != 0) {
    EXPECT_THAT(table.err, HasSubstr("Vulkan"));
  }
}

TEST(DevicesCommand, ListsASimulatedHandEverywhere) {
  EXPECT_THAT(run({"devices"}).out, HasSubstr("simulated"));
  const auto json = run({"devices", "--json"}).json();
  ASSERT_FALSE(json["hands"].empty());
  const auto& last = json["hands"].back();
  EXPECT_EQ(last["kind"], "simulated");
  EXPECT_EQ(last["usable"], true);
  EXPECT_GT(last["max_force_n"], 0.0);
}

}  // namespace
}  // namespace palpate::app
