#include "compute/motion/estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <mutex>

#include "compute/volume/phantom.h"
#include "tests/motion/solver_test.h"

namespace palpate::test {
namespace {

using Pairs = std::vector<std::pair<size_t, size_t>>;

class Estimator : public SolverTest {
 protected:
  static const Sequence& beat() {
    static const Sequence heart = shell_phantom(32);
    return heart;
  }

  std::unique_ptr<SequenceEstimator> open(EstimatorOptions options,
                                          SequenceEstimator::OnMotion on_motion,
                                          SequenceEstimator::OnProgress on_progress = {}) {
    auto opened = SequenceEstimator::open(context(), beat().frames[0].grid, std::move(options),
                                          std::move(on_motion), std::move(on_progress));
    EXPECT_TRUE(opened) << opened.error().message;
    return opened ? std::move(*opened) : nullptr;
  }

  /// Stores the pairs in the order in which they arrive.
  SequenceEstimator::OnMotion note(Pairs& pairs) {
    return [&pairs](const PairMotion& motion) {
      pairs.emplace_back(motion.fixed_frame, motion.moving_frame);
    };
  }
};

TEST_F(Estimator, DeliversEveryPairInOrderAndClosesTheCycle) {
  EstimatorOptions options = preset("fast");
  options.cyclic = true;
  Pairs pairs;
  const auto estimator = open(options, note(pairs));
  for (size_t k = 0; k < 4; ++k) ASSERT_TRUE(estimator->push(k, beat().frames[k]));
  ASSERT_TRUE(estimator->finish());
  EXPECT_EQ(pairs, (Pairs{{0, 1}, {1, 2}, {2, 3}, {3, 0}}));
  EXPECT_EQ(estimator->dropped(), 0U);
}

TEST_F(Estimator, FromTheFirstFrameFindsWhatEachPairAloneFinds) {
  EstimatorOptions options = preset("fast");
  options.from_first = true;
  options.cyclic = true;
  std::vector<PairMotion> found;
  const auto estimator = open(options, [&](PairMotion motion) { found.push_back(motion); });
  for (size_t k = 0; k < 4; ++k) ASSERT_TRUE(estimator->push(k, beat().frames[k]));
  ASSERT_TRUE(estimator->finish());
  ASSERT_EQ(found.size(), 3U);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(found[k].fixed_frame, 0U);
    EXPECT_EQ(found[k].moving_frame, k + 1);
    const PairMotion alone = motion_of(beat().frames[0], beat().frames[k + 1], preset("fast"));
    EXPECT_EQ(found[k].field.u_mm, alone.field.u_mm) << k;
    EXPECT_EQ(found[k].confidence.values, alone.confidence.values) << k;
  }
}

/// The way back is estimated, not inverted, down to the second finest level. Forward and back along
/// a known motion must miss by less than half a voxel on average: also with a mask, where both ends
/// are inside it, and after the classic method, whose frames are not normalised.
TEST_F(Estimator, GivesAQuickWayBackWhereAsked) {
  AffineMap map;
  map.shift_mm = {2.2, -1.8, 1.5};
  const MadePair pair = made_pair(plain_grid({56, 48, 40}), map);
  const Grid& grid = pair.fixed.grid;
  EXPECT_FALSE(motion_of(pair.fixed, pair.moving, preset("fast")).backward);
  const auto expect_undone = [&](const EstimatorOptions& options, const Mask& where) {
    const PairMotion motion = motion_of(pair.fixed, pair.moving, options);
    ASSERT_TRUE(motion.backward);
    EXPECT_GT(motion.backward->grid.spacing_mm.x, 1.5 * motion.field.grid.spacing_mm.x);
    const auto missed = inverse_consistency(motion.field, *motion.backward, grid, &where);
    ASSERT_TRUE(missed);
    EXPECT_LT(missed->voxels.mean, 0.5);
    EXPECT_LT(missed->voxels.p95, 1.5);
    EXPECT_GT(motion.report.backward_seconds, 0.0);
  };
  const Mask seen = seen_in_both(pair.truth, 4.0);
  for (const std::string name : {"fast", "balanced", "best", "classic"}) {
    SCOPED_TRACE(name);
    EstimatorOptions options = preset(name);
    options.backward = true;
    expect_undone(options, seen);
    options.mask = Mask{grid, std::vector<uint8_t>(grid.count())};
    Mask inner = seen;
    for (size_t at = 0; at < grid.count(); ++at) {
      const auto i = int(at % 56);
      options.mask->values[at] = i < 36;
      inner.values[at] &= i < 28;
    }
    expect_undone(options, inner);
  }
}

TEST_F(Estimator, PairsFramesThatFollowEachOtherWhateverTheirNumbers) {
  Pairs pairs;
  const auto estimator = open(preset("fast"), note(pairs));
  ASSERT_TRUE(estimator->push(3, beat().frames[0]));
  ASSERT_TRUE(estimator->push(7, beat().frames[1]));
  ASSERT_TRUE(estimator->push(20, beat().frames[2]));
  ASSERT_TRUE(estimator->finish());
  EXPECT_EQ(pairs, (Pairs{{3, 7}, {7, 20}}));
}

TEST_F(Estimator, RefusesFramesOutOfOrderOrOnAnotherGridAndGoesOn) {
  Pairs pairs;
  const auto estimator = open(preset("fast"), note(pairs));
  ASSERT_TRUE(estimator->push(1, beat().frames[0]));
  const Status again = estimator->push(1, beat().frames[1]);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(again.error().message, testing::HasSubstr("rising order"));
  const Status other = estimator->push(2, shell_phantom(24).frames[0]);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, testing::HasSubstr("24 x 24 x 24"));
  ASSERT_TRUE(estimator->push(2, beat().frames[1]));
  ASSERT_TRUE(estimator->finish());
  EXPECT_EQ(pairs, (Pairs{{1, 2}}));
}

TEST_F(Estimator, MakesNothingOfNoFrameOrOne) {
  for (const size_t frames : {0U, 1U}) {
    Pairs pairs;
    EstimatorOptions options = preset("fast");
    options.cyclic = true;
    const auto estimator = open(options, note(pairs));
    for (size_t k = 0; k < frames; ++k) ASSERT_TRUE(estimator->push(k, beat().frames[k]));
    EXPECT_TRUE(estimator->finish());
    EXPECT_TRUE(pairs.empty());
  }
}

TEST_F(Estimator, TakesNoFrameAfterTheEnd) {
  Pairs pairs;
  const auto estimator = open(preset("fast"), note(pairs));
  ASSERT_TRUE(estimator->finish());
  const Status late = estimator->push(0, beat().frames[0]);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().kind, ErrorKind::kCancelled);
  EXPECT_TRUE(estimator->finish());
}

TEST_F(Estimator, StopsInTheMiddleOfAPairWhenCancelled) {
  Pairs pairs;
  SequenceEstimator* self = nullptr;
  std::promise<void> ready;
  std::shared_future<void> go = ready.get_future().share();
  double furthest = 0.0;
  const auto estimator = open(preset("best"), note(pairs), [&](size_t, size_t, double share) {
    go.wait();
    furthest = share;
    self->cancel();
  });
  self = estimator.get();
  ready.set_value();
  ASSERT_TRUE(estimator->push(0, beat().frames[0]));
  // The worker may cancel before or after it takes this frame.
  (void)estimator->push(1, beat().frames[1]);
  const Status done = estimator->finish();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::kCancelled);
  EXPECT_TRUE(pairs.empty());
  EXPECT_LT(furthest, 1.0);
  EXPECT_FALSE(estimator->push(2, beat().frames[2]));
}

TEST_F(Estimator, WakesAWaitingPushWhenCancelled) {
  std::promise<void> blocked;
  std::shared_future<void> go = blocked.get_future().share();
  const auto estimator = open(preset("fast"), [&](const PairMotion&) { go.wait(); });
  auto pushing = std::async(std::launch::async, [&] {
    for (size_t k = 0; k < 100; ++k)
      if (!estimator->push(k, beat().frames[k % 4])) return true;
    return false;
  });
  estimator->cancel();
  blocked.set_value();
  EXPECT_TRUE(pushing.get());
  EXPECT_FALSE(estimator->finish());
}

TEST_F(Estimator, LetsTheNewestFramesWinWhenItCanNotKeepUp) {
  EstimatorOptions options = preset("fast");
  options.backlog = 1;
  Pairs pairs;
  std::promise<void> started, pushed_all;
  std::shared_future<void> go = pushed_all.get_future().share();
  std::once_flag first;
  const auto estimator = open(options, [&](const PairMotion& motion) {
    std::call_once(first, [&] { started.set_value(); });
    // Slower than any source.
    go.wait();
    pairs.emplace_back(motion.fixed_frame, motion.moving_frame);
  });
  // Before its first pair the worker may drop any frame.
  size_t k = 0;
  std::future<void> has_begun = started.get_future();
  while (has_begun.wait_for(std::chrono::milliseconds(2)) != std::future_status::ready) {
    ASSERT_TRUE(estimator->push(k, beat().frames[k % 4]));
    ++k;
  }
  for (const size_t end = k + 12; k < end; ++k)
    ASSERT_TRUE(estimator->push(k, beat().frames[k % 4]));
  pushed_all.set_value();
  ASSERT_TRUE(estimator->finish());
  EXPECT_GT(estimator->dropped(), 0U);
  ASSERT_FALSE(pairs.empty());
  EXPECT_EQ(pairs.back().second, k - 1);
  for (size_t i = 1; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].first, pairs[i - 1].second);
}

TEST_F(Estimator, TwoAtOnceFindWhatEachFindsAlone) {
  const auto fields = [&](size_t first) {
    std::vector<Field> found;
    const auto estimator =
        open(preset("fast"), [&](PairMotion motion) { found.push_back(std::move(motion.field)); });
    for (size_t k = first; k < 4; ++k) EXPECT_TRUE(estimator->push(k, beat().frames[k]));
    EXPECT_TRUE(estimator->finish());
    return found;
  };
  const std::vector<Field> alone_a = fields(0), alone_b = fields(1);
  auto running = std::async(std::launch::async, [&] { return fields(0); });
  const std::vector<Field> beside_b = fields(1), beside_a = running.get();
  ASSERT_EQ(beside_a.size(), alone_a.size());
  ASSERT_EQ(beside_b.size(), alone_b.size());
  for (size_t i = 0; i < alone_a.size(); ++i) EXPECT_EQ(beside_a[i].u_mm, alone_a[i].u_mm);
  for (size_t i = 0; i < alone_b.size(); ++i) EXPECT_EQ(beside_b[i].u_mm, alone_b[i].u_mm);
}

TEST_F(Estimator, RefusesOptionsItCanNotUse) {
  EstimatorOptions none;
  EXPECT_FALSE(SequenceEstimator::open(context(), beat().frames[0].grid, none, {}));
  EstimatorOptions masked = preset("fast");
  masked.mask = shell_mask(heart_grid(24), 0);
  const auto opened = SequenceEstimator::open(context(), beat().frames[0].grid, masked, {});
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message, testing::HasSubstr("mask"));
  EstimatorOptions too_fine = preset("fast");
  too_fine.motion.finest_level = 9;
  EXPECT_FALSE(SequenceEstimator::open(context(), beat().frames[0].grid, too_fine, {}));
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  const std::pair<const char*, std::function<void(MotionOptions&)>> wrong[] = {
      {"level", [](MotionOptions& o) { o.levels[0].cell = 9; }},
      {"level", [&](MotionOptions& o) { o.levels.back().smoothness = no_number; }},
      {"yield", [](MotionOptions& o) { o.yield.high = o.yield.low; }},
      {"yield", [&](MotionOptions& o) { o.yield.flat = no_number; }},
      {"sliding", [](MotionOptions& o) { o.sliding.cell = -1; }},
      {"sliding", [](MotionOptions& o) { o.sliding.limit = 0.0; }},
      {"sliding", [](MotionOptions& o) { o.sliding.cubic = 1.5; }},
      {"sliding", [&](MotionOptions& o) { o.sliding.apart = no_number; }},
      {"search", [](MotionOptions& o) { o.search_mm = -1.0; }},
      {"search", [](MotionOptions& o) { o.search_reach = 20.0; }},
      {"search", [&](MotionOptions& o) { o.search_work = no_number; }},
  };
  for (const auto& [named, spoil] : wrong) {
    EstimatorOptions options = preset("balanced");
    spoil(options.motion);
    const auto refused = SequenceEstimator::open(context(), beat().frames[0].grid, options, {});
    ASSERT_FALSE(refused) << named;
    EXPECT_THAT(refused.error().message, testing::HasSubstr(named));
  }
}

}  // namespace
}  // namespace palpate::test
