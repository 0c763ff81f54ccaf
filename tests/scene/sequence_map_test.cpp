// One motion for a whole sequence as the haptic loop reads it. Oracles: the fields of which it was
// made, and the phantom, whose material moves in a known way.
#include "module/scene/sequence_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "compute/volume/phantom.h"
#include "compute/volume/signed_distance.h"
#include "module/scene/make_volume.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

Grid oblique_grid() {
  Grid grid;
  grid.size = {7, 6, 5};
  grid.spacing_mm = {2.0, 2.5, 3.0};
  grid.origin_mm = {-5.0, 3.0, 1.0};
  grid.direction = glm::dmat3(0.8, 0.6, 0.0, -0.6, 0.8, 0.0, 0.0, 0.0, 1.0);
  return grid;
}

SequenceMotion random_motion(uint32_t seed, int harmonics) {
  test::Random random(seed);
  SequenceMotion motion;
  motion.reference = 1;
  motion.basis = {{0.0, 0.2, 0.5, 0.6, 0.9}, 1.1, harmonics};
  for (size_t n = 0; n < motion.basis.terms(); ++n) {
    motion.terms.push_back(still_field(oblique_grid()));
    for (glm::vec3& u : motion.terms.back().u_mm) u = glm::vec3(random.vector(0.4));
  }
  return motion;
}

/// A component of a field as scalar data, which use the same spline.
std::shared_ptr<const FrameData> component(const Field& field, int axis) {
  Volume values{field.grid, std::vector<float>(field.u_mm.size())};
  for (size_t s = 0; s < values.values.size(); ++s)
    values.values[s] = float(1e3 * volume_from_lps(glm::dvec3(field.u_mm[s]))[axis]);
  return sampled_scalar(std::move(values));
}

TEST(SequenceMap, IsTheSplineOfTheMotionAtAnyTimeWithItsDerivative) {
  for (const int harmonics : {0, 1, 2}) {
    const SequenceMotion motion = random_motion(uint32_t(7 + harmonics), harmonics);
    const auto map = SequenceMap::of(motion);
    test::Random random(3);
    SequenceSnapshot moment(*map, map->basis().at(0.0));
    for (const double time_s : {0.0, 0.13, 0.5, 0.77, 1.05, 7.3}) {
      const Field field = motion.at(time_s);
      const TimeWeights time = map->basis().at(time_s);
      moment.set(time);
      const std::shared_ptr<const FrameData> um[] = {component(field, 0), component(field, 1),
                                                     component(field, 2)};
      for (int trial = 0; trial < 50; ++trial) {
        // Also beyond the border.
        const glm::dvec3 x = volume_from_lps(field.grid.lps_from_index(
            glm::dvec3(random.draw(-3.0, 9.0), random.draw(-3.0, 8.0), random.draw(-3.0, 7.0))));
        const MotionSample sample = moment.sample(x);
        EXPECT_LT(glm::distance(sample.u_m, map->displacement(x, time)), 1e-12);
        EXPECT_NEAR(sample.confidence, 1.0, 1e-6);
        for (int a = 0; a < 3; ++a) {
          EXPECT_NEAR(sample.u_m[a], 1e-3 * um[a]->scalar(x), 1e-9);
          const glm::dvec3 slope(sample.jacobian[0][a], sample.jacobian[1][a],
                                 sample.jacobian[2][a]);
          EXPECT_LT(glm::distance(slope, 1e-3 * um[a]->scalar_gradient(x)), 1e-6);
        }
      }
    }
    EXPECT_EQ(map->bytes(), oblique_grid().count() * (3 * motion.basis.summands() + 1) * 4);
  }
}

TEST(SequenceMap, GivesItsTermsOnFinerGrids) {
  const auto map = SequenceMap::of(random_motion(11, 1));
  for (const int factor : {1, 2, 3}) {
    const SequenceMap::Samples samples = map->samples(factor);
    EXPECT_EQ(samples.place.size, (oblique_grid().size - 1) * factor + 1);
    const size_t count = samples.u_m.size() / 3;
    TimeWeights one;
    one.count = 1;
    one.weight[0] = 1.0F;
    for (int n = 0; n < 3; ++n) {
      one.term[0] = n;
      for (const glm::ivec3 at : {glm::ivec3(0, 0, 0), glm::ivec3(4, 3, 2), glm::ivec3(5, 1, 4)}) {
        const glm::dvec3 x =
            glm::inverse(samples.place.index_from_volume) * (glm::dvec3(at) - samples.place.offset);
        const size_t s =
            size_t(at.x) + size_t(samples.place.size.x) *
                               (size_t(at.y) + size_t(samples.place.size.y) * size_t(at.z));
        EXPECT_LT(glm::distance(glm::dvec3(samples.u_m[size_t(n) * count + s]),
                                map->displacement(x, one)),
                  1e-9);
      }
    }
  }
}

TEST(SequenceMap, TimesBetweenFramesAndFramePointersAgree) {
  for (const int harmonics : {0, 2}) {
    const TimeBasis basis{{0.0, 0.2, 0.5, 0.6, 0.9}, 1.1, harmonics};
    const FrameTimes times{basis.times_s, basis.cycle_s};
    for (double t = 0.0; t < 1.1; t += 0.037) {
      const FramePointer pointer = pointer_at(times, t);
      const TimeWeights a = basis.at(t), b = basis.at(pointer.frame, pointer.phase);
      ASSERT_EQ(a.count, b.count);
      for (int n = 0; n < a.count; ++n) {
        EXPECT_EQ(a.term[size_t(n)], b.term[size_t(n)]);
        EXPECT_NEAR(a.weight[size_t(n)], b.weight[size_t(n)], 1e-6);
      }
    }
  }
}

TEST(SequenceMap, HoldsStillWhereAVectorIsNoNumber) {
  SequenceMotion motion = random_motion(5, 1);
  const size_t broken = oblique_grid().offset(3, 3, 2);
  motion.terms[2].u_mm[broken].y = std::numeric_limits<float>::quiet_NaN();
  const auto map = SequenceMap::of(motion);
  SequenceSnapshot moment(*map, map->basis().at(0.3));
  const MotionSample sample =
      moment.sample(volume_from_lps(oblique_grid().lps_from_index({3, 3, 2})));
  EXPECT_LT(sample.confidence, 1e-9);
  EXPECT_LT(glm::length(sample.u_m), 1e-3) << "more than the neighbours' spline leaves";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  moment.set(map->basis().at(nan));
  EXPECT_TRUE(std::isfinite(moment.sample(glm::dvec3(nan)).u_m.x));
}

TEST(CarriedVolume, HoldsOneFrameAndIsTheMaterialInAll) {
  constexpr int kFrames = 4;
  const Grid grid = heart_grid(64);
  const Sequence heart = shell_phantom(grid, kFrames, 1, 0.0);
  MovingVolume own;
  own.name = "heart";
  own.times = {heart.times_s, 1.0};
  for (const Volume& frame : heart.frames) own.frames.push_back(sampled_scalar(frame));
  SequenceMotion motion;
  motion.reference = 2;
  motion.basis = {heart.times_s, 1.0, 0};
  for (int k = 0; k < kFrames; ++k) motion.terms.push_back(shell_truth(grid, 2, k, kFrames));
  const auto volume = carried(own, motion);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_FALSE(volume->is_still());
  ASSERT_EQ(volume->frames.size(), 1U);
  EXPECT_EQ(volume->frames[0], own.frames[2]);
  EXPECT_GT(volume->whole->least_determinant(), 0.0);
  for (int k = 0; k < kFrames; ++k) {
    double sum = 0.0, before = 0.0;
    const TimeWeights time = volume->whole->basis().at(k, 0.0);
    for (int z = 4; z < 60; z += 2)
      for (int y = 4; y < 60; y += 2)
        for (int x = 4; x < 60; x += 2) {
          const glm::dvec3 material = volume_from_lps(grid.lps_from_index({x, y, z}));
          const glm::dvec3 now = material + volume->whole->displacement(material, time);
          const double value = volume->frames[0]->scalar(material);
          const double difference = value - own.frames[size_t(k)]->scalar(now);
          const double still = value - own.frames[size_t(k)]->scalar(material);
          sum += difference * difference;
          before += still * still;
        }
    // The remaining error comes from edges of 1.5 samples, stretched by the motion.
    if (k == 2) continue;
    EXPECT_LT(sum, 0.02 * before) << "frame " << k;
  }
}

TEST(CarriedVolume, TheMeanOfAllFramesHasLessNoiseAndIgnoresAFrameThatIsWrong) {
  constexpr int kFrames = 8;
  const Grid grid = heart_grid(48);
  const Sequence clean = shell_phantom(grid, kFrames, 1, 0.0);
  Sequence noisy = shell_phantom(grid, kFrames, 1, 0.1);
  // One frame has an artefact: a brighter ball.
  constexpr float kBrighter = 1000.0F;
  const auto is_spoilt = [&](glm::ivec3 i) {
    return glm::length(grid.lps_from_index(glm::dvec3(i))) < 12.0;
  };
  for (int z = 0; z < 48; ++z)
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 48; ++x)
        if (is_spoilt({x, y, z})) noisy.frames[5].values[grid.offset(x, y, z)] += kBrighter;
  SequenceMotion motion;
  motion.reference = 2;
  motion.basis = {noisy.times_s, 1.0, 0};
  for (int k = 0; k < kFrames; ++k) motion.terms.push_back(shell_truth(grid, 2, k, kFrames));
  const auto mean_of = [&](const Sequence& sequence) {
    MovingVolume own;
    own.name = "shell";
    own.times = {sequence.times_s, 1.0};
    for (const Volume& frame : sequence.frames) own.frames.push_back(sampled_scalar(frame));
    return carried(own, motion, CarriedValues::kMean);
  };
  const auto of_clean = mean_of(clean), of_noisy = mean_of(noisy);
  ASSERT_TRUE(of_clean && of_noisy);
  ASSERT_EQ(of_noisy->frames.size(), 1U);
  double of_one = 0.0, of_mean = 0.0, spoilt_by = 0.0;
  for (int z = 4; z < 44; ++z)
    for (int y = 4; y < 44; ++y)
      for (int x = 4; x < 44; ++x) {
        const size_t at = grid.offset(x, y, z);
        const glm::dvec3 place = volume_from_lps(grid.lps_from_index({x, y, z}));
        const double one = noisy.frames[2].values[at] - clean.frames[2].values[at];
        const double mean = of_noisy->frames[0]->scalar(place) - of_clean->frames[0]->scalar(place);
        of_one += one * one;
        of_mean += mean * mean;
        if (is_spoilt({x, y, z})) spoilt_by = std::max(spoilt_by, std::abs(mean));
      }
  EXPECT_GT(of_one, 0.0);
  // The middle half of eight frames: a variance of 0.15, and interpolation reduces it further.
  EXPECT_LT(of_mean, 0.2 * of_one);
  EXPECT_LT(spoilt_by, 0.1 * kBrighter) << "a mean of all would be off by an eighth, and noise";
}

TEST(CarriedVolume, HasTheSegmentsOfAnotherFrameWhereTheirMaterialIs) {
  constexpr int kFrames = 4;
  const Grid grid = heart_grid(64);
  const Sequence shells = shell_phantom(grid, kFrames, 1, 0.0);
  MovingVolume own;
  own.name = "shell";
  own.times = {shells.times_s, 1.0};
  for (const Volume& frame : shells.frames) own.frames.push_back(sampled_scalar(frame));
  // A ball of frame 1.
  constexpr double kRadiusMm = 28.0;
  Mask ball{grid, std::vector<uint8_t>(grid.count())};
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i)
        ball.values[grid.offset(i, j, k)] = glm::length(grid.lps_from_index({i, j, k})) < kRadiusMm;
  own.segments = {{"ball", glm::vec3(1.0F), {sampled_scalar(signed_distance(ball))}}};
  own.segments_frame = 1;
  SequenceMotion motion;
  motion.reference = 2;
  motion.basis = {shells.times_s, 1.0, 0};
  for (int k = 0; k < kFrames; ++k) motion.terms.push_back(shell_truth(grid, 2, k, kFrames));
  const auto volume = carried(own, motion);
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_EQ(volume->segments.size(), 1U);
  const FrameData& distance = *volume->segments[0].distance_mm.front();
  double largest_mm = 0.0;
  for (const glm::dvec3 way :
       {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0.6, 0.0, 0.8)})
    for (const double r_mm : {24.0, 28.0, 32.0}) {
      const glm::dvec3 x = r_mm * way, u = sample_at_lps(motion.terms[1], x);
      largest_mm = std::max(largest_mm, glm::length(u));
      // Interpolated a second time from samples 2 mm apart.
      EXPECT_NEAR(distance.scalar(volume_from_lps(x)),
                  own.segments[0].distance_mm[0]->scalar(volume_from_lps(x + u)), 0.1);
    }
  EXPECT_GT(largest_mm, 1.0) << "the ball has another size there";

  const auto standing = standing_at(own, 1);
  ASSERT_TRUE(standing) << standing.error().message;
  EXPECT_EQ(standing->frames.front(), own.frames[1]);
  EXPECT_EQ(standing->segments[0].distance_mm, own.segments[0].distance_mm);
  EXPECT_EQ(standing->whole->largest_u_m(), 0.0);
  EXPECT_EQ(standing->times.times_s, own.times.times_s);
  EXPECT_FALSE(standing_at(own, 4));
}

TEST(CarriedVolume, RefusesTheMotionOfAnotherSequence) {
  MovingVolume own;
  own.name = "heart";
  own.times = {{0.0, 0.25, 0.5, 0.75}, 1.0};
  const Grid grid = heart_grid(16);
  const Sequence heart = shell_phantom(grid, 4, 1, 0.0);
  for (const Volume& frame : heart.frames) own.frames.push_back(sampled_scalar(frame));
  SequenceMotion motion;
  motion.basis = {{0.0, 0.5, 1.0}, 1.5, 0};
  motion.terms.assign(3, still_field(grid));
  auto refused = carried(own, motion);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("that of 3 frames"), std::string::npos)
      << refused.error().message;
  motion.basis = {own.times.times_s, 0.0, 0};
  motion.terms.assign(4, still_field(grid));
  const auto once = carried(own, motion);
  ASSERT_TRUE(once);
  EXPECT_FALSE(once->times.cyclic()) << "whether the times are cyclic must follow from the motion";
  motion.reference = 9;
  EXPECT_FALSE(carried(own, motion));
}

}  // namespace
}  // namespace palpate
