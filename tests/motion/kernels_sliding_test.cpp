#include <algorithm>
#include <cmath>

#include "compute/motion/repair.h"
#include "tests/motion/kernel_test.h"

/// The kernels of the step for sliding borders, against their oracles.
namespace palpate::test {
namespace {

using oracle::Scalars;
using oracle::Texels;
using oracle::Vectors;

constexpr int kCandidates = 6 * shaders::kSlidingSteps;

Scalars stored_scalars(glm::ivec3 size, uint32_t seed, double low, double high) {
  return scalars_of(as_stored(texels_of(random_scalars(size, seed, low, high)), Format::kR16));
}

/// Two frames as the device stores them, with or without a mask on the fixed one.
struct Frames {
  Frames(glm::ivec3 size, uint32_t seed, bool masked)
      : fixed(stored_scalars(size, seed, 0.0, 1.0)),
        moving(stored_scalars(size, seed + 1, 0.0, 1.0)),
        packed(as_stored(random_texels(size, seed + 2), Format::kRgba16)) {
    if (!masked) return;
    const Scalars mask = random_mask(size, seed + 3, 0.7);
    for (size_t i = 0; i < packed.values.size(); ++i)
      if (mask.values[i] == 0.0) packed.values[i] = glm::dvec4(glm::dvec3(oracle::kOutside), 0.5);
  }
  Scalars fixed, moving;
  Texels packed;
};

class SlidingKernelTest : public KernelTest {};
class SlidingMomentsKernel : public SlidingKernelTest {};
class SlidingCostKernel : public SlidingKernelTest {};
class SlidingFindKernel : public SlidingKernelTest {};
class SlidingChoiceKernels : public SlidingKernelTest {};
class BlendAlongKernel : public SlidingKernelTest {};
class MedianKernel : public SlidingKernelTest {};
class FoldRepairOfBorders : public SlidingKernelTest {
 protected:
  /// Repairs a field and returns the rounds; along: as in repair_folds().
  int expect_no_fold_after_repair(const LevelPlan& level, const Vectors& field, int along) {
    DeviceImage u = put(texels_of(field), Format::kRgba32);
    DeviceImage other = put(texels_of(field), Format::kRgba32);
    const DeviceImage flags = output(level.cells, Format::kRgba16);
    const BrickList bricks = all_bricks(level.cells);
    vulkan::Buffer list = upload_bricks(context(), bricks);
    vulkan::Buffer counts(context(), bricks.size() * sizeof(uint32_t),
                          vulkan::Buffer::Kind::kHostVisible);
    vulkan::Recorder recorder(context());
    SolveReport report;
    repair_folds(recorder, *kernels(), level, 0.01, along,
                 {u.image, other.image, flags.image, list, counts}, bricks, report);
    EXPECT_EQ(report.folded_cells, 0U);
    const Scalars smallest = oracle::folds(vectors_of(get(u)), level.cell, level.image_size,
                                           level.spacing_mm, level.cell != glm::ivec3(1));
    EXPECT_GT(*std::min_element(smallest.values.begin(), smallest.values.end()), 0.0099);
    return report.repaired;
  }
};
class UpsampleCubicKernel : public SlidingKernelTest {};

TEST_F(SlidingMomentsKernel, AreTheMeansOfWhatTheFieldBringsTogether) {
  uint32_t seed = 2000;
  const glm::dvec3 spacing_mm(0.8, 1.0, 1.6);
  for (const glm::ivec3 size : kSizes) {
    for (const glm::ivec3 cell : {glm::ivec3(4, 4, 2), glm::ivec3(1, 4, 4), glm::ivec3(3)}) {
      for (const bool masked : {false, true}) {
        SCOPED_TRACE(text(size) + " cells of " + text(cell) + (masked ? " with a mask" : ""));
        const Frames frames(size, seed += 10, masked);
        const glm::ivec3 cells = oracle::cells_of(size, cell);
        const Vectors field = stored_vectors(cells, seed + 5, 2.0);
        const Texels expected = oracle::sliding_moments(frames.fixed, frames.moving, frames.packed,
                                                        field, cell, spacing_mm);
        const BrickList bricks = all_bricks(cells);
        const vulkan::Buffer list = upload_bricks(context(), bricks);
        const DeviceImage f = put(texels_of(frames.fixed), Format::kR16);
        const DeviceImage m = put(texels_of(frames.moving), Format::kR16);
        const DeviceImage u = put(texels_of(field), Format::kRgba32);
        const DeviceImage packed = put(frames.packed, Format::kRgba16);
        const DeviceImage to = output(cells, Format::kRgba32);
        dispatch(kernels()->sliding_moments(),
                 {list, nearest(f), linear(m), linear(u), nearest(packed), to.image},
                 shaders::SlidingMomentsPush{glm::ivec4(cells, 0), glm::ivec4(cell, 0),
                                             glm::ivec4(size, 0), glm::vec4(spacing_mm, 0)},
                 slice_groups(bricks));
        // The partner's place has the rounding of the interpolated field.
        expect_all(to, expected, 4, 4.0, 10.0 * sampling_tolerance());
      }
    }
  }
}

TEST_F(SlidingCostKernel, IsTheCutSquaredDifferenceByTheMotionOfEachCandidate) {
  uint32_t seed = 2500;
  const glm::ivec3 cell(2, 2, 1), coarse_cell(4, 4, 2), step(2, 1, 2);
  oracle::SlidingCost with{cell, coarse_cell, {0.8, 1.0, 1.6}, 0.4, 0.1};
  size_t judged = 0, left_out = 0;
  for (const glm::ivec3 size : kSizes) {
    for (const bool masked : {false, true}) {
      SCOPED_TRACE(text(size) + (masked ? " with a mask" : ""));
      const Frames frames(size, seed += 10, masked);
      const glm::ivec3 cells = oracle::cells_of(size, cell);
      const glm::ivec3 coarse = oracle::cells_of(size, coarse_cell);
      const Vectors field = stored_vectors(cells, seed + 5, 3.0);
      const Texels moments =
          as_stored(oracle::sliding_moments(frames.fixed, frames.moving, frames.packed,
                                            stored_vectors(coarse, seed + 6, 2.0), coarse_cell,
                                            with.spacing_mm),
                    Format::kRgba32);
      const BrickList bricks = every_second_brick(cells);
      const vulkan::Buffer list = upload_bricks(context(), bricks);
      const DeviceImage f = put(texels_of(frames.fixed), Format::kR16);
      const DeviceImage m = put(texels_of(frames.moving), Format::kR16);
      const DeviceImage u = put(texels_of(field), Format::kRgba32);
      const DeviceImage means = put(moments, Format::kRgba32);
      const DeviceImage packed = put(frames.packed, Format::kRgba16);
      // Judged alone, a cell without a candidate across a border has cost 0.
      const oracle::AcrossBorder across{step, with.spacing_mm * glm::dvec3(cell), 4.0, 1.2};
      for (const auto& [first, alone] : {std::pair(-1, false),
                                         {0, false},
                                         {4, false},
                                         {8, false},
                                         {20, false},
                                         {-1, true},
                                         {4, true},
                                         {20, true}}) {
        SCOPED_TRACE("first candidate " + std::to_string(first) + (alone ? ", alone" : ""));
        Texels expected(cells);
        for (int c = 0; c < 4; ++c) {
          Vectors v = field;
          if (first >= 0) {
            oracle::for_each(cells, [&](glm::ivec3 i) {
              v.at(i) = field.held(i + oracle::candidate_offset(first + c, step));
            });
          }
          const Scalars cost = oracle::sliding_cost(frames.fixed, frames.moving, frames.packed,
                                                    moments, field, v, with);
          for (size_t i = 0; i < cost.values.size(); ++i) expected.values[i][c] = cost.values[i];
        }
        if (alone) {
          oracle::for_each(cells, [&](glm::ivec3 i) {
            bool may = false;
            for (int c = std::max(0, first); c < (first < 0 ? kCandidates : first + 4); ++c)
              may = may || oracle::has_candidate(field, i, c, across);
            if (!may) expected.at(i) = glm::dvec4(0.0);
            (may ? judged : left_out) += 1;
          });
        }
        const DeviceImage to = output(cells, Format::kRgba16);
        dispatch(
            kernels()->sliding_cost(first < 0, alone),
            {list, nearest(f), linear(m), nearest(u), linear(means), nearest(packed), to.image},
            shaders::SlidingCostPush{glm::ivec4(cells, 0),
                                     glm::ivec4(cell, 0),
                                     glm::ivec4(size, 0),
                                     glm::vec4(with.spacing_mm, 1.0 / (with.limit * with.limit)),
                                     glm::ivec4(coarse * coarse_cell, 0),
                                     glm::ivec4(step, first),
                                     {float(with.noise * with.noise), 0, 0, 0},
                                     {float(across.apart_mm), float(across.slope), 0, 0}},
            slice_groups(bricks));
        // A squared difference divided by limit^2 has more than ten times the error of the sample.
        expect_cells(to, expected, bricks, 4, 1.0, 100.0 * sampling_tolerance());
      }
    }
  }
  EXPECT_GT(judged, 100U);
  EXPECT_GT(left_out, 100U);
}

/// A candidate that fits better is taken, and the best one of them. One on the same side of the
/// border, or outside the field, is not.
TEST_F(SlidingChoiceKernels, TakeTheBestCandidateFromAcrossABorder) {
  uint32_t seed = 3000;
  const float share = 0.2F, least = 0.02F, noise = 0.3F;
  size_t taken = 0, kept = 0;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    const oracle::AcrossBorder with{{1, 2, 1}, {1.0, 2.0, 1.5}, 3.0, 0.9};
    const Vectors field = stored_vectors(cells, seed += 10, 3.0);
    const Scalars own =
        scalars_of(as_stored(texels_of(random_scalars(cells, seed + 1, 0.2, 1.0)), Format::kR16));
    std::vector<Texels> costs;
    for (int first = 0; first < kCandidates; first += 4) {
      Texels four(cells);
      for (size_t i = 0; i < four.values.size(); ++i) four.values[i] = glm::dvec4(0.0);
      for (int c = 0; c < 4; ++c) {
        const Scalars cost = random_scalars(cells, seed + 100 + uint32_t(first + c), 0.1, 1.0);
        for (size_t i = 0; i < four.values.size(); ++i) four.values[i][c] = cost.values[i];
      }
      costs.push_back(as_stored(four, Format::kRgba16));
    }
    // What is expected.
    Vectors expected = field;
    const glm::ivec3 n = brick_count(cells);
    std::vector<uint32_t> work(size_t(n.x * n.y * n.z));
    const BrickList bricks = all_bricks(cells);
    Scalars to_beat_stored(cells);
    for (size_t i = 0; i < own.values.size(); ++i)
      to_beat_stored.values[i] =
          own.values[i] - std::max(double(share) * own.values[i], double(least));
    to_beat_stored = scalars_of(as_stored(texels_of(to_beat_stored), Format::kR16));
    oracle::for_each(cells, [&](glm::ivec3 i) {
      const double to_beat = to_beat_stored.at(i);
      double best = to_beat;
      for (int c = 0; c < kCandidates; ++c) {
        if (!oracle::has_candidate(field, i, c, with)) continue;
        if (to_beat > double(noise)) {
          const glm::ivec3 b = i / shaders::kBrick;
          for (size_t k = 0; k < bricks.size(); ++k)
            if (unpacked(bricks[k]) == b) work[k] |= 1U << c;
        }
        const double cost = costs[size_t(c / 4)].at(i)[c % 4];
        if (cost >= best) continue;
        best = cost;
        expected.at(i) = field.at(i + oracle::candidate_offset(c, with.step));
      }
      (expected.at(i) == field.at(i) ? kept : taken) += 1;
    });

    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage u = put(texels_of(field), Format::kRgba32);
    Texels own_texels(cells);
    for (size_t i = 0; i < own.values.size(); ++i)
      own_texels.values[i] = glm::dvec4(own.values[i], 0.0, 0.0, 0.0);
    const DeviceImage cost = put(own_texels, Format::kRgba16);
    const DeviceImage chosen = output(cells, Format::kRgba16);
    vulkan::Buffer found(context(), bricks.size() * sizeof(uint32_t),
                         vulkan::Buffer::Kind::kHostVisible);
    std::fill(found.as<uint32_t>().begin(), found.as<uint32_t>().end(), 0U);
    const glm::vec4 different(float(with.apart_mm), float(with.slope), 0, 0);
    dispatch(kernels()->sliding_work(), {list, nearest(cost), nearest(u), chosen.image, found},
             shaders::SlidingWorkPush{glm::ivec4(cells, 0),
                                      glm::ivec4(with.step, 0),
                                      {share, least, noise, 0},
                                      glm::vec4(with.cell_mm, 0),
                                      different},
             slice_groups(bricks));
    for (size_t k = 0; k < bricks.size(); ++k)
      EXPECT_EQ(found.as<uint32_t>()[k], work[k]) << "brick " << k;
    for (int first = 0; first < kCandidates; first += 4) {
      const DeviceImage four = put(costs[size_t(first / 4)], Format::kRgba16);
      dispatch(kernels()->sliding_choose(),
               {list, nearest(four), nearest(chosen), chosen.image, nearest(u)},
               shaders::SlidingChoosePush{glm::ivec4(cells, first), glm::ivec4(with.step, 0),
                                          glm::vec4(with.cell_mm, 0), different},
               slice_groups(bricks));
    }
    const DeviceImage to = output(cells, Format::kRgba32);
    dispatch(kernels()->sliding_take(), {list, nearest(chosen), nearest(u), to.image},
             shaders::SlidingTakePush{glm::ivec4(cells, 0), glm::ivec4(with.step, 0)},
             slice_groups(bricks));
    expect_all(to, texels_of(expected), 3, 3.0);
  }
  EXPECT_GT(taken, 500U);
  EXPECT_GT(kept, 100U);
}

TEST_F(SlidingFindKernel, TellsCandidatesAndSlopesOfEachBrickOfTheFinerCells) {
  uint32_t seed = 3300;
  for (const glm::ivec3 cells : kSizes) {
    for (const glm::ivec3 ratio : {glm::ivec3(2), glm::ivec3(2, 2, 1)}) {
      SCOPED_TRACE(text(cells) + " ratio " + text(ratio));
      const oracle::AcrossBorder with{{1, 2, 1}, {1.0, 2.0, 1.5}, 6.0, 1.2};
      const Vectors field = stored_vectors(cells, seed += 10, 3.0);
      const glm::ivec3 bricks = brick_count(cells * ratio);
      const auto count = size_t(bricks.x * bricks.y * bricks.z);
      std::vector<uint32_t> candidates(count);
      std::vector<double> steepest(count);
      oracle::for_each(cells, [&](glm::ivec3 i) {
        const glm::ivec3 b = i * ratio / shaders::kBrick;
        const auto n = size_t(b.x + bricks.x * (b.y + bricks.y * b.z));
        for (int c = 0; c < kCandidates; ++c)
          if (oracle::has_candidate(field, i, c, with)) candidates[n] |= 1U << c;
        for (int axis = 0; axis < 3; ++axis) {
          glm::ivec3 next = i;
          ++next[axis];
          const double slope = glm::length(field.held(next) - field.at(i)) / with.cell_mm[axis];
          steepest[n] = std::max(steepest[n], slope * slope);
        }
      });
      const BrickList listed = all_bricks(cells);
      const vulkan::Buffer list = upload_bricks(context(), listed);
      const DeviceImage u = put(texels_of(field), Format::kRgba32);
      vulkan::Buffer found(context(), 2 * count * sizeof(uint32_t),
                           vulkan::Buffer::Kind::kHostVisible);
      std::fill(found.as<uint32_t>().begin(), found.as<uint32_t>().end(), 0U);
      dispatch(kernels()->sliding_find(), {list, nearest(u), found},
               shaders::SlidingFindPush{glm::ivec4(cells, 0),
                                        glm::ivec4(ratio, 0),
                                        glm::ivec4(bricks, 0),
                                        glm::ivec4(with.step, 0),
                                        glm::vec4(with.cell_mm, 0),
                                        {float(with.apart_mm), float(with.slope), 0, 0}},
               slice_groups(listed));
      for (size_t n = 0; n < count; ++n) {
        EXPECT_EQ(found.as<uint32_t>()[2 * n], candidates[n]) << "brick " << n;
        EXPECT_NEAR(found.as<float>()[2 * n + 1], steepest[n], 1e-5 * steepest[n]) << "brick " << n;
      }
    }
  }
}

TEST_F(BlendAlongKernel, SmoothsAlongTheJumpAndKeepsTheRestAndTheConfidence) {
  uint32_t seed = 3500;
  const glm::dvec3 cell_mm(1.0, 2.0, 1.5);
  for (const glm::ivec3 cells : kSizes) {
    for (const int length : {1, 3}) {
      SCOPED_TRACE(text(cells) + " length " + std::to_string(length));
      const Vectors field = stored_vectors(cells, seed += 10, 5.0);
      const Scalars confidence = scalars_of(
          as_stored(texels_of(random_scalars(cells, seed + 2, 0.0, 1.0)), Format::kRgba32));
      const Scalars flags = random_mask(cells, seed + 1, 0.02);
      Texels texels = texels_of(field);
      Texels expected = texels_of(oracle::blend_along(flags, field, cell_mm, length));
      for (size_t i = 0; i < texels.values.size(); ++i)
        texels.values[i].w = expected.values[i].w = confidence.values[i];
      const BrickList bricks = all_bricks(cells);
      const vulkan::Buffer list = upload_bricks(context(), bricks);
      const DeviceImage f = put(texels_of(flags), Format::kRgba16);
      const DeviceImage u = put(texels, Format::kRgba32);
      const DeviceImage to = output(cells, Format::kRgba32);
      dispatch(kernels()->blend_along(), {list, nearest(f), linear(u), to.image, nearest(u)},
               shaders::BlendAlongPush{glm::ivec4(cells, length), glm::vec4(cell_mm, 0)},
               slice_groups(bricks));
      expect_all(to, expected, 4, 5.0, 10.0 * sampling_tolerance());
    }
  }
}

/// A border that is ragged by single cells becomes straight, and its jump stays.
TEST_F(MedianKernel, TakesTheVectorMedianWhereACellTouchesAFlaggedOne) {
  uint32_t seed = 3700;
  size_t taken = 0, kept = 0;
  for (const glm::ivec3 cells : kSizes) {
    SCOPED_TRACE(text(cells));
    const Vectors field = stored_vectors(cells, seed += 10, 5.0);
    const Scalars flags = random_mask(cells, seed + 1, 0.02);
    Texels texels = texels_of(field);
    for (size_t i = 0; i < texels.values.size(); ++i) texels.values[i].w = i % 2 ? 1.0 : 0.25;
    const BrickList bricks = all_bricks(cells);
    const vulkan::Buffer list = upload_bricks(context(), bricks);
    const DeviceImage f = put(texels_of(flags), Format::kRgba16);
    const DeviceImage u = put(texels, Format::kRgba32);
    const DeviceImage to = output(cells, Format::kRgba32);
    dispatch(kernels()->median(), {list, nearest(f), nearest(u), to.image},
             shaders::MedianPush{glm::ivec4(cells, 0)}, slice_groups(bricks));
    const Texels actual = get(to);
    oracle::for_each(cells, [&](glm::ivec3 i) {
      EXPECT_EQ(actual.at(i).w, texels.at(i).w) << text(i);
      if (!oracle::touches(flags, i)) {
        EXPECT_EQ(actual.at(i), texels.at(i)) << text(i);
        return;
      }
      const std::array<double, 7> sums = oracle::distances_around(field, i);
      const double least = *std::min_element(sums.begin(), sums.end());
      bool is_median = false;
      for (size_t m = 0; m < sums.size(); ++m) {
        glm::ivec3 from = i;
        if (m > 0) from[int(m - 1) % 3] += m < 4 ? 1 : -1;
        is_median = is_median || (sums[m] < least * (1.0 + 1e-5) &&
                                  field.held(from) == glm::dvec3(actual.at(i)));
      }
      EXPECT_TRUE(is_median) << text(i);
      (glm::dvec3(actual.at(i)) == field.at(i) ? kept : taken) += 1;
    });
  }
  EXPECT_GT(taken, 100U);
  EXPECT_GT(kept, 10U);
}

/// The rounds that keep borders look at the cells' middles only; at the end there is no fold
/// between them either.
TEST_F(FoldRepairOfBorders, LeavesNoFoldBetweenTheCellsMiddlesEither) {
  LevelPlan level;
  level.image_size = glm::ivec3(48);
  level.cell = glm::ivec3(4);
  level.cells = glm::ivec3(12);
  level.spacing_mm = glm::dvec3(1.0);
  level.cell_mm = glm::dvec3(4.0);
  size_t folded = 0;
  for (uint32_t seed = 4100; seed < 4120; ++seed) {
    SCOPED_TRACE(seed);
    Vectors field = random_vectors(level.cells, seed, 0.6);
    for (glm::dvec3& u : field.values) u *= level.cell_mm;
    folded += size_t(expect_no_fold_after_repair(level, field, 40));
  }
  EXPECT_GT(folded, 20U);
}

/// A jump far longer than a cell, as in volumes of a billion voxels: the ramp in its place is as
/// long.
TEST_F(FoldRepairOfBorders, EndsWithoutAFoldWhereTheMotionJumpsByManyCells) {
  LevelPlan level;
  level.cells = level.image_size = glm::ivec3(160, 24, 24);
  level.cell = glm::ivec3(1);
  level.spacing_mm = level.cell_mm = glm::dvec3(1.0);
  Vectors field(level.cells);
  oracle::for_each(level.cells, [&](glm::ivec3 i) {
    field.at(i) = glm::dvec3(i.x < 80 ? 25.0 : -25.0, 0.3 * i.y, 0.0);
  });
  expect_no_fold_after_repair(level, field, 0);
}

/// Where whole bricks are smoothed, what lies beside them is looked at, too.
TEST_F(FoldRepairOfBorders, LeavesNoFoldBesideTheBricksThatItSmoothed) {
  LevelPlan level;
  level.cells = level.image_size = glm::ivec3(112);
  level.cell = glm::ivec3(1);
  level.spacing_mm = level.cell_mm = glm::dvec3(1.0);
  const Vectors coarse = random_vectors(glm::ivec3(14), 77, 14.0);
  Vectors field(level.cells);
  oracle::for_each(level.cells, [&](glm::ivec3 i) {
    for (int k = 0; k < 8; ++k) {
      const glm::ivec3 corner(k & 1, k >> 1 & 1, k >> 2);
      const glm::dvec3 part = glm::dvec3(i % 8) / 8.0;
      const glm::dvec3 w = glm::mix(1.0 - part, part, glm::dvec3(corner));
      field.at(i) += w.x * w.y * w.z * coarse.held(i / 8 + corner);
    }
  });
  expect_no_fold_after_repair(level, field, 0);
}

TEST_F(UpsampleCubicKernel, IsTheCubicBetweenTheCoarseCells) {
  struct Case {
    glm::ivec3 from, to;
    glm::dvec3 scale, offset;
  };
  for (const Case& c : {Case{{5, 4, 9}, {10, 8, 18}, glm::dvec3(0.5), glm::dvec3(-0.25)},
                        Case{{9, 5, 1}, {18, 5, 1}, {0.5, 1.0, 1.0}, {-0.25, 0.0, 0.0}},
                        Case{{70, 3, 2}, {140, 3, 3}, {0.5, 1.3, 0.7}, {-0.3, -2.0, 1.1}}}) {
    for (const double cubic : {0.0, 0.7, 1.0}) {
      SCOPED_TRACE(text(c.from) + " to " + text(c.to) + " cubic " + std::to_string(cubic));
      const Vectors from = stored_vectors(c.from, 3900, 5.0);
      Texels expected = texels_of(oracle::upsample_cubic(from, c.to, c.scale, c.offset, cubic));
      Texels texels = texels_of(from);
      for (size_t i = 0; i < texels.values.size(); ++i) texels.values[i].w = i % 2 ? 1.0 : 0.25;
      const DeviceImage image = put(texels, Format::kRgba32);
      const DeviceImage to = output(c.to, Format::kRgba32);
      const DeviceImage as_well = output(c.to, Format::kRgba32);
      dispatch(kernels()->upsample_cubic(), {nearest(image), to.image, as_well.image},
               shaders::UpsamplePush{glm::ivec4(c.to, 0), glm::ivec4(c.from, 0),
                                     glm::vec4(c.scale, cubic), glm::vec4(c.offset, 0)},
               rows(c.to));
      // The coordinate of up to 70 cells has 6e-6 cells of fp32 rounding.
      expect_all(to, expected, 3, 5.0, 40.0 * kSingle);
      EXPECT_EQ(get(to).values, get(as_well).values);
      for (const glm::dvec4& texel : get(to).values) {
        EXPECT_GE(texel.w, 0.0);
        EXPECT_LE(texel.w, 1.0);
      }
    }
  }
}

}  // namespace
}  // namespace palpate::test
