// Studies on small data: their measurements are correct.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compute/volume/phantom.h"
#include "compute/vulkan/context.h"
#include "tests/lab/studies/feel_runs.h"
#include "tests/lab/studies/motion_study.h"
#include "tests/lab/studies/view_study.h"

namespace palpate::studies {
namespace {

using testing::HasSubstr;

/// The calls that a method got.
struct Calls {
  int runs = 0;
  std::vector<double> patience_s;
};

/// A method of palpate's that takes the given times, one after the other, and returns no motion.
class Timed final : public PairMethod {
 public:
  Timed(std::vector<double> seconds, Calls& calls) : seconds_(std::move(seconds)), calls_(calls) {}
  Result<PairResult> run(const Volume& fixed, const Volume&,
                         const report::Patience& patience) override {
    calls_.patience_s.push_back(patience.seconds);
    const size_t n = std::min(size_t(calls_.runs++), seconds_.size() - 1);
    return PairResult{still_field(fixed.grid), seconds_[n]};
  }
  std::string name() const override { return "timed"; }
  std::string family() const override { return "palpate"; }
  bool is_ours() const override { return true; }
  bool runs_once() const override { return false; }

 private:
  std::vector<double> seconds_;
  Calls& calls_;
};

/// A peer that requests the stop of the whole study while it runs, and then ends as stopped.
class Stopping final : public PairMethod {
 public:
  explicit Stopping(std::stop_source& source) : source_(source) {}
  Result<PairResult> run(const Volume&, const Volume&, const report::Patience& patience) override {
    source_.request_stop();
    EXPECT_TRUE(patience.stop.stop_requested());
    return Error{ErrorKind::kCancelled, "Stopped."};
  }
  std::string name() const override { return "stopping"; }
  std::string family() const override { return "peers"; }

 private:
  std::stop_source& source_;
};

template <class Method, class... Of>
std::vector<std::unique_ptr<PairMethod>> just(Of&&... of) {
  std::vector<std::unique_ptr<PairMethod>> methods;
  methods.push_back(std::make_unique<Method>(std::forward<Of>(of)...));
  return methods;
}

/// A peer that returns a known field after a known time.
class Fake final : public PairMethod {
 public:
  Fake(Field forward, Field backward)
      : forward_(std::move(forward)), backward_(std::move(backward)) {}
  Result<PairResult> run(const Volume& fixed, const Volume&, const report::Patience&) override {
    const bool there = first_ == nullptr || first_ == &fixed;
    first_ = first_ ? first_ : &fixed;
    return PairResult{there ? forward_ : backward_, 2.5};
  }
  std::string name() const override { return "fake"; }
  std::string family() const override { return "peers"; }

 private:
  const Volume* first_ = nullptr;
  Field forward_, backward_;
};

class Broken final : public PairMethod {
 public:
  Result<PairResult> run(const Volume&, const Volume&, const report::Patience&) override {
    return Error{ErrorKind::kBadInput, "it is broken."};
  }
  std::string name() const override { return "broken"; }
  std::string family() const override { return "peers"; }
};

TEST(MotionStudy, ScoresAPeerAgainstTheTruthAndItsWayBack) {
  const MotionCase heart = heart_case(32);
  const Grid& grid = heart.fixed.grid;
  std::vector<std::unique_ptr<PairMethod>> methods;
  methods.push_back(std::make_unique<Fake>(*heart.truth, shell_truth(grid, 1, 0)));
  methods.push_back(std::make_unique<Fake>(still_field(grid), still_field(grid)));
  methods.push_back(std::make_unique<Broken>());
  const MotionMeasures all = measure_motion({}, heart, std::move(methods));
  ASSERT_EQ(all.rows.size(), 2U);
  EXPECT_EQ(all.rows[0].error_mm, 0.0);
  EXPECT_EQ(all.rows[0].seconds, 2.5);
  EXPECT_EQ(all.rows[0].folded, 0U);
  // Sampled at 4 mm, the two true fields are not exact inverses of each other: they are
  // interpolated linearly.
  EXPECT_LT(all.rows[0].there_and_back_mm, 0.2);
  EXPECT_EQ(all.rows[1].error_mm, all.still_error_mm);
  EXPECT_GT(all.still_error_mm, 1.0);
  ASSERT_EQ(all.missing.size(), 1U);
  EXPECT_THAT(all.missing[0], HasSubstr("broken (peers) was not measured: it is broken."));
}

TEST(MotionStudy, RepeatsATimeOnlyUntilTwoAgree) {
  const MotionCase heart = heart_case(16);
  StudyRun run;
  run.runs = 5;
  // One run to warm up, two that agree, one back.
  Calls steady;
  const auto one =
      measure_motion(run, heart, just<Timed>(std::vector{9.0, 1.0, 1.05, 7.0}, steady));
  EXPECT_EQ(steady.runs, 4);
  EXPECT_EQ(one.rows.at(0).seconds, 1.0);
  // Rounding alone.
  EXPECT_NEAR(one.rows.at(0).spread_share, 0.05, 1e-12);
  // If two runs do not agree because of noise: the maximum number of runs.
  Calls noisy;
  const auto two = measure_motion(
      run, heart, just<Timed>(std::vector{9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0}, noisy));
  EXPECT_EQ(noisy.runs, 7);
  EXPECT_EQ(two.rows.at(0).seconds, 3.0);
}

TEST(MotionStudy, NamesWhatItLeavesOutForTime) {
  const MotionCase heart = heart_case(16);
  StudyRun run;
  // The time is over before it begins.
  run.end_s = now_s();
  Calls calls;
  auto methods = just<Timed>(std::vector{1.0}, calls);
  methods.push_back(std::make_unique<Broken>());
  const auto all = measure_motion(run, heart, std::move(methods));
  EXPECT_EQ(calls.runs, 0);
  EXPECT_TRUE(all.rows.empty());
  ASSERT_EQ(all.missing.size(), 1U);
  EXPECT_THAT(all.missing[0], HasSubstr("Left out: timed; broken."));
  EXPECT_THAT(all.missing[0], HasSubstr("--minutes"));
}

TEST(MotionStudy, LetsNoPeerTakeTheTimeOfAllOthers) {
  class Peer final : public PairMethod {
   public:
    Peer(double& seconds, int& runs) : seconds_(seconds), runs_(runs) {}
    Result<PairResult> run(const Volume& fixed, const Volume&,
                           const report::Patience& patience) override {
      seconds_ = patience.seconds;
      ++runs_;
      return PairResult{still_field(fixed.grid), 20.0};
    }
    std::string name() const override { return "peer"; }
    std::string family() const override { return "peers"; }

   private:
    double& seconds_;
    int& runs_;
  };
  StudyRun run;
  run.end_s = now_s() + 1000.0;
  double seconds = 0.0;
  int runs = 0;
  const auto all = measure_motion(run, heart_case(16), just<Peer>(seconds, runs));
  EXPECT_GT(seconds, 0.0);
  EXPECT_LE(seconds, 250.0);
  // It took too long for a run back, although there is time.
  EXPECT_EQ(runs, 1);
  EXPECT_TRUE(std::isnan(all.rows.at(0).there_and_back_mm));
}

TEST(MotionStudy, EndsWithTheRowsSoFarWhenStopped) {
  std::stop_source source;
  StudyRun run;
  run.stop = source.get_token();
  Calls calls, never;
  auto methods = just<Timed>(std::vector{1.0}, calls);
  methods.push_back(std::make_unique<Stopping>(source));
  methods.push_back(std::make_unique<Timed>(std::vector{1.0}, never));
  const auto all = measure_motion(run, heart_case(16), std::move(methods));
  EXPECT_EQ(all.rows.size(), 1U);
  EXPECT_TRUE(all.missing.empty());
  EXPECT_EQ(never.runs, 0);
}

TEST(MotionStudy, StopsASettingOfPalpateInItsMiddle) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const MotionCase heart = heart_case(32);
  std::stop_source source;
  source.request_stop();
  const auto method = palpate_method(*context, *app::motion_setting("fast"));
  const auto stopped = method->run(heart.fixed, heart.moving, {source.get_token()});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::kCancelled);
  // After this it works as before.
  EXPECT_TRUE(method->run(heart.fixed, heart.moving));
}

TEST(MotionStudy, HalvesAPairWithoutMovingIt) {
  const MotionCase whole = heart_case(64), half = halved(whole);
  EXPECT_EQ(half.fixed.grid.size, glm::ivec3(32));
  EXPECT_DOUBLE_EQ(half.voxel_mm(), 2.0 * whole.voxel_mm());
  const MotionCase made = heart_case(32);
  ASSERT_TRUE(same_geometry(half.fixed.grid, made.fixed.grid));
  double difference = 0.0;
  for (size_t n = 0; n < made.truth->u_mm.size(); ++n)
    difference =
        std::max(difference, double(glm::length(half.truth->u_mm[n] - made.truth->u_mm[n])));
  // The error of a trilinear field of 2 mm between its samples; curvature about 1/50 mm at 5 mm of
  // motion.
  EXPECT_LT(difference, 0.1);
}

TEST(MotionStudy, CountsTheSameWorkInEveryRun) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const MotionCase heart = heart_case(48);
  for (const char* name : {"fast", "balanced, twice the iterations"}) {
    const auto method = palpate_method(*context, *app::motion_setting(name));
    const auto first = method->run(heart.fixed, heart.moving);
    const auto second = method->run(heart.fixed, heart.moving);
    ASSERT_TRUE(first && second);
    EXPECT_GT(first->work_bytes, 0.0);
    EXPECT_EQ(first->work_bytes, second->work_bytes) << name;
    EXPECT_LT(error_of(first->field, heart)->mm.mean,
              0.5 * error_of(still_field(heart.fixed.grid), heart)->mm.mean);
  }
}

TEST(ViewStudy, DrawsTheYardstickOfBothLooksWhereThereIsNoTimeAndNamesTheRest) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  StudyRun run;
  run.context = *context;
  run.quick = true;
  run.runs = 1;
  run.end_s = now_s();
  std::vector<std::string> missing;
  const auto all = measure_view(run, missing);
  ASSERT_EQ(all.size(), 2U);
  for (const ViewMeasure& m : all) {
    EXPECT_EQ(m.samples_per_voxel, 1.0);
    // A wrong picture has about 10 dB.
    EXPECT_GT(m.quality_db, 30.0) << m.look;
    // It is not the reference itself.
    EXPECT_LT(m.quality_db, 99.0) << m.look;
  }
  EXPECT_EQ(all[0].look, "sparse");
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_THAT(missing[0], HasSubstr("sparse, palpate, moving, 1 a voxel"));
  EXPECT_THAT(missing[0], HasSubstr("dense, palpate, by samples per voxel, 2 a voxel"));
}

TEST(FeelStudy, FindsTheForceOfAStillSphere) {
  const FeelMeasure m = feel({"static", "palpate", false, Moves::kNothing}, 1);
  // The goal in README is 0.5 % of forces of about 1 N; here sampled at 1 mm.
  EXPECT_LT(m.rms_n, 0.02);
  EXPECT_GT(m.rms_n, 0.0);
  EXPECT_EQ(m.field_megabytes, 0.0);
}

TEST(FeelStudy, TurnsTheMotionAroundBetterWithMoreSteps) {
  double last = INFINITY;
  for (const int steps : {1, 2, 4, 8}) {
    const InversionMeasure m = picard_inversion(steps, 500);
    EXPECT_EQ(m.steps, steps);
    // The contraction of the heart's field is below 0.7 everywhere (`palpate plan heart`).
    EXPECT_LT(m.residual_um, last * std::pow(0.7, steps > 1 ? steps / 2 : 0));
    last = m.residual_um;
  }
  EXPECT_LT(newton_inversion(500).residual_um, 0.01);
}

}  // namespace
}  // namespace palpate::studies
