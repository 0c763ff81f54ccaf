// `palpate phantom` in all its forms, and how a sequence without times is played at every door.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/app/program.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kAssumed =
    "The times of the frames of frames are not known: all 4 are played in 1 s; --fps says "
    "otherwise.";

/// A small beating shell as a file, as a file for each frame, and as a DICOM series.
class PhantomTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Outcome made = run({"phantom", "shell", "--size", "16", "-o", whole_, "--frame-files",
                              frames_, "--dicom", series_, "--truth", folder_ / "truth"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_THAT(made.out, AllOf(HasSubstr("Wrote     " + whole_ + "\n"),
                                HasSubstr(frames_ + ": each frame as a file"),
                                HasSubstr(series_ + ": a DICOM series")));
  }
  TemporaryFolder folder_;
  const std::string whole_ = folder_ / "whole.seq.nrrd", frames_ = folder_ / "frames",
                    series_ = folder_ / "series";
};

TEST_F(PhantomTest, HasTheSameFramesInEveryForm) {
  const Outcome read = run({"info", "--json", whole_, frames_, series_});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  const nlohmann::json json = read.json();
  ASSERT_EQ(json["grids"].size(), 2U);
  for (const auto& with_first : json["grids"]) EXPECT_TRUE(with_first["same_grid"]);
  for (const auto& file : json["files"]) {
    EXPECT_EQ(file["frames"], 4) << file;
    EXPECT_NEAR(file["values"]["mean"], double(json["files"][0]["values"]["mean"]), 0.05);
  }
  EXPECT_EQ(json["files"][0]["times_s"], json["files"][2]["times_s"]);
  EXPECT_FALSE(json["files"][1].contains("times_s"));
  EXPECT_TRUE(fs::exists(folder_ / "truth/truth_0_to_1.mha"));
  const Outcome nothing = run({"phantom", "shell"});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("give --output, --frame-files or --dicom"));
}

TEST_F(PhantomTest, IsPlayedInASecondWhereNobodyKnowsItsTimes) {
  const Outcome plan = run({"plan", frames_});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, AllOf(HasSubstr(kAssumed), HasSubstr("frames     4 in 1 s")));
  EXPECT_THAT(run({"info", frames_}).out, HasSubstr("not known: all frames are played in 1 s"));
  const Outcome asked = run({"plan", frames_, "--fps", "2"});
  EXPECT_THAT(asked.out, AllOf(HasSubstr("frames     4 in 2 s"), Not(HasSubstr("times of"))));
  // A heart that beats so slowly has wrong times.
  EXPECT_THAT(run({"plan", frames_, "--fps", "0.1"}).out,
              HasSubstr("One cycle of frames takes 40 s, 1.5 a minute"));
  for (const std::string& known : {whole_, series_})
    EXPECT_THAT(run({"plan", known}).out,
                AllOf(HasSubstr("frames     4 in 1 s"), Not(HasSubstr("times of"))));
  const Outcome felt =
      run({"feel", frames_, "--device", "simulated", "--watchdog", "1000", "--no-motion",
           "--seconds", "0.2", "--headset", "off", "--black-box", folder_ / "."});
  EXPECT_EQ(felt.exit_code, 0) << felt.err;
  EXPECT_THAT(felt.out, AllOf(HasSubstr("Volume    frames: 4 frames in 1 s"), HasSubstr(kAssumed)));
  // In a scene file it is the scene's own key that says otherwise.
  files::write_bytes(folder_ / "scene.json",
                     R"({"volumes": [{"name": "ball", "files": "frames"}],
                         "modes": [{"volume": "ball", "strength": 2}]})");
  const Outcome scene = run({"plan", folder_ / "scene.json"});
  ASSERT_EQ(scene.exit_code, 0) << scene.err;
  EXPECT_THAT(scene.out,
              HasSubstr("The times of the frames of ball are not known: all 4 are played "
                        "in 1 s; frames_per_second in the scene says otherwise."));
}

TEST_F(PhantomTest, HasAMotionAtTheSamePace) {
  NEEDS_DEVICE();
  for (const std::string& pace : {std::string(), std::string("8")}) {
    const fs::path fields = folder_ / ("fields" + pace);
    std::vector<std::string> motion = {"motion",   frames_, "-o",       fields.string(),
                                       "--preset", "fast",  "--cyclic", "--no-verdict"};
    if (!pace.empty()) motion.insert(motion.end(), {"--fps", pace});
    const Outcome found = run(motion);
    ASSERT_EQ(found.exit_code, 0) << found.err;
    const Outcome plan = run({"plan", frames_, "--fields", fields.string()});
    if (pace.empty()) {
      EXPECT_THAT(found.out, HasSubstr("all 4 are said to be in 1 s; --fps says otherwise."));
      EXPECT_THAT(plan.out, AllOf(HasSubstr("frames     4 in 1 s"), HasSubstr(kAssumed)));
    } else {
      EXPECT_THAT(found.out, AllOf(HasSubstr("0.125 s apart"), Not(HasSubstr("not known"))));
      EXPECT_THAT(plan.out, AllOf(HasSubstr("frames     4 in 0.5 s"), Not(HasSubstr("times of"))));
    }
  }
}

}  // namespace
}  // namespace palpate::app
