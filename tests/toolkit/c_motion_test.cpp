// Motion through the C library. Oracles: the engine called directly, the truth of phantoms, ITK's
// convention computed by hand.
#include <gmock/gmock.h>

#include <atomic>
#include <cstring>
#include <limits>
#include <optional>
#include <thread>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/verdict.h"
#include "compute/volume/phantom.h"
#include "integration/files/read_volume.h"
#include "tests/files/temporary_folder.h"
#include "tests/support/device.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

PalGrid grid_of(const Grid& grid) {
  PalGrid given{};
  for (int a = 0; a < 3; ++a) {
    given.size[a] = uint32_t(grid.size[a]);
    given.spacing_mm[a] = grid.spacing_mm[a];
    given.origin_mm[a] = grid.origin_mm[a];
    for (int row = 0; row < 3; ++row) given.direction[3 * row + a] = grid.direction[a][row];
  }
  return given;
}

/// The C library opens its own device; these tests are skipped if there is none.
class CMotion : public DeviceTest {
 protected:
  void SetUp() override {
    DeviceTest::SetUp();
    if (IsSkipped()) return;
    const PalContextInfo info = context_info(0);
    PAL_ASSERT_OK(pal_context_open(&info, &opened_.context));
  }
  void TearDown() override {
    pal_motion_close(&motion_);
    pal_estimator_close(&estimator_);
    DeviceTest::TearDown();
  }

  PalEstimatorInfo info(uint32_t flags = 0) const {
    PalEstimatorInfo info{};
    info.size = sizeof info;
    info.flags = flags;
    info.grid = grid_of(sequence_.frames.front().grid);
    info.preset = "fast";
    return info;
  }
  void estimate(const PalEstimatorInfo& info) {
    PAL_ASSERT_OK(pal_estimator_open(opened_.context, &info, &estimator_));
    for (size_t k = 0; k < sequence_.frames.size(); ++k)
      PAL_ASSERT_OK(pal_estimator_push(estimator_, PAL_FLOAT32, sequence_.frames[k].values.data(),
                                       sequence_.times_s[k]));
    PAL_ASSERT_OK(pal_estimator_finish(estimator_, &motion_));
  }
  std::vector<float> field(uint32_t step = 0, uint32_t flags = 0, double time_s = 0.0,
                           const PalGrid* grid = nullptr) {
    PalFieldInfo wanted{};
    wanted.size = sizeof wanted;
    wanted.flags = flags;
    wanted.step = step;
    wanted.time_s = time_s;
    wanted.grid = grid;
    const size_t samples = grid ? size_t(grid->size[0]) * grid->size[1] * grid->size[2]
                                : sequence_.frames.front().values.size();
    std::vector<float> xyz(3 * samples, 77.0F);
    EXPECT_EQ(pal_motion_field(motion_, &wanted, xyz.data()), PAL_OK) << pal_last_error();
    return xyz;
  }
  PalMotionSummary summary() {
    PalMotionSummary known{};
    known.size = sizeof known;
    EXPECT_EQ(pal_motion_summary(motion_, &known), PAL_OK) << pal_last_error();
    return known;
  }
  static double rms_mm(const std::vector<float>& a, const Field& b) {
    double sum = 0.0;
    for (size_t s = 0; s < b.u_mm.size(); ++s)
      for (int c = 0; c < 3; ++c) {
        const double d = double(a[3 * s + size_t(c)]) - double(b.u_mm[s][c]);
        sum += d * d;
      }
    return std::sqrt(sum / double(b.u_mm.size()));
  }

  Sequence sequence_ = shell_phantom(40, 4, 1, 0.01);
  Opened opened_;
  PalEstimator* estimator_ = nullptr;
  PalMotion* motion_ = nullptr;
};

TEST_F(CMotion, OfAPairIsTheEnginesOwnBitByBit) {
  sequence_.frames.resize(2);
  estimate(info());
  EstimatorOptions options;
  options.motion = *motion_preset("fast");
  options.backward = true;
  const auto direct = estimate_motion(context(), sequence_.frames[0], sequence_.frames[1], options);
  ASSERT_TRUE(direct);
  const Field expected = resampled(direct->field, sequence_.frames[0].grid);
  const std::vector<float> got = field();
  ASSERT_EQ(got.size(), 3 * expected.u_mm.size());
  EXPECT_EQ(std::memcmp(got.data(), expected.u_mm.data(), 4 * got.size()), 0);

  const PalMotionSummary known = summary();
  EXPECT_EQ(known.frame_count, 2U);
  EXPECT_EQ(known.step_count, 1U);
  EXPECT_EQ(known.is_whole, 0U);
  EXPECT_NE(known.trust, PAL_TRUST_UNKNOWN);
  EXPECT_EQ(known.trust == PAL_TRUST_OK, std::string(known.reasons).empty());
  EXPECT_GT(known.motion_max_mm, known.motion_mean_mm);
  EXPECT_GT(known.correlation_after, known.correlation_before);
  EXPECT_EQ(known.folded_voxels, 0.0);
  EXPECT_TRUE(std::isnan(known.drift_mean_mm));
  const Field truth = shell_truth(sequence_.frames[0].grid, 0, 1, 4);
  EXPECT_LT(rms_mm(got, truth), 0.5 * rms_mm(std::vector<float>(got.size(), 0.0F), truth));

  std::vector<float> confidence(sequence_.frames[0].values.size(), 9.0F);
  PalFieldInfo step{};
  step.size = sizeof step;
  PAL_EXPECT_OK(pal_motion_confidence(motion_, &step, confidence.data()));
  EXPECT_TRUE(std::all_of(confidence.begin(), confidence.end(),
                          [](float c) { return c >= 0.0F && c <= 1.0F; }));
  EXPECT_GT(*std::max_element(confidence.begin(), confidence.end()), 0.5F);

  // Deviation: what the images show least is less certain than what they show best.
  std::vector<float> sd(2 * sequence_.frames[0].values.size(), -1.0F);
  PAL_EXPECT_OK(pal_motion_deviation(motion_, &step, sd.data()));
  const Deviation there = resampled(direct->confidence.deviation, sequence_.frames[0].grid);
  EXPECT_EQ(std::memcmp(sd.data(), there.mm.data(), sizeof(float) * sd.size()), 0);
  for (size_t i = 0; i < sd.size(); i += 2) {
    EXPECT_GT(sd[i], 0.0F);
    EXPECT_GT(sd[i + 1], sd[i]);
  }
  EXPECT_GT(known.within_95_mm, 0.0);
  EXPECT_LT(known.within_95_mm, known.motion_max_mm);
  EXPECT_EQ(pal_motion_deviation(motion_, &step, nullptr), PAL_BAD_INPUT);
  step.step = 1;
  EXPECT_EQ(pal_motion_deviation(motion_, &step, sd.data()), PAL_BAD_INPUT);
}

TEST_F(CMotion, WarpsTheMovingFrameOntoTheFixedOneAndBack) {
  sequence_.frames.resize(2);
  estimate(info(PAL_ESTIMATOR_NO_VERDICT));
  EXPECT_EQ(summary().trust, PAL_TRUST_UNKNOWN);
  const auto difference = [](const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0.0;
    for (size_t k = 0; k < a.size(); ++k) sum += double((a[k] - b[k]) * (a[k] - b[k]));
    return std::sqrt(sum / double(a.size()));
  };
  const auto &fixed = sequence_.frames[0].values, &moving = sequence_.frames[1].values;
  std::vector<float> carried(fixed.size());
  PalFieldInfo step{};
  step.size = sizeof step;
  PAL_ASSERT_OK(pal_motion_warp(motion_, &step, PAL_FLOAT32, moving.data(), carried.data()));
  EXPECT_LT(difference(carried, fixed), 0.5 * difference(moving, fixed));
  step.flags = PAL_FIELD_INVERSE;
  PAL_ASSERT_OK(pal_motion_warp(motion_, &step, PAL_FLOAT32, fixed.data(), carried.data()));
  EXPECT_LT(difference(carried, moving), 0.5 * difference(fixed, moving));
}

TEST_F(CMotion, OfASequenceIsOneMotionForAllFrames) {
  estimate(info(PAL_ESTIMATOR_CYCLIC));
  const PalMotionSummary known = summary();
  EXPECT_EQ(known.is_whole, 1U);
  EXPECT_EQ(known.step_count, 4U);
  EXPECT_GT(known.cycle_s, 0.0);
  EXPECT_NE(known.trust, PAL_TRUST_UNKNOWN);
  EXPECT_NEAR(known.drift_mean_mm, 0.0, 0.05);
  // At the time of the reference frame the displacement is zero, and the motion is periodic.
  const double reference_s = sequence_.times_s[known.reference_frame];
  for (const float u : field(0, PAL_FIELD_TO_TIME, reference_s)) ASSERT_NEAR(u, 0.0, 0.05);
  const auto once = field(0, PAL_FIELD_TO_TIME, 0.3),
             again = field(0, PAL_FIELD_TO_TIME, 0.3 + known.cycle_s);
  for (size_t k = 0; k < once.size(); ++k) ASSERT_NEAR(once[k], again[k], 1e-3);
  const Field truth = shell_truth(sequence_.frames[0].grid, 1, 2, 4);
  EXPECT_LT(rms_mm(field(1), truth),
            0.6 * rms_mm(std::vector<float>(3 * truth.u_mm.size(), 0.0F), truth));

  // It is the same after it was written and read again.
  const TemporaryFolder folder;
  const std::string file = folder / "whole.nrrd";
  PAL_ASSERT_OK(pal_motion_save(motion_, nullptr, file.c_str()));
  PalMotion* read = nullptr;
  PAL_ASSERT_OK(pal_motion_open(opened_.context, file.c_str(), &read));
  std::swap(read, motion_);
  const PalGrid grid = grid_of(sequence_.frames.front().grid);
  EXPECT_EQ(field(0, PAL_FIELD_TO_TIME, 0.3, &grid), once);
  // A frame on the requested grid is moved by the motion that was found.
  const Volume& frame = sequence_.frames[known.reference_frame];
  PalFieldInfo then{};
  then.size = sizeof then;
  then.flags = PAL_FIELD_TO_TIME | PAL_FIELD_INVERSE;
  then.time_s = 0.3;
  std::vector<float> found(frame.values.size()), carried(frame.values.size());
  PAL_EXPECT_OK(pal_motion_warp(read, &then, PAL_FLOAT32, frame.values.data(), found.data()));
  then.grid = &grid;
  PAL_EXPECT_OK(pal_motion_warp(motion_, &then, PAL_FLOAT32, frame.values.data(), carried.data()));
  EXPECT_EQ(carried, found);
  EXPECT_NE(carried, frame.values);
  pal_motion_close(&read);
}

TEST_F(CMotion, OfACycleInPairsIsJudgedByItsDriftToo) {
  estimate(info(PAL_ESTIMATOR_PAIRWISE | PAL_ESTIMATOR_CYCLIC));
  EXPECT_EQ(summary().step_count, 4U);
  // As the program computes the verdict of pairs: points of the first frame with structure are
  // followed around the cycle.
  EstimatorOptions options;
  options.motion = *motion_preset("fast");
  options.cyclic = options.backward = true;
  std::vector<PairMotion> pairs;
  const Grid grid = sequence_.frames.front().grid;
  auto estimator = SequenceEstimator::open(
      context(), grid, options, [&](PairMotion pair) { pairs.push_back(std::move(pair)); });
  ASSERT_TRUE(estimator);
  for (size_t k = 0; k < 4; ++k) ASSERT_TRUE((*estimator)->push(k, sequence_.frames[k]));
  ASSERT_TRUE((*estimator)->finish());
  ASSERT_EQ(pairs.size(), 4U);
  Verdict expected;
  std::optional<CyclePoints> points;
  for (size_t k = 0; k < 4; ++k) {
    const Field on_grid = resampled(pairs[k].field, grid);
    Mask structure;
    auto evidence = examined(sequence_.frames[k], sequence_.frames[(k + 1) % 4], on_grid,
                             &*pairs[k].backward, &pairs[k].confidence, nullptr, &structure);
    ASSERT_TRUE(evidence);
    if (k == 0) points.emplace(grid, &structure);
    points->follow(on_grid);
    if (k == 3) {
      evidence->drift = points->drift();
      EXPECT_NEAR(summary().drift_mean_mm, evidence->drift->mm.mean, 1e-12);
    }
    add(expected, judged(*evidence),
        "Frame " + std::to_string(k) + " to " + std::to_string((k + 1) % 4));
  }
  EXPECT_STREQ(summary().trust_word, word(expected.trust));
  std::string reasons;
  for (const std::string& reason : expected.reasons)
    reasons += (reasons.empty() ? "" : "\n") + reason;
  EXPECT_EQ(summary().reasons, reasons);
}

TEST_F(CMotion, CountsTimeAsTheFramesDo) {
  sequence_.frames.resize(3);
  sequence_.times_s.resize(3);
  estimate(info(PAL_ESTIMATOR_NO_VERDICT));
  const auto known = field(0, PAL_FIELD_TO_TIME, 0.375);
  for (double& time_s : sequence_.times_s) time_s += 7.0;
  pal_motion_close(&motion_);
  pal_estimator_close(&estimator_);
  estimate(info(PAL_ESTIMATOR_NO_VERDICT));
  EXPECT_EQ(field(0, PAL_FIELD_TO_TIME, 7.375), known);
  // Times in the file begin at 0.
  const TemporaryFolder folder;
  const std::string file = folder / "whole.nrrd";
  PAL_ASSERT_OK(pal_motion_save(motion_, nullptr, file.c_str()));
  PalMotion* read = nullptr;
  PAL_ASSERT_OK(pal_motion_open(opened_.context, file.c_str(), &read));
  std::swap(read, motion_);
  const PalGrid grid = grid_of(sequence_.frames.front().grid);
  EXPECT_EQ(field(0, PAL_FIELD_TO_TIME, 0.375, &grid), known);
  pal_motion_close(&read);
}

TEST_F(CMotion, OfASequenceInPairsHasAFieldPerStep) {
  estimate(info(PAL_ESTIMATOR_PAIRWISE));
  EXPECT_EQ(summary().step_count, 3U);
  EXPECT_NE(field(0), field(1));
  PalFieldInfo wanted{};
  wanted.size = sizeof wanted;
  wanted.step = 3;
  std::vector<float> xyz(3 * sequence_.frames.front().values.size());
  EXPECT_EQ(pal_motion_field(motion_, &wanted, xyz.data()), PAL_BAD_INPUT);
  wanted.step = 0;
  wanted.flags = PAL_FIELD_TO_TIME;
  EXPECT_EQ(pal_motion_field(motion_, &wanted, xyz.data()), PAL_BAD_INPUT);
}

TEST_F(CMotion, IsWrittenAsItkReadsIt) {
  sequence_.frames.resize(2);
  estimate(info(PAL_ESTIMATOR_NO_VERDICT));
  const TemporaryFolder folder;
  PalFieldInfo step{};
  step.size = sizeof step;
  PAL_ASSERT_OK(pal_motion_save(motion_, &step, std::string(folder / "u.mha").c_str()));
  const auto read = files::read_field(folder / "u.mha");
  ASSERT_TRUE(read);
  const auto got = field();
  EXPECT_EQ(std::memcmp(got.data(), read->u_mm.data(), 4 * got.size()), 0);
  EXPECT_EQ(pal_motion_save(motion_, &step, std::string(folder / "u.txt").c_str()), PAL_BAD_OUTPUT);
  EXPECT_EQ(pal_motion_save(motion_, &step, nullptr), PAL_BAD_INPUT);
}

TEST_F(CMotion, DoesNotDependOnTheOrderOfAnAxis) {
  // With j counted from the other end: the same samples at the same places, so the same field
  // there.
  sequence_.frames.resize(2);
  estimate(info(PAL_ESTIMATOR_NO_VERDICT));
  const std::vector<float> straight = field();
  pal_motion_close(&motion_);
  pal_estimator_close(&estimator_);
  const Grid grid = sequence_.frames.front().grid;
  const int n = grid.size.x;
  for (Volume& frame : sequence_.frames) {
    const std::vector<float> before = frame.values;
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
          frame.values[grid.offset(i, j, k)] = before[grid.offset(i, n - 1 - j, k)];
  }
  PalEstimatorInfo flipped = info(PAL_ESTIMATOR_NO_VERDICT);
  flipped.grid.direction[4] = -1.0;
  flipped.grid.origin_mm[1] = grid.origin_mm.y + grid.spacing_mm.y * (n - 1);
  estimate(flipped);
  const std::vector<float> reversed = field();
  double worst = 0.0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (size_t c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(double(straight[3 * grid.offset(i, j, k) + c]) -
                                           double(reversed[3 * grid.offset(i, n - 1 - j, k) + c])));
  EXPECT_LT(worst, 1e-5);
}

struct Progress {
  PalEstimator* estimator = nullptr;
  std::atomic<int> calls{0};
  std::atomic<double> last{0.0};
  std::atomic<int> closed{77}, finished{77};
};

TEST_F(CMotion, IsCancelledFromItsCallback) {
  for (const uint32_t flags : {uint32_t(PAL_ESTIMATOR_PAIRWISE), 0U}) {
    Progress progress;
    PalEstimatorInfo cancelling = info(flags);
    cancelling.user = &progress;
    cancelling.on_progress = [](void* user, const char* doing, double share) {
      auto* const self = static_cast<Progress*>(user);
      EXPECT_TRUE(doing && *doing);
      EXPECT_GE(share, 0.0);
      EXPECT_LE(share, 1.0);
      if (++self->calls > 1) return;
      PalEstimator* handle = self->estimator;
      self->closed = pal_estimator_close(&handle);
      PalMotion* never = nullptr;
      self->finished = pal_estimator_finish(self->estimator, &never);
      pal_estimator_cancel(self->estimator);
    };
    PAL_ASSERT_OK(pal_estimator_open(opened_.context, &cancelling, &estimator_));
    progress.estimator = estimator_;
    PalResult pushed = PAL_OK;
    for (const Volume& frame : sequence_.frames)
      if (pushed == PAL_OK)
        pushed = pal_estimator_push(estimator_, PAL_FLOAT32, frame.values.data(), -1.0);
    EXPECT_TRUE(pushed == PAL_OK || pushed == PAL_CANCELLED) << pal_last_error();
    EXPECT_EQ(pal_estimator_finish(estimator_, &motion_), PAL_CANCELLED);
    EXPECT_EQ(motion_, nullptr);
    EXPECT_GT(progress.calls, 0);
    EXPECT_EQ(progress.closed, PAL_BAD_INPUT);
    EXPECT_EQ(progress.finished, PAL_BAD_INPUT);
    PAL_EXPECT_OK(pal_estimator_close(&estimator_));
  }
}

TEST_F(CMotion, IsCancelledByAnExceptionOfItsCallback) {
  for (const uint32_t flags : {uint32_t(PAL_ESTIMATOR_PAIRWISE), 0U}) {
    PalEstimatorInfo throwing = info(flags);
    throwing.on_progress = [](void*, const char*, double) {
      throw std::runtime_error("the window was closed");
    };
    PAL_ASSERT_OK(pal_estimator_open(opened_.context, &throwing, &estimator_));
    PalResult pushed = PAL_OK;
    for (const Volume& frame : sequence_.frames)
      if (pushed == PAL_OK)
        pushed = pal_estimator_push(estimator_, PAL_FLOAT32, frame.values.data(), -1.0);
    EXPECT_TRUE(pushed == PAL_OK || pushed == PAL_CANCELLED) << pal_last_error();
    EXPECT_EQ(pal_estimator_finish(estimator_, &motion_), PAL_CANCELLED);
    EXPECT_THAT(pal_last_error(),
                ::testing::HasSubstr("on_progress threw an exception: the window was closed"));
    EXPECT_EQ(motion_, nullptr);
    PAL_EXPECT_OK(pal_estimator_close(&estimator_));
  }
}

TEST_F(CMotion, SaysHowFarItIsWithoutWaiting) {
  PalProgress progress{};
  progress.size = sizeof progress;
  EXPECT_EQ(pal_estimator_poll(nullptr, &progress), PAL_BAD_INPUT);
  const PalEstimatorInfo cycle = info(PAL_ESTIMATOR_CYCLIC);
  PAL_ASSERT_OK(pal_estimator_open(opened_.context, &cycle, &estimator_));
  EXPECT_EQ(pal_estimator_poll(estimator_, nullptr), PAL_BAD_INPUT);
  for (const Volume& frame : sequence_.frames)
    PAL_ASSERT_OK(pal_estimator_push(estimator_, PAL_FLOAT32, frame.values.data(), -1.0));
  PAL_ASSERT_OK(pal_estimator_poll(estimator_, &progress));
  EXPECT_EQ(progress.frames_pushed, 4U);
  EXPECT_EQ(progress.is_finished, 0U);
  EXPECT_LT(progress.share, 1.0);
  std::atomic<bool> is_over{false};
  std::thread waiting([&] {
    PAL_EXPECT_OK(pal_estimator_finish(estimator_, &motion_));
    is_over = true;
  });
  double last = 0.0;
  uint32_t last_steps = 0;
  int between = 0;
  while (!is_over) {
    PAL_EXPECT_OK(pal_estimator_poll(estimator_, &progress));
    EXPECT_GE(progress.share, last);
    EXPECT_GE(progress.steps_found, last_steps);
    between += progress.share > 0.1 && progress.share < 0.9;
    last = progress.share;
    last_steps = progress.steps_found;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  waiting.join();
  EXPECT_GT(between, 0);
  PAL_EXPECT_OK(pal_estimator_poll(estimator_, &progress));
  EXPECT_EQ(progress.steps_found, 4U);
  EXPECT_EQ(progress.is_finished, 1U);
  EXPECT_EQ(progress.share, 1.0);
}

TEST_F(CMotion, IsCancelledWhileAnotherThreadWaits) {
  const PalEstimatorInfo wanted = info();
  PAL_ASSERT_OK(pal_estimator_open(opened_.context, &wanted, &estimator_));
  for (const Volume& frame : sequence_.frames)
    PAL_ASSERT_OK(pal_estimator_push(estimator_, PAL_FLOAT32, frame.values.data(), -1.0));
  std::atomic<int> result{77};
  std::thread waiting(
      [&, handle = estimator_] { result = pal_estimator_finish(handle, &motion_); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  PAL_EXPECT_OK(pal_estimator_close(&estimator_));
  waiting.join();
  EXPECT_TRUE(result == PAL_CANCELLED || result == PAL_BAD_INPUT || result == PAL_OK) << result;
}

TEST_F(CMotion, HonoursAMask) {
  sequence_.frames.resize(2);
  const Grid& grid = sequence_.frames.front().grid;
  std::vector<uint8_t> mask(grid.count(), 0);
  PalEstimatorInfo masked = info(PAL_ESTIMATOR_NO_VERDICT);
  masked.mask = mask.data();
  EXPECT_EQ(pal_estimator_open(opened_.context, &masked, &estimator_), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("mask"));
  for (int k = 0; k < grid.size.z / 2; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) mask[grid.offset(i, j, k)] = 1;
  estimate(masked);
  const std::vector<float> half = field();
  EstimatorOptions options;
  options.motion = *motion_preset("fast");
  options.mask = Mask{grid, mask};
  const auto direct = estimate_motion(context(), sequence_.frames[0], sequence_.frames[1], options);
  ASSERT_TRUE(direct);
  EXPECT_EQ(std::memcmp(half.data(), resampled(direct->field, grid).u_mm.data(), 4 * half.size()),
            0);
}

TEST_F(CMotion, CarriesTheFramesOfAScene) {
  estimate(info(PAL_ESTIMATOR_CYCLIC));
  std::vector<const void*> frames;
  for (const Volume& frame : sequence_.frames) frames.push_back(frame.values.data());
  PalFrames given{};
  given.size = sizeof given;
  given.name = "shell frames";
  given.grid = grid_of(sequence_.frames.front().grid);
  given.frames = frames.data();
  given.frame_count = uint32_t(frames.size());
  given.times_s = sequence_.times_s.data();
  given.motion = motion_;
  const char* path = "shell frames";
  PalSceneInfo scene = scene_info(&path, 0, &given);
  PAL_ASSERT_OK(pal_scene_open(opened_.context, &scene, &opened_.scene));
  PalVolume volume{};
  volume.size = sizeof volume;
  PAL_ASSERT_OK(pal_scene_volume(opened_.scene, 0, &volume));
  EXPECT_EQ(volume.is_motion_known, 1U);
  EXPECT_EQ(volume.frame_count, 4U);
}

TEST_F(CMotion, RefusesWhatCanNotBe) {
  PalEstimatorInfo wrong = info();
  wrong.preset = "quickest";
  EXPECT_EQ(pal_estimator_open(opened_.context, &wrong, &estimator_), PAL_BAD_INPUT);
  wrong = info();
  wrong.grid.spacing_mm[0] = 0.0;
  EXPECT_EQ(pal_estimator_open(opened_.context, &wrong, &estimator_), PAL_BAD_INPUT);
  const PalContextInfo without = context_info();
  PalContext* no_device = nullptr;
  PAL_ASSERT_OK(pal_context_open(&without, &no_device));
  wrong = info();
  EXPECT_EQ(pal_estimator_open(no_device, &wrong, &estimator_), PAL_NO_DEVICE);
  pal_context_close(&no_device);

  PAL_ASSERT_OK(pal_estimator_open(opened_.context, &wrong, &estimator_));
  std::vector<float> frame = sequence_.frames[0].values;
  PAL_EXPECT_OK(pal_estimator_push(estimator_, PAL_FLOAT32, frame.data(), 1.0));
  EXPECT_EQ(pal_estimator_finish(estimator_, &motion_), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("at least two"));
  pal_estimator_close(&estimator_);
  PAL_ASSERT_OK(pal_estimator_open(opened_.context, &wrong, &estimator_));
  PAL_EXPECT_OK(pal_estimator_push(estimator_, PAL_FLOAT32, frame.data(), 1.0));
  EXPECT_EQ(pal_estimator_push(estimator_, PAL_FLOAT32, frame.data(), 1.0), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("rise"));
  frame[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(pal_estimator_push(estimator_, PAL_FLOAT32, frame.data(), 2.0), PAL_BAD_INPUT);
  EXPECT_EQ(pal_estimator_push(estimator_, PAL_FLOAT32, nullptr, 2.0), PAL_BAD_INPUT);
  EXPECT_EQ(pal_motion_summary(nullptr, nullptr), PAL_BAD_INPUT);
}

}  // namespace
}  // namespace palpate::test
