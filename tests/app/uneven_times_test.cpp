// Sequences whose frames are at uneven times, or in a wrong order, from file to verdict.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "compute/motion/sequence_quality.h"
#include "integration/files/sequence_motion_file.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

/// The farthest that a path leaves the straight line between two frames.
double farthest_mm(const SequenceMotion& motion) {
  double mm = 0.0;
  for (const BetweenFrames& step : between_frames(motion)) mm = std::max(mm, step.excursion.mm);
  return mm;
}

TEST(UnevenTimes, ChangeWhenTheMaterialIsWhereAndNotWhereItIs) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Sequence heart = small_heart(6);
  heart.times_s = {0.0, 0.5, 1.0, 11.0, 11.001, 11.5};
  const std::string input = written(heart, folder / "heart.seq.nrrd");
  for (const bool cyclic : {false, true}) {
    std::vector<std::string> command = {"motion",   input,  "-o",      folder / "out",
                                        "--preset", "fast", "--coarse"};
    if (cyclic) command.emplace_back("--cyclic");
    const Outcome found = run(command);
    EXPECT_EQ(found.exit_code, 0) << found.out << found.err;
    EXPECT_THAT(found.out, HasSubstr("Verdict   ok"));
    const auto motion = files::read_sequence_motion(folder / "out/sequence_motion.nrrd");
    ASSERT_TRUE(motion) << motion.error().message;
    EXPECT_EQ(motion->basis.cycle_s > 0.0, cyclic);
    SequenceMotion even = *motion;
    for (size_t k = 0; k < even.frames(); ++k) even.basis.times_s[k] = double(k);
    if (cyclic) even.basis.cycle_s = double(even.frames());
    EXPECT_LE(farthest_mm(*motion), 1.01 * farthest_mm(even));
  }
}

TEST(FramesInAWrongOrder, AreNamedInOneSentence) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart(8);
  Sequence shuffled = heart;
  const size_t order[] = {0, 4, 1, 5, 2, 6, 3, 7};
  for (size_t k = 0; k < 8; ++k) shuffled.frames[k] = heart.frames[order[k]];
  const std::string sentence = "The path jumps to and fro: frame ";
  const std::string right = written(heart, folder / "right.seq.nrrd"),
                    wrong = written(shuffled, folder / "wrong.seq.nrrd");
  // The fields of pairs are not written beside the motion of a sequence.
  std::string out;
  for (const char* model : {"pairwise", "sequence"}) {
    out = folder / model;
    const auto command = [&](const std::string& input) {
      return std::vector<std::string>{"motion", input,      "-o",      out,  "--preset",
                                      "fast",   "--coarse", "--model", model};
    };
    EXPECT_THAT(run(command(right)).out, Not(HasSubstr(sentence))) << model;
    const Outcome found = run(command(wrong));
    EXPECT_NE(found.exit_code, 0);
    EXPECT_THAT(found.out, HasSubstr(sentence)) << model;
    EXPECT_THAT(found.out, HasSubstr("check the order of the frames")) << model;
  }
  EXPECT_THAT(run({"check", out, "--sequence", wrong}).out, HasSubstr(sentence));
}

}  // namespace
}  // namespace palpate::app
