#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "compute/motion/slab_images.h"
#include "compute/vulkan/context.h"
#include "tests/motion/solver_test.h"

/// Estimations with memory limits too small for whole images.
namespace palpate::test {
namespace {

using SolverSlabs = SolverTest;

// Sums of fp16 equations are added in another order; the filter only passes this difference in the
// last bit on.
constexpr double kSameMeanVoxels = 0.005;
constexpr double kSameP99Voxels = 0.05;

std::shared_ptr<vulkan::Context> small_device(uint64_t bytes) {
  vulkan::ContextOptions options;
  options.validation = true;
  options.memory_cap_bytes = bytes;
  return *vulkan::Context::open(options);
}

MadePair tall_pair() {
  // Motion along k moves partners across the cuts.
  AffineMap map;
  map.linear = glm::dmat3(1.02, 0.0, 0.01, 0.0, 0.99, 0.02, 0.0, -0.02, 1.03);
  map.shift_mm = {1.5, -2.0, 6.0};
  const Grid grid = plain_grid({40, 44, 150}, {1.0, 1.0, 1.1});
  map.centre_mm = middle_of(grid);
  return made_pair(grid, map);
}

TEST_F(SolverSlabs, GiveTheSameFieldAsWholeImages) {
  const MadePair pair = tall_pair();
  const EstimatorOptions options = preset("balanced");
  const PairMotion whole = motion_of(pair.fixed, pair.moving, options);
  // The step for sliding borders is left out before images are cut.
  const uint64_t needed =
      plan_motion(pair.fixed.grid, without_sliding_step(options.motion)).device_bytes;
  size_t most = 1;
  for (const uint64_t tenths : {8, 6}) {
    SCOPED_TRACE(tenths);
    const auto device = small_device(needed * tenths / 10);
    MotionPlan plan = plan_motion(pair.fixed.grid, options.motion);
    ASSERT_TRUE(fit_into(plan, budget_of(*device)));
    EXPECT_GT(slabs_of(plan).size(), most);
    most = slabs_of(plan).size();

    const Result<PairMotion> cut = estimate_motion(device, pair.fixed, pair.moving, options);
    ASSERT_TRUE(cut) << cut.error().message;
    EXPECT_LE(device->memory_peak_bytes(), needed * tenths / 10);
    EXPECT_TRUE(device->validation_messages().empty()) << device->validation_messages().front();
    const Result<Distances> apart = endpoint_error(cut->field, whole.field);
    ASSERT_TRUE(apart);
    EXPECT_LT(apart->voxels.mean, kSameMeanVoxels);
    EXPECT_LT(apart->voxels.p99, kSameP99Voxels);
  }
}

/// With slabs the step for sliding borders, which needs whole images, and its memory are left out;
/// the plan and the device agree on the memory.
TEST_F(SolverSlabs, DoWithoutTheStepForSlidingBordersAndItsMemory) {
  const MadePair pair = tall_pair();
  EstimatorOptions options = preset("balanced");
  // Three frames are kept.
  options.cyclic = true;
  const auto peak = [&](const MotionPlan& plan) {
    const auto device = small_device(plan.device_bytes);
    const auto estimator = SequenceEstimator::open(
        device, pair.fixed.grid, options,
        [&](const PairMotion& motion) { EXPECT_EQ(motion.field.grid.size, plan.field.size); });
    EXPECT_TRUE(estimator);
    if (!estimator) return 0.0;
    for (size_t k = 0; k < 3; ++k)
      EXPECT_TRUE((*estimator)->push(k, k % 2 == 0 ? pair.fixed : pair.moving));
    EXPECT_TRUE((*estimator)->finish());
    EXPECT_LE(device->memory_peak_bytes(), plan.device_bytes);
    return double(device->memory_peak_bytes());
  };
  MotionPlan with = plan_motion(pair.fixed.grid, options.motion, true);
  ASSERT_TRUE(has_sliding_step(with));
  const double peak_with = peak(with);
  options.motion.sliding.cell = 0;
  MotionPlan without = plan_motion(pair.fixed.grid, options.motion, true);
  const double peak_without = peak(without);
  EXPECT_LT(without.field.count(), with.field.count());
  // A fiftieth of the plan is reserved for the alignment of allocations.
  EXPECT_NEAR(peak_with - peak_without, double(with.device_bytes - without.device_bytes) / 1.02,
              0.01 * peak_with);

  // Without a cycle the first frame is released when the third one arrives.
  options.cyclic = false;
  const MotionPlan open = plan_motion(pair.fixed.grid, options.motion);
  EXPECT_NEAR(peak_without - peak(open), double(without.device_bytes - open.device_bytes) / 1.02,
              0.01 * peak_without);
  EXPECT_GT(double(without.device_bytes - open.device_bytes),
            8.0 * double(pair.fixed.grid.count()));

  // The step is left out before images are cut, and before the way back uses its memory.
  MotionPlan whole = with;
  ASSERT_TRUE(fit_into(whole, {without.device_bytes}));
  EXPECT_FALSE(has_sliding_step(whole));
  EXPECT_EQ(whole.slabs, 1);
  options = preset("balanced");
  options.backward = options.cyclic = true;
  const auto memory = [&](uint64_t bytes) {
    const auto opened = SequenceEstimator::open(small_device(bytes), pair.fixed.grid, options,
                                                [](const PairMotion&) {});
    EXPECT_TRUE(opened);
    return opened ? (*opened)->memory() : MemoryEstimate{};
  };
  EXPECT_TRUE(memory(with.device_bytes).sliding);
  EXPECT_FALSE(memory(with.device_bytes).backward);
  EXPECT_FALSE(memory(without.device_bytes).sliding);

  ASSERT_TRUE(fit_into(with, {with.device_bytes * 8 / 10}));
  EXPECT_FALSE(has_sliding_step(with));
  EXPECT_EQ(with.field.size, without.field.size);
}

/// With a finest level that yields, the second window gets the same sums too.
TEST_F(SolverSlabs, GiveTheSameFieldWhereTheWindowYields) {
  const MadePair pair = wave_pair(plain_grid({40, 44, 150}), 0.8, 18.0);
  EstimatorOptions options = preset("balanced");
  options.motion.yield.window = 2.5;
  // The step needs whole images.
  options.motion.sliding.cell = 0;
  const PairMotion whole = motion_of(pair.fixed, pair.moving, options);
  const uint64_t needed = plan_motion(pair.fixed.grid, options.motion).device_bytes;
  const auto device = small_device(needed * 8 / 10);
  const Result<PairMotion> cut = estimate_motion(device, pair.fixed, pair.moving, options);
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_LE(device->memory_peak_bytes(), needed * 8 / 10);
  const Result<Distances> apart = endpoint_error(cut->field, whole.field);
  ASSERT_TRUE(apart);
  EXPECT_LT(apart->voxels.mean, kSameMeanVoxels);
  EXPECT_LT(apart->voxels.p99, kSameP99Voxels);
}

/// The way back must not cost anything else: it is left out before images are cut for it.
TEST_F(SolverSlabs, LeaveTheWayBackOutWhereItDoesNotFit) {
  const MadePair pair = tall_pair();
  EstimatorOptions options = preset("balanced");
  const auto memory = [&](const auto& device) {
    const auto opened =
        SequenceEstimator::open(device, pair.fixed.grid, options, [](const PairMotion&) {});
    EXPECT_TRUE(opened);
    return opened ? (*opened)->memory() : MemoryEstimate{};
  };
  const uint64_t needed = memory(context()).device_bytes;
  options.backward = true;
  const MemoryEstimate both = memory(context());
  EXPECT_TRUE(both.backward);
  EXPECT_GT(both.device_bytes, needed);
  const MemoryEstimate one = memory(small_device(needed));
  EXPECT_FALSE(one.backward);
  EXPECT_EQ(one.slabs, 1);
  EXPECT_FALSE(estimate_motion(small_device(needed), pair.fixed, pair.moving, options)->backward);

  const auto device = small_device(both.device_bytes);
  const Result<PairMotion> whole = estimate_motion(device, pair.fixed, pair.moving, options);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_TRUE(whole->backward);
  EXPECT_LE(device->memory_peak_bytes(), both.device_bytes);
}

/// Voxels outside a mask count for nothing there too, and those beside its border do.
TEST_F(SolverSlabs, GiveTheSameFieldInAMask) {
  const MadePair pair = tall_pair();
  EstimatorOptions options = preset("balanced");
  options.motion.sliding.cell = 0;
  const Grid& grid = pair.fixed.grid;
  Mask& mask = options.mask.emplace(grid, std::vector<uint8_t>(grid.count()));
  for (int k = 30; k < 120; ++k)
    for (int j = 8; j < 38; ++j)
      for (int i = 6; i < 30 + k / 20; ++i) mask.values[grid.offset(i, j, k)] = 1;
  const PairMotion whole = motion_of(pair.fixed, pair.moving, options);
  const uint64_t needed = plan_motion(grid, options.motion).device_bytes;
  const auto device = small_device(needed * 7 / 10);
  const Result<PairMotion> cut = estimate_motion(device, pair.fixed, pair.moving, options);
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_LE(device->memory_peak_bytes(), needed * 7 / 10);
  const Result<Distances> apart = endpoint_error(cut->field, whole.field);
  ASSERT_TRUE(apart);
  EXPECT_LT(apart->voxels.mean, kSameMeanVoxels);
  EXPECT_LT(apart->voxels.p99, kSameP99Voxels);
}

/// Only slabs between which something moves are compared, and only where there is work.
TEST_F(SolverSlabs, AreComparedAsFarAsThingsMove) {
  MotionPlan plan =
      plan_motion(plain_grid({40, 44, 150}), without_sliding_step(preset("fast").motion));
  ASSERT_TRUE(fit_into(plan, {plan.device_bytes * 6 / 10}));
  const std::vector<Slab> slabs = slabs_of(plan);
  ASSERT_GE(slabs.size(), 4U);
  const int owned = slabs[0].end;
  const auto kernels = std::make_shared<MotionKernels>(context());
  const SlabImages images(context(), kernels, plan, whole_region(plan));
  const FramePyramid fixed(context(), plan), moving(context(), plan);
  const auto pairs = [&](const BrickList& bricks, double reach) {
    vulkan::Recorder recorder(context(), uint32_t(SlabImages::most_dispatches(plan)));
    std::vector<std::pair<int, int>> found;
    images.record_pairs(
        recorder, fixed, moving, bricks, reach,
        [&](const vulkan::Image&, const vulkan::Image&, const Slab& a, const Slab& b) {
          found.emplace_back(a.begin / owned, b.begin / owned);
        });
    recorder.run();
    std::sort(found.begin(), found.end());
    return found;
  };
  const BrickList all = all_bricks(plan.levels[0].cells);
  std::vector<std::pair<int, int>> every, near;
  for (int a = 0; a < int(slabs.size()); ++a)
    for (int b = 0; b < int(slabs.size()); ++b) {
      every.emplace_back(a, b);
      if (std::abs(a - b) <= 1) near.emplace_back(a, b);
    }
  EXPECT_EQ(pairs(all, std::numeric_limits<double>::infinity()), every);
  EXPECT_EQ(pairs(all, owned - 1.0), near);
  BrickList lowest;
  for (const uint32_t brick : all)
    if (unpacked(brick).z == 0) lowest.push_back(brick);
  const int work_ends = 8 * plan.levels[0].cell.z;
  std::erase_if(near, [&](const auto& pair) { return pair.first * owned >= work_ends; });
  EXPECT_EQ(pairs(lowest, 1.0), near);
}

/// Pure arithmetic: what the largest image and the memory that device and host share leave.
TEST_F(SolverSlabs, FitIntoTheLargestImageAndTheSharedMemory) {
  const MotionOptions options = without_sliding_step(*motion_preset("fast"));
  const auto planned = [&](int size) { return plan_motion(plain_grid(glm::ivec3(size)), options); };
  const uint64_t gib = uint64_t(1) << 30;
  MotionPlan plan = planned(472);
  EXPECT_TRUE(fit_into(plan, {64 * gib, gib}));
  EXPECT_EQ(plan.slabs, 1);
  EXPECT_EQ(plan.host_bytes, 0U);
  EXPECT_TRUE(fit_into(plan = planned(600), {64 * gib, gib}));
  EXPECT_EQ(plan.slabs, 2);
  EXPECT_LE(plan.largest_image_bytes, gib);
  // Both frames as halves, and the slices that slabs share.
  const double halves = 4.0 * double(plan.image.count());
  EXPECT_GE(double(plan.host_bytes), halves);
  EXPECT_LE(double(plan.host_bytes), 1.05 * halves);

  const uint64_t both = plan.device_bytes + plan.host_bytes - 1;
  EXPECT_TRUE(fit_into(plan = planned(600), {64 * gib, gib, both}));
  EXPECT_GT(plan.slabs, 2);
  EXPECT_LE(plan.device_bytes + plan.host_bytes, both);
  // The next coarser level alone is too large.
  EXPECT_FALSE(fit_into(plan = planned(1200), {64 * gib, gib}));
  EXPECT_GT(plan.largest_image_bytes, gib);
  EXPECT_TRUE(fit_into(plan = planned(1024), {64 * gib, gib}));
  EXPECT_EQ(plan.largest_image_bytes, gib);
}

TEST_F(SolverSlabs, AnswerForEverySliceOnce) {
  for (const int slices : {33, 64, 150, 151}) {
    MotionPlan plan = plan_motion(plain_grid({40, 44, slices}), *motion_preset("balanced"));
    for (plan.slabs = 1; plan.slabs < 6; ++plan.slabs) {
      SCOPED_TRACE(std::to_string(slices) + " slices in " + std::to_string(plan.slabs));
      int next = 0;
      for (const Slab& slab : slabs_of(plan)) {
        EXPECT_EQ(slab.begin, next);
        next = slab.end;
        EXPECT_LE(slab.first, std::max(0, slab.begin - 1));
        EXPECT_GE(slab.first + slab.depth, std::min(slices, slab.end + 2));
        EXPECT_GE(slab.first, 0);
        EXPECT_LE(slab.first + slab.depth, slices);
      }
      EXPECT_EQ(next, slices);
    }
  }
}

TEST_F(SolverSlabs, SaysSoWhereEvenTheThinnestDoNotFit) {
  const MadePair pair = tall_pair();
  const Result<PairMotion> motion =
      estimate_motion(small_device(1U << 20), pair.fixed, pair.moving, preset("balanced"));
  ASSERT_FALSE(motion);
  EXPECT_EQ(motion.error().kind, ErrorKind::kOutOfMemory);
}

}  // namespace
}  // namespace palpate::test
