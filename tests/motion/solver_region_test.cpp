#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/packing.hpp>

#include "compute/motion/classic.h"
#include "compute/motion/intensity.h"
#include "compute/motion/solver.h"
#include "compute/vulkan/tried.h"
#include "tests/motion/oracle/oracle.h"
#include "tests/motion/solver_test.h"
#include "tests/support/tolerances.h"

/// Estimations of which a mask leaves only a part.
namespace palpate::test {
namespace {

/// A pair and a mask of a cube that is small relative to the frames.
class SolverRegion : public SolverTest {
 protected:
  void make(glm::dvec3 shift_mm, glm::ivec3 begin, glm::ivec3 end, MotionOptions options) {
    AffineMap map;
    map.shift_mm = shift_mm;
    pair = made_pair(plain_grid({112, 80, 72}), map);
    mask = Mask{pair.fixed.grid, std::vector<uint8_t>(pair.fixed.grid.count())};
    oracle::for_each(pair.fixed.grid.size, [&](glm::ivec3 i) {
      mask.values[pair.fixed.grid.offset(i.x, i.y, i.z)] =
          glm::all(glm::greaterThanEqual(i, begin)) && glm::all(glm::lessThan(i, end));
    });
    plan = plan_motion(pair.fixed.grid, options);
    kernels = std::make_shared<MotionKernels>(context());
  }

  FramePyramid prepared(const Volume& frame, const Region& region) {
    const auto [scale, noise] = frame_scale(pair.fixed, 0.0);
    FramePyramid pyramid(context(), plan);
    PyramidBuilder(context(), kernels, plan, region)
        .build(scaled_halves(frame, scale), noise, pyramid);
    return pyramid;
  }

  std::vector<glm::vec4> texels(const FramePyramid& pyramid, size_t l) {
    const glm::ivec3 size = plan.levels[l].image_size;
    const size_t count = size_t(size.x) * size_t(size.y) * size_t(size.z);
    vulkan::Buffer buffer(context(), count * sizeof(uint64_t), vulkan::Buffer::Kind::kHostVisible);
    vulkan::Recorder recorder(context());
    recorder.copy(pyramid.level(l), buffer);
    recorder.run();
    std::vector<glm::vec4> all;
    for (const uint64_t packed : buffer.as<uint64_t>()) all.push_back(glm::unpackHalf4x16(packed));
    return all;
  }

  MadePair pair;
  Mask mask;
  MotionPlan plan;
  std::shared_ptr<MotionKernels> kernels;
};

TEST_F(SolverRegion, PreparesTheSameTexelsInItsBoxAndNothingAround) {
  MotionOptions options = *motion_preset("balanced");
  options.search_mm = 9.0;
  make({1.0, 2.0, -1.0}, {70, 50, 50}, {80, 60, 60}, options);
  const Region region = region_of(plan, mask);
  const FramePyramid whole = prepared(pair.moving, with_whole_images(plan, region));
  const FramePyramid part = prepared(pair.moving, region);
  EXPECT_TRUE(std::isinf(whole.reach_mm()));
  EXPECT_DOUBLE_EQ(part.reach_mm(), 9.0);
  size_t around = 0;
  for (size_t l = 0; l < plan.levels.size(); ++l) {
    SCOPED_TRACE(l);
    const std::vector<glm::vec4> a = texels(whole, l), b = texels(part, l);
    const VoxelBox& box = region.levels[l].voxels;
    size_t at = 0, different = 0, marked = 0, outside = 0;
    oracle::for_each(plan.levels[l].image_size, [&](glm::ivec3 i) {
      const bool inside =
          glm::all(glm::greaterThanEqual(i, box.begin)) && glm::all(glm::lessThan(i, box.end));
      if (inside) {
        different += a[at] != b[at];
      } else {
        ++outside;
        marked += std::isinf(b[at].x);
      }
      ++at;
    });
    EXPECT_EQ(different, 0U);
    EXPECT_EQ(marked, outside);
    around += outside;
  }
  EXPECT_GT(around, pair.fixed.grid.count() / 4);
}

TEST_F(SolverRegion, FindsTheSameFieldInItsBricksAsWithWholeImages) {
  MotionOptions options = *motion_preset("balanced");
  options.search_mm = 9.0;
  make({3.0, 2.0, -1.0}, {70, 10, 10}, {80, 20, 20}, options);
  const Region region = region_of(plan, mask);
  Field found[2];
  for (const bool whole : {false, true}) {
    const Region with = whole ? with_whole_images(plan, region) : region;
    const FramePyramid fixed = prepared(pair.fixed, with), moving = prepared(pair.moving, with);
    PairSolver solver(context(), kernels, plan, region);
    const auto report = solver.solve(fixed, moving, {}, {});
    ASSERT_TRUE(report);
    EXPECT_FALSE(report->out_of_reach);
    Confidence confidence;
    solver.download(found[whole], confidence);
  }
  ASSERT_EQ(found[0].u_mm.size(), found[1].u_mm.size());
  for (size_t i = 0; i < found[0].u_mm.size(); ++i) EXPECT_EQ(found[0].u_mm[i], found[1].u_mm[i]);
}

// On devices that load single texels from storage images, the result equals that of fetches.
TEST_F(SolverRegion, FindsTheSameFieldHoweverTexelsAreRead) {
  for (const char* preset : {"balanced", "classic"}) {
    MotionOptions options = *motion_preset(preset);
    options.search_mm = 9.0;
    for (LevelOptions& level : options.levels) level.iterations = std::min(level.iterations, 7);
    make({3.0, 2.0, -1.0}, {20, 20, 20}, {84, 52, 52}, options);
    const Region region = region_of(plan, mask);
    Field found[2];
    for (const bool suits : {false, true}) {
      kernels = std::make_shared<MotionKernels>(
          context(), suits ? MotionKernels::Texels::kAsSuits : MotionKernels::Texels::kFetched);
      const FramePyramid fixed = prepared(pair.fixed, region);
      const FramePyramid moving = prepared(pair.moving, region);
      std::unique_ptr<FieldSolver> solver;
      if (options.method == MotionMethod::kClassic)
        solver = std::make_unique<ClassicSolver>(context(), kernels, plan);
      else
        solver = std::make_unique<PairSolver>(context(), kernels, plan, region);
      ASSERT_TRUE(solver->solve(fixed, moving, {}, {}));
      Confidence confidence;
      solver->download(found[suits], confidence);
    }
    EXPECT_TRUE(found[0].u_mm == found[1].u_mm) << preset;
    EXPECT_GT(glm::length(found[0].u_mm[found[0].u_mm.size() / 2]), 0.1F) << preset;
  }
}

// Levels begin without a wait. The validation layers tell of images that are deleted in use.
TEST_F(SolverRegion, LeavesNoWorkThatReadsTheFramesWhenASubmissionFails) {
  MotionOptions options = *motion_preset("fast");
  options.search_above = 0.0;  // so that all cells are compared with rest, which reads the frames
  make({3.0, 2.0, -1.0}, {20, 20, 20}, {84, 52, 52}, options);
  const Region region = region_of(plan, mask);
  int submissions_left = 1 << 20;
  vulkan::SharedDevice shared{context()->instance(), context()->physical_device(),
                              context()->device(), context()->queue_family(), context()->queue()};
  shared.lock_queue = [&]() -> Status {
    if (submissions_left-- > 0) return Nothing{};
    return Error{ErrorKind::kDeviceFailed, "locking a queue that is gone"};
  };
  shared.unlock_queue = [] {};
  const auto own = vulkan::Context::share(shared);
  ASSERT_TRUE(own);
  kernels = std::make_shared<MotionKernels>(*own);
  const auto [scale, noise] = frame_scale(pair.fixed, 0.0);
  PyramidBuilder builder(*own, kernels, plan, region);
  PairSolver solver(*own, kernels, plan, region);
  int failed = 0;
  for (int allowed = 1; allowed <= 12; ++allowed) {
    submissions_left = 1 << 20;
    FramePyramid fixed(*own, plan), moving(*own, plan);
    builder.build(scaled_halves(pair.fixed, scale), noise, fixed);
    builder.build(scaled_halves(pair.moving, scale), noise, moving);
    submissions_left = allowed;
    failed += !vulkan::tried([&] { (void)solver.solve(fixed, moving, {}, {}); });
  }
  EXPECT_EQ(failed, 12);
}

TEST_F(SolverRegion, SaysSoWhenSomethingMovesOutOfReachAndTheEstimatorPreparesMore) {
  MotionOptions options = *motion_preset("balanced");
  options.search_mm = 6.0;
  make({9.5, 0.0, 0.0}, {60, 20, 20}, {84, 52, 52}, options);
  const Region region = region_of(plan, mask);
  ASSERT_LT(region.reach_mm, 9.5);
  const FramePyramid fixed = prepared(pair.fixed, region), moving = prepared(pair.moving, region);
  const auto report = PairSolver(context(), kernels, plan, region).solve(fixed, moving, {}, {});
  ASSERT_TRUE(report);
  EXPECT_TRUE(report->out_of_reach);

  // With the way back, so that both a former fixed and a former moving frame are prepared again.
  EstimatorOptions masked;
  masked.motion = options;
  masked.mask = mask;
  masked.cyclic = true;
  std::vector<PairMotion> motions;
  double before = 0.0;
  size_t begun_again = 0;
  auto estimator = SequenceEstimator::open(
      context(), pair.fixed.grid, masked,
      [&](PairMotion motion) { motions.push_back(std::move(motion)); },
      [&](size_t fixed_frame, size_t, double share) {
        begun_again += fixed_frame == 0 && share < before;
        before = fixed_frame == 0 ? share : 0.0;
      });
  ASSERT_TRUE(estimator);
  ASSERT_TRUE((*estimator)->push(0, pair.fixed));
  ASSERT_TRUE((*estimator)->push(1, pair.moving));
  ASSERT_TRUE((*estimator)->finish());
  ASSERT_EQ(motions.size(), 2U);
  EXPECT_EQ(begun_again, 1U);
  for (const PairMotion& motion : motions) EXPECT_FALSE(motion.report.out_of_reach);
  for (PairMotion& motion : motions) {
    const Result<Distances> error = endpoint_error(motion.field, pair.truth, &mask);
    ASSERT_TRUE(error);
    EXPECT_LT(error->voxels.mean, kRigidMean);
    for (glm::vec3& u : pair.truth.u_mm) u = -u;
  }
}

TEST_F(SolverRegion, CostsTheBricksThatCountAndIsAsExactThere) {
  make({2.5, -1.5, 0.7}, {68, 36, 36}, {92, 60, 60}, *motion_preset("balanced"));
  EstimatorOptions options;
  options.motion = *motion_preset("balanced");
  const PairMotion whole = motion_of(pair.fixed, pair.moving, options);
  options.mask = mask;
  const PairMotion part = motion_of(pair.fixed, pair.moving, options);
  // The cube and a cell of 4 voxels around it need one of the finest level's 4 x 3 x 3 bricks.
  const LevelReport &most = whole.report.levels.back(), &less = part.report.levels.back();
  EXPECT_GE(most.brick_iterations, 36.0);
  EXPECT_LE(less.brick_iterations, 1.0 * less.iterations);
  EXPECT_EQ(less.all_brick_iterations, most.all_brick_iterations);
  const Result<Distances> error = endpoint_error(part.field, pair.truth, &mask);
  ASSERT_TRUE(error);
  EXPECT_LT(error->voxels.mean, kRigidMean);
  EXPECT_LT(error->voxels.p95, kRigidP95);
}

}  // namespace
}  // namespace palpate::test
