// Reading, estimating and judging in parallel, without the program around it.
#include "integration/app/estimation.h"

#include <gtest/gtest.h>

#include <atomic>

#include "compute/motion/options.h"
#include "integration/app/program.h"
#include "tests/app/scenes.h"
#include "tests/support/device.h"

namespace palpate::app {

const char* const kProgramName = "estimation_test";  // in the sentences of errors

namespace {

using EstimationOfFrames = test::DeviceTest;

/// Frames that would take too much memory are read once to be estimated and again to be judged.
TEST_F(EstimationOfFrames, ReadsFramesAgainThatItDoesNotKeep) {
  const Sequence heart = small_heart();
  for (const bool keeps : {true, false}) {
    EstimationJob job;
    job.grid = heart.frames[0].grid;
    job.frame_count = 3;
    job.keeps_frames = keeps;
    job.options.motion = *motion_preset("fast");
    std::atomic<int> reads{0};
    job.read_frame = [&](size_t k) -> Result<Volume> {
      ++reads;
      return heart.frames[k];
    };
    Console console(true, false);
    size_t pairs = 0;
    const Status done = estimate(context(), job,
                                 [&](const EstimatedPair& pair) -> Status {
                                   EXPECT_EQ(pair.fixed->values, heart.frames[pairs].values);
                                   EXPECT_EQ(pair.moving->values, heart.frames[pairs + 1].values);
                                   ++pairs;
                                   return Nothing{};
                                 },
                                 console, {});
    EXPECT_TRUE(done);
    EXPECT_EQ(pairs, 2U);
    EXPECT_EQ(reads, keeps ? 3 : 7);
  }
}

/// A frame that can not be read again ends the work with its sentence.
TEST_F(EstimationOfFrames, EndsWhereAFrameIsGoneWhenItIsToBeJudged) {
  const Sequence heart = small_heart();
  EstimationJob job;
  job.grid = heart.frames[0].grid;
  job.frame_count = 2;
  job.keeps_frames = false;
  job.options.motion = *motion_preset("fast");
  int reads = 0;
  job.read_frame = [&](size_t k) -> Result<Volume> {
    if (++reads > 2) return Error{ErrorKind::kBadInput, "The frame is gone."};
    return heart.frames[k];
  };
  Console console(true, false);
  const Status done = estimate(context(), job,
                               [](const EstimatedPair&) -> Status {
                                 ADD_FAILURE();
                                 return Nothing{};
                               },
                               console, {});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "The frame is gone.");
}

}  // namespace
}  // namespace palpate::app
