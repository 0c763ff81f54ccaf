// One motion for a whole sequence. Oracles: motions in closed form (translations, harmonics, the
// phantom's own); the chained fields of its steps, which must have a larger error.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/quality.h"
#include "compute/motion/quality_inverse.h"
#include "compute/volume/phantom.h"
#include "tests/support/device.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;

Grid small_grid() {
  Grid grid;
  grid.size = {6, 5, 4};
  grid.spacing_mm = {2.0, 2.5, 3.0};
  grid.origin_mm = {-5.0, 3.0, 1.0};
  return grid;
}

Field shift(glm::dvec3 by_mm) {
  Field field = still_field(small_grid());
  for (glm::vec3& u : field.u_mm) u = glm::vec3(by_mm);
  return field;
}

double largest_difference_mm(const Field& a, const Field& b) {
  double largest = 0.0;
  for (size_t n = 0; n < a.u_mm.size(); ++n)
    largest = std::max(largest, double(glm::distance(a.u_mm[n], b.u_mm[n])));
  return largest;
}

TEST(MotionOfSteps, GoesForwardAndBackwardFromItsReference) {
  // Shifts add up: the sum of all steps of a cycle is zero.
  const std::vector<glm::dvec3> at_mm = {
      {0, 0, 0}, {1, 0, 0.5}, {1, 2, 0}, {-1, 1, 0.25}, {0, -1, 0}};
  for (const bool cyclic : {true, false})
    for (size_t reference = 0; reference < at_mm.size(); ++reference) {
      std::vector<Field> steps;
      for (size_t k = 0; k + (cyclic ? 0 : 1) < at_mm.size(); ++k)
        steps.push_back(shift(at_mm[(k + 1) % at_mm.size()] - at_mm[k]));
      const TimeBasis times{{0.0, 1.0, 2.0, 3.0, 4.0}, cyclic ? 5.0 : 0.0, 0};
      const auto motion = motion_of_steps(steps, times, reference);
      ASSERT_TRUE(motion) << motion.error().message;
      EXPECT_EQ(motion->reference, reference);
      for (size_t k = 0; k < at_mm.size(); ++k)
        EXPECT_LT(largest_difference_mm(motion->at_frame(k), shift(at_mm[k] - at_mm[reference])),
                  0.01)
            << reference << " to " << k;
    }
  EXPECT_FALSE(motion_of_steps(std::vector<Field>(3, shift({})), {{0.0, 1.0, 2.0}, 0.0, 0}, 0));
}

TEST(Harmonics, AreFoundExactlyAndTheSameAtUnevenTimes) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    test::Random random(seed);
    const int harmonics = 1 + int(seed % 3), count = 2 * harmonics + 4;
    std::vector<Field> truth;
    for (int c = 0; c < 2 * harmonics + 1; ++c) {
      truth.push_back(still_field(small_grid()));
      for (glm::vec3& u : truth.back().u_mm) u = glm::vec3(random.vector(3.0));
    }
    std::vector<double> times_s;
    std::vector<Field> frames;
    for (int k = 0; k < count; ++k) {
      times_s.push_back(k == 0 ? 0.0 : times_s.back() + random.draw(0.1, 4.0));
      Field field = truth[0];
      for (int h = 1; h <= harmonics; ++h)
        for (size_t n = 0; n < field.u_mm.size(); ++n)
          field.u_mm[n] += float(std::cos(kTau * h * k / count)) * truth[2 * h - 1].u_mm[n] +
                           float(std::sin(kTau * h * k / count)) * truth[2 * h].u_mm[n];
      frames.push_back(std::move(field));
    }
    const double cycle_s = times_s.back() + random.draw(0.1, 4.0);
    SequenceMotion motion;
    motion.basis = {times_s, cycle_s, harmonics};
    motion.terms = harmonics_of(frames, motion.basis);
    const std::vector<Field>& found = motion.terms;
    ASSERT_EQ(found.size(), truth.size());
    for (size_t c = 0; c < truth.size(); ++c)
      EXPECT_LT(largest_difference_mm(found[c], truth[c]), 2e-4)
          << "seed " << seed << " term " << c;
    for (size_t k = 0; k < frames.size(); ++k) {
      EXPECT_LT(largest_difference_mm(motion.at(times_s[k]), frames[k]), 2e-4);
      EXPECT_LT(largest_difference_mm(motion.at(times_s[k] - 3.0 * cycle_s), frames[k]), 2e-4)
          << "periodic";
    }
  }
}

TEST(Harmonics, OfACycleWhoseLastFrameIsTheFirstOnceMoreCountItOnce) {
  std::vector<Field> frames;
  for (int k = 0; k <= 8; ++k) frames.push_back(shift({std::cos(kTau * k / 8), 0.0, 0.0}));
  SequenceMotion motion;
  motion.basis = {{0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0}, 8.001, 1, true};
  motion.terms = harmonics_of(frames, motion.basis);
  EXPECT_LT(largest_difference_mm(motion.terms[1], shift({1.0, 0.0, 0.0})), 1e-5);
  for (double t = 0.0; t < 8.0; t += 0.25)
    EXPECT_NEAR(motion.at(t).u_mm.front().x, std::cos(kTau * t / 8), 2e-3) << t;
  EXPECT_LT(largest_difference_mm(motion.at_frame(8), motion.at_frame(0)), 1e-3);
}

TEST(SequenceMotion, TwoFramesGoToAndFro) {
  SequenceMotion motion;
  motion.basis.times_s = {0.0, 1.0};
  motion.terms = {shift({0, 0, 0}), shift({4, 0, 0})};
  EXPECT_LT(largest_difference_mm(motion.at(0.25), shift({1, 0, 0})), 1e-6) << "one step alone";
  motion.basis.cycle_s = 2.0;
  EXPECT_LT(largest_difference_mm(motion.at(0.5), shift({2, 0, 0})), 1e-6);
  EXPECT_LT(largest_difference_mm(motion.at(1.5), shift({2, 0, 0})), 1e-6);
}

TEST(TheReferenceFrame, IsTheOneNearestToTheMean) {
  // Places of the material: 0, 1, 9, 4, 3 mm; the sum of the distances is smallest from 3.
  const std::vector<Field> steps = {shift({1, 0, 0}), shift({8, 0, 0}), shift({-5, 0, 0}),
                                    shift({-1, 0, 0})};
  EXPECT_EQ(frame_nearest_the_mean(steps), 4U);
}

TEST(NeighbourConsensus, LeavesWhatAgreesAndHalvesWhatDoesNot) {
  const std::vector<double> places = {0.0, 3.0, 5.0, 2.0};
  std::vector<Field> direct, steps, backward;
  std::vector<Confidence> sure;
  for (size_t k = 0; k < 4; ++k) {
    direct.push_back(shift({places[k], 0, 0}));
    steps.push_back(shift({places[(k + 1) % 4] - places[k], 0, 0}));
    backward.push_back(shift({places[k] - places[(k + 1) % 4], 0, 0}));
    sure.push_back({small_grid(), std::vector<float>(small_grid().count(), 1.0F)});
  }
  const auto kept = with_neighbours(direct, steps, backward, sure);
  for (size_t k = 0; k < 4; ++k) EXPECT_LT(largest_difference_mm(kept[k], direct[k]), 1e-5);
  // One frame is wrong by 3 mm: a third of this remains there, and each neighbour gets a third.
  direct[1] = shift({places[1] + 3.0, 0, 0});
  const auto voted = with_neighbours(direct, steps, backward, {});
  EXPECT_NEAR(voted[1].u_mm[0].x, places[1] + 1.0, 1e-5);
  EXPECT_NEAR(voted[0].u_mm[0].x, places[0] + 1.0, 1e-5);
  EXPECT_NEAR(voted[3].u_mm[0].x, places[3], 1e-5);
  // Where its confidence is zero it has nearly no weight.
  for (float& c : sure[1].values) c = 0.0F;
  const auto weighted = with_neighbours(direct, steps, backward, sure);
  EXPECT_LT(std::abs(weighted[1].u_mm[0].x - places[1]), 0.1);
  // Not cyclic: the frames at the ends have one neighbour.
  const auto open =
      with_neighbours(direct, std::span(steps).first(3), std::span(backward).first(3), {});
  EXPECT_NEAR(open[0].u_mm[0].x, places[0] + 1.5, 1e-5);
  EXPECT_NEAR(open[3].u_mm[0].x, places[3], 1e-5);
}

TEST(NeighbourConsensus, DoesNotJumpWhereConfidenceDoes) {
  Grid grid;
  grid.size = {16, 4, 4};
  const auto moved = [&](float x_mm) {
    Field field = still_field(grid);
    for (glm::vec3& u : field.u_mm) u.x = x_mm;
    return field;
  };
  // The frame in the middle differs by 6 mm; it has confidence on one half and none on the other.
  const std::vector<Field> direct = {moved(0.0F), moved(6.0F), moved(0.0F)};
  const std::vector<Field> steps(2, moved(0.0F));
  std::vector<Confidence> sure(3, {grid, std::vector<float>(grid.count(), 1.0F)});
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 8; i < 16; ++i) sure[1].values[grid.offset(i, j, k)] = 0.0F;
  const Field mean = with_neighbours(direct, steps, steps, sure)[1];
  EXPECT_NEAR(mean.at(0, 2, 2).x, 2.0, 0.1);
  EXPECT_LT(mean.at(15, 2, 2).x, 0.2);
  for (int i = 1; i < 16; ++i)
    EXPECT_LT(std::abs(mean.at(i, 2, 2).x - mean.at(i - 1, 2, 2).x), 0.6) << i;
}

TEST(SequenceMotion, ToldFromItsReferenceStandsStillThereAndLeavesPlacesAsTheyWere) {
  SequenceMotion motion;
  motion.reference = 1;
  motion.basis = {{0.0, 1.0, 2.0}, 3.0, 0};
  motion.terms = {shift({1, 0, 0}), shift({3, -1, 0}), shift({0, 0, 2})};
  const SequenceMotion told = told_from_reference(motion);
  EXPECT_LT(largest_difference_mm(told.at_frame(1), shift({0, 0, 0})), 5e-3);
  EXPECT_LT(largest_difference_mm(told.at_frame(0), shift({-2, 1, 0})), 5e-3);
  EXPECT_LT(largest_difference_mm(consecutive_field(told, 2), consecutive_field(motion, 2)), 1e-2);
  motion.basis.harmonics = 1;
  const SequenceMotion smooth = told_from_reference(motion);
  EXPECT_LT(largest_difference_mm(smooth.at_frame(1), shift({0, 0, 0})), 5e-3);
  for (int k = 0; k < 3; ++k)
    EXPECT_LT(largest_difference_mm(consecutive_field(smooth, size_t(k)),
                                    consecutive_field(motion, size_t(k))),
              1e-2);
}

TEST(ConsecutiveFields, AreThoseBetweenThePlacesOfTheFrames) {
  SequenceMotion motion;
  motion.basis = {{0.0, 1.0, 2.0}, 3.0, 0};
  motion.terms = {shift({1, 0, 0}), shift({3, -1, 0}), shift({0, 0, 2})};
  EXPECT_LT(largest_difference_mm(consecutive_field(motion, 0), shift({2, -1, 0})), 5e-3);
  EXPECT_LT(largest_difference_mm(consecutive_field(motion, 2), shift({1, 0, -2})), 5e-3);
}

/// Mean position error of the material on the wall over all ordered pairs of frames, voxels.
double all_pairs_voxels(const std::vector<Field>& at_frame, int frames, const Grid& grid) {
  double sum = 0.0;
  size_t count = 0;
  for (int a = 0; a < frames; ++a) {
    const Mask wall = shell_mask(grid, a, frames);
    const Field inverse = inverse_of(at_frame[size_t(a)], grid).w;
    for (int b = 0; b < frames; ++b) {
      if (a == b) continue;
      for (size_t n = 0; n < grid.count(); n += 7) {
        if (!wall.values[n]) continue;
        const int i = int(n % size_t(grid.size.x)),
                  j = int(n / size_t(grid.size.x) % size_t(grid.size.y)),
                  k = int(n / (size_t(grid.size.x) * size_t(grid.size.y)));
        const glm::dvec3 y = grid.lps_from_index({i, j, k});
        const glm::dvec3 x = y + glm::dvec3(inverse.u_mm[n]);
        sum +=
            glm::distance(x + sample_at_lps(at_frame[size_t(b)], x), shell_point(y, a, b, frames));
        ++count;
      }
    }
  }
  return sum / double(count) / grid.finest_mm();
}

using MotionOfASequence = test::DeviceTest;

TEST_F(MotionOfASequence, IsMoreAccurateThanFieldsThatFollowEachOtherAndDoesNotDrift) {
  constexpr int kFrames = 8;
  const Grid grid = heart_grid(48);
  const Sequence heart = shell_phantom(grid, kFrames, 3, 0.05);
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("balanced");
  options.estimator.cyclic = true;
  std::vector<Field> steps(kFrames);
  double last_share = 0.0;
  const auto motion = estimate_sequence_motion(
      context(), grid, heart.times_s, [&](size_t k) -> Result<Volume> { return heart.frames[k]; },
      options, [&](PairMotion pair) { steps[pair.fixed_frame] = pair.field; },
      [&](const std::string&, double share) {
        EXPECT_GE(share, last_share - 1e-9);
        last_share = share;
      });
  ASSERT_TRUE(motion) << motion.error().message;
  EXPECT_GT(last_share, 0.9);
  EXPECT_DOUBLE_EQ(motion->basis.cycle_s, 1.0);
  EXPECT_GE(motion->basis.harmonics, 1);
  for (int phase = 0; phase < 24; ++phase) EXPECT_EQ(folds(motion->at(phase / 24.0)).folded, 0U);
  std::vector<Field> chain = {still_field(steps[0].grid)};
  for (int k = 0; k + 1 < kFrames; ++k) {
    Field next = chain.back();
    for (int z = 0; z < next.grid.size.z; ++z)
      for (int y = 0; y < next.grid.size.y; ++y)
        for (int x = 0; x < next.grid.size.x; ++x) {
          const glm::dvec3 at = next.grid.lps_from_index({x, y, z});
          glm::vec3& u = next.u_mm[next.grid.offset(x, y, z)];
          u += glm::vec3(sample_at_lps(steps[size_t(k)], at + glm::dvec3(u)));
        }
    chain.push_back(std::move(next));
  }
  const double paper = all_pairs_voxels(chain, kFrames, grid);
  std::vector<Field> at_frame;
  for (size_t k = 0; k < kFrames; ++k) at_frame.push_back(motion->at_frame(k));
  const double ours = all_pairs_voxels(at_frame, kFrames, grid);
  std::printf("all pairs, voxels: one motion %.3f, fields that follow each other %.3f\n", ours,
              paper);
  EXPECT_LT(ours, 0.8 * paper);
  // Consecutive fields from the one motion close the cycle; the fields that were estimated alone do
  // not.
  std::vector<Field> closed;
  for (size_t k = 0; k < kFrames; ++k) closed.push_back(consecutive_field(*motion, k));
  const auto drift = cycle_drift(closed, grid), before = cycle_drift(steps, grid);
  ASSERT_TRUE(drift && before);
  EXPECT_LT(drift->voxels.mean, 0.2 * before->voxels.mean);
}

/// An organ that slides past a still wall, in a sequence: the border comes to its place on the
/// solved cells, which are the cells that a sequence keeps.
TEST_F(MotionOfASequence, PutsTheBorderOfASlidingOrganInItsPlace) {
  const SlidingPhantom slide = sliding_phantom();
  const std::vector<double> times_s = {0.0, 1.0};
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("balanced");
  options.reference = 0;
  const auto errors = [&] {
    const auto motion = estimate_sequence_motion(
        context(), slide.fixed.grid, times_s,
        [&](size_t k) -> Result<Volume> { return k == 0 ? slide.fixed : slide.moving; }, options);
    EXPECT_TRUE(motion);
    if (!motion) return std::pair(1e30, 1e30);
    const Field field = motion->at_frame(1);
    EXPECT_EQ(field.grid.size, (slide.fixed.grid.size + 3) / 4);
    EXPECT_EQ(folds(field).folded, 0U);
    const auto in = [&](const Mask& mask) {
      const Result<Distances> distances = endpoint_error(field, slide.truth, &mask);
      EXPECT_TRUE(distances);
      return distances ? distances->voxels.mean : 1e30;
    };
    return std::pair(in(slide.organ), in(slide.wall));
  };
  const auto with = errors();
  options.estimator.motion = without_sliding_step(options.estimator.motion);
  const auto without = errors();
  EXPECT_LT(with.first, 0.75 * without.first);
  EXPECT_LT(with.second, 0.7 * without.second);
  RecordProperty("organ_voxel", std::to_string(with.first));
  RecordProperty("wall_voxel", std::to_string(with.second));
}

TEST_F(MotionOfASequence, IsBetterOfTheMeanOfSeveralCycles) {
  // The same motion in each cycle, with new noise each time.
  constexpr int kFrames = 8;
  const Grid grid = heart_grid(40);
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("fast");
  options.estimator.cyclic = true;
  options.reference = 5;
  constexpr double kNoise = 0.3;  // with less, one cycle is nearly as good as four
  Sequence mean = shell_phantom(grid, kFrames, 1, kNoise);
  std::vector<double> errors;
  for (int cycles = 1; cycles <= 4; ++cycles) {
    const auto motion = estimate_sequence_motion(
        context(), grid, mean.times_s, [&](size_t k) -> Result<Volume> { return mean.frames[k]; },
        options);
    ASSERT_TRUE(motion) << motion.error().message;
    EXPECT_EQ(motion->reference, 5U);
    std::vector<Field> at_frame;
    for (size_t k = 0; k < kFrames; ++k) at_frame.push_back(motion->at_frame(k));
    errors.push_back(all_pairs_voxels(at_frame, kFrames, grid));
    const Sequence more = shell_phantom(grid, kFrames, uint32_t(1 + cycles), kNoise);
    for (size_t k = 0; k < kFrames; ++k)
      for (size_t v = 0; v < grid.count(); ++v)
        mean.frames[k].values[v] +=
            (more.frames[k].values[v] - mean.frames[k].values[v]) / float(cycles + 1);
  }
  std::printf("all pairs, voxels, of 1 to 4 cycles: %.4f %.4f %.4f %.4f\n", errors[0], errors[1],
              errors[2], errors[3]);
  EXPECT_LT(errors[1], 0.95 * errors[0]);
  EXPECT_LT(errors[3], 0.85 * errors[0]);
  options.reference = kFrames;
  EXPECT_FALSE(estimate_sequence_motion(
      context(), grid, mean.times_s, [&](size_t k) -> Result<Volume> { return mean.frames[k]; },
      options));
}

TEST_F(MotionOfASequence, OfSingleSlicesKeepsItsHigherHarmonics) {
  // Back and forth twice per cycle: a single harmonic can not represent this.
  constexpr int kFrames = 8;
  Grid grid;
  grid.size = {64, 64, 1};
  std::vector<double> times_s;
  std::vector<double> shifts_mm;
  std::vector<Volume> frames;
  for (int k = 0; k < kFrames; ++k) {
    times_s.push_back(k / double(kFrames));
    shifts_mm.push_back(2.0 * std::sin(2.0 * kTau * k / kFrames));
    Volume frame{grid, std::vector<float>(grid.count())};
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        const double x = i - shifts_mm.back(), y = j;
        frame.values[grid.offset(i, j, 0)] =
            float(100.0 * (std::sin(0.31 * x + 0.1 * y) + std::sin(0.23 * y - 0.17 * x) +
                           std::sin(0.41 * x) * std::cos(0.37 * y)));
      }
    frames.push_back(std::move(frame));
  }
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("fast");
  options.estimator.cyclic = true;
  const auto motion = estimate_sequence_motion(
      context(), grid, times_s, [&](size_t k) -> Result<Volume> { return frames[k]; }, options);
  ASSERT_TRUE(motion) << motion.error().message;
  const double from_mm = shifts_mm[motion->reference];
  for (size_t k = 0; k < kFrames; ++k) {
    double sum = 0.0;
    int count = 0;
    for (double y = 12.0; y < 52.0; y += 4.0)
      for (double x = 12.0; x < 52.0; x += 4.0, ++count)
        sum +=
            std::abs(sample_at_lps(motion->at_frame(k), {x, y, 0.0}).x - (shifts_mm[k] - from_mm));
    EXPECT_LT(sum / count, 0.3) << "frame " << k;
  }
}

/// One motion of these frames, its report and the events of the estimation.
struct Estimate {
  SequenceMotion motion;
  SequenceReport report;
};
Estimate estimate(const std::shared_ptr<vulkan::Context>& context,
                  const std::vector<Volume>& frames, const std::vector<double>& times_s) {
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("fast");
  options.estimator.cyclic = true;
  Estimate result;
  auto motion = estimate_sequence_motion(
      context, frames.front().grid, times_s, [&](size_t k) -> Result<Volume> { return frames[k]; },
      options, {}, {}, {}, &result.report);
  EXPECT_TRUE(motion) << motion.error().message;
  if (motion) result.motion = std::move(*motion);
  for (const Field& term : result.motion.terms)
    for (const glm::vec3& u : term.u_mm)
      EXPECT_TRUE(std::isfinite(u.x) && std::isfinite(u.y) && std::isfinite(u.z));
  return result;
}

std::string all_of(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += sentence + "\n";
  return text;
}

/// The coarse motion of a beat: much better than none, and from the frame that was asked for.
TEST_F(MotionOfASequence, IsCoarseFirst) {
  constexpr int kFrames = 8;
  const Grid grid = heart_grid(48);
  const Sequence heart = shell_phantom(grid, kFrames, 3, 0.05);
  const FrameReader read = [&](size_t k) -> Result<Volume> { return heart.frames[k]; };
  const auto motion = estimate_coarse_motion(context(), grid, heart.times_s, read, true, 3);
  ASSERT_TRUE(motion) << motion.error().message;
  EXPECT_EQ(motion->reference, 3U);
  EXPECT_DOUBLE_EQ(motion->basis.cycle_s, 1.0);
  EXPECT_LT(largest_difference_mm(motion->at_frame(3), still_field(motion->terms[0].grid)), 0.05);
  std::vector<Field> at_frame, still;
  for (size_t k = 0; k < kFrames; ++k) {
    at_frame.push_back(motion->at_frame(k));
    still.push_back(still_field(at_frame.back().grid));
    EXPECT_EQ(folds(at_frame.back()).folded, 0U);
  }
  // all_pairs_voxels() begins at frame 0, whichever frame a motion is described from.
  const double ours = all_pairs_voxels(at_frame, kFrames, grid);
  const double none = all_pairs_voxels(still, kFrames, grid);
  std::printf("all pairs, voxels: coarse motion %.3f, none %.3f\n", ours, none);
  EXPECT_LT(ours, 0.35 * none);

  Sequence half = shell_phantom(grid, 12);
  half.frames.resize(6);
  half.times_s.resize(6);
  const auto open = estimate_coarse_motion(
      context(), grid, half.times_s, [&](size_t k) -> Result<Volume> { return half.frames[k]; },
      true, 0);
  ASSERT_TRUE(open) << open.error().message;
  EXPECT_EQ(open->basis.cycle_s, 0.0);

  const Grid small = heart_grid(8);
  EXPECT_FALSE(estimate_coarse_motion(
      context(), small, heart.times_s,
      [&](size_t) -> Result<Volume> {
        return Volume{small, std::vector<float>(small.count())};
      },
      true, 0));
}

TEST_F(MotionOfASequence, ThatDoesNotLeadBackIsNoCycle) {
  // Half a beat: the motion from the last frame to the first is nearly the whole way back.
  const Grid grid = heart_grid(48);
  Sequence half = shell_phantom(grid, 12);
  half.frames.resize(6);
  half.times_s.resize(6);
  const Estimate found = estimate(context(), half.frames, half.times_s);
  EXPECT_EQ(found.motion.basis.cycle_s, 0.0);
  EXPECT_EQ(found.motion.basis.harmonics, 0);
  EXPECT_EQ(found.motion.frames(), 6U);
  EXPECT_NE(all_of(found.report.notes).find("does not lead back"), std::string::npos);
}

TEST_F(MotionOfASequence, WhoseLastFrameIsTheFirstOnceMoreEndsThere) {
  const Grid grid = heart_grid(48);
  Sequence beat = shell_phantom(grid, 8, 1, 0.05);
  beat.frames.push_back(beat.frames.front());
  beat.times_s.push_back(1.0);
  const Estimate found = estimate(context(), beat.frames, beat.times_s);
  EXPECT_NEAR(found.motion.basis.cycle_s, 1.0, 1e-3);
  EXPECT_GT(found.motion.basis.cycle_s, 1.0);
  EXPECT_LT(largest_difference_mm(found.motion.at_frame(0), found.motion.at_frame(8)), 0.05);
  EXPECT_NE(all_of(found.report.notes).find("once more"), std::string::npos);
}

TEST_F(MotionOfASequence, WithAFrameTwiceSaysSoAndStaysRight) {
  constexpr int kFrames = 8;
  const Grid grid = heart_grid(48);
  const Sequence beat = shell_phantom(grid, kFrames, 1, 0.05);
  std::vector<Volume> frames = beat.frames;
  frames.insert(frames.begin() + 3, beat.frames[2]);
  std::vector<double> times_s;
  for (size_t k = 0; k < frames.size(); ++k) times_s.push_back(double(k));
  const Estimate found = estimate(context(), frames, times_s);
  EXPECT_NE(all_of(found.report.notes).find("Frames 2 and 3 are equal"), std::string::npos);
  const auto shown = [](size_t k) { return int(k < 3 ? k : k - 1); };
  const int reference = shown(found.motion.reference);
  const Mask wall = shell_mask(grid, reference, kFrames);
  for (size_t k = 0; k < frames.size(); ++k) {
    if (shown(k) == reference) continue;
    const auto error = endpoint_error(found.motion.at_frame(k),
                                      shell_truth(grid, reference, shown(k), kFrames), &wall);
    ASSERT_TRUE(error);
    EXPECT_LT(error->voxels.mean, 0.5) << "frame " << k;
  }
}

TEST_F(MotionOfASequence, BridgesAMissingFrame) {
  constexpr int kFrames = 12;
  constexpr size_t kMissing = 4;
  const Grid grid = heart_grid(48);
  const Sequence beat = shell_phantom(grid, kFrames, 1, 0.05);
  std::vector<Volume> frames = beat.frames;
  std::vector<double> times_s = beat.times_s;
  frames.erase(frames.begin() + kMissing);
  times_s.erase(times_s.begin() + kMissing);
  const Estimate found = estimate(context(), frames, times_s);
  const SequenceMotion& motion = found.motion;
  EXPECT_NEAR(motion.basis.cycle_s, 1.0, 1e-12) << "the gap must not make the cycle longer";
  const int reference = int(motion.reference + (motion.reference >= kMissing ? 1 : 0));
  const Mask wall = shell_mask(grid, reference, kFrames);
  const auto error = endpoint_error(motion.at(beat.times_s[kMissing]),
                                    shell_truth(grid, reference, kMissing, kFrames), &wall);
  ASSERT_TRUE(error);
  EXPECT_LT(error->voxels.mean, 0.5);
  for (int p = 0; p < 48; ++p) EXPECT_EQ(folds(motion.at(p / 48.0)).folded, 0U);
}

TEST(CycleLength, IsThatOfTheMedianStep) {
  EXPECT_DOUBLE_EQ(cycle_of(std::vector<double>{0.0, 0.25, 0.5, 0.75}), 1.0);
  EXPECT_DOUBLE_EQ(cycle_of(std::vector<double>{2.0, 2.25, 2.75}), 1.0) << "one is missing";
  EXPECT_DOUBLE_EQ(cycle_of(std::vector<double>{1.0, 4.0}), 6.0);
}

TEST_F(MotionOfASequence, StopsWhenItIsAskedTo) {
  const Grid grid = heart_grid(48);
  const Sequence heart = shell_phantom(grid, 4);
  std::stop_source stop;
  SequenceMotionOptions options;
  options.estimator.motion = *motion_preset("fast");
  const auto motion = estimate_sequence_motion(
      context(), grid, heart.times_s, [&](size_t k) -> Result<Volume> { return heart.frames[k]; },
      options, {},
      [&](const std::string&, double share) {
        if (share > 0.6) stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(motion);
  EXPECT_EQ(motion.error().kind, ErrorKind::kCancelled);
}

}  // namespace
}  // namespace palpate
