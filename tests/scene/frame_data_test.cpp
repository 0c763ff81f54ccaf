#include "module/scene/frame_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "module/scene/spline_coefficients.h"
#include "module/scene/transform.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

template <class Function>
Volume volume_of(const Grid& grid, const Function& value_at_lps) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        volume.values[grid.offset(i, j, k)] =
            float(value_at_lps(grid.lps_from_index(glm::dvec3(i, j, k))));
  return volume;
}

Volume random_volume(const Grid& grid, Random& random) {
  return volume_of(grid, [&](glm::dvec3) { return random.draw(-1.0, 1.0); });
}

std::vector<glm::vec3> random_vectors(const Grid& grid, Random& random) {
  std::vector<glm::vec3> values(grid.count());
  for (glm::vec3& v : values) v = glm::vec3(random.vector(1.0));
  return values;
}

/// A direction of the patient (LPS) along volume space's axes, without a change of unit.
glm::dvec3 turned(glm::dvec3 lps) {
  return 1e3 * volume_from_lps(lps);
}

TEST(FrameData, OfALinearVolumeIsExactInValueAndGradient) {
  const Grid grid = test::oblique_grid();
  const glm::dvec3 per_mm(3.0, -2.0, 5.0);
  const auto data =
      sampled_scalar(volume_of(grid, [&](glm::dvec3 lps) { return 10.0 + glm::dot(per_mm, lps); }));
  Random random(1);
  for (int draw = 0; draw < 1000; ++draw) {
    // Nearer to the border the last sample is repeated, so the data are not linear.
    const glm::dvec3 lps = grid.lps_from_index(test::some_index(grid, random, -1.0));
    const glm::dvec3 x = volume_from_lps(lps);
    // Samples are floats of up to 300, with errors of 2e-5, summed in floats.
    EXPECT_NEAR(data->scalar(x), 10.0 + glm::dot(per_mm, lps), 1e-4) << "draw " << draw;
    EXPECT_LT(glm::length(data->scalar_gradient(x) - 1e3 * turned(per_mm)), 0.15) << draw;
  }
}

/// The cubic B-spline, by its definition.
double cubic(double t) {
  t = std::abs(t);
  if (t < 1.0) return 2.0 / 3.0 - t * t + 0.5 * t * t * t;
  return t < 2.0 ? (2.0 - t) * (2.0 - t) * (2.0 - t) / 6.0 : 0.0;
}

/// The value, computed directly: all coefficients around, the last one repeated beyond the border.
double slow_value(const Volume& volume, glm::dvec3 index) {
  double sum = 0.0;
  const glm::ivec3 size = volume.grid.size, low(glm::floor(index));
  const auto held = [](int i, int n) { return std::clamp(i, 0, n - 1); };
  for (int k = low.z - 2; k <= low.z + 3; ++k)
    for (int j = low.y - 2; j <= low.y + 3; ++j)
      for (int i = low.x - 2; i <= low.x + 3; ++i)
        sum += double(volume.at(held(i, size.x), held(j, size.y), held(k, size.z))) *
               cubic(index.x - i) * cubic(index.y - j) * cubic(index.z - k);
  return sum;
}

TEST(FrameData, IsTheCubicSplineOfItsCoefficients) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Grid grid = test::oblique_grid();
    if (seed == 2) grid.size = {1, 5, 4};
    if (seed == 3) grid.size = {2, 1, 3};
    const Volume samples = random_volume(grid, random);
    const Volume volume = spline_coefficients(samples);
    const auto data = sampled_scalar(samples);
    for (int draw = 0; draw < 200; ++draw) {
      const glm::dvec3 index = test::some_index(grid, random, 3.0);
      // Samples of up to 1, summed in floats: a few units of 6e-8.
      EXPECT_NEAR(data->scalar(volume_from_lps(grid.lps_from_index(index))),
                  slow_value(volume, index), 5e-7)
          << "seed " << seed << " draw " << draw;
    }
  }
}

TEST(FrameData, KnowsTheRangeOfItsSamplesThatCoefficientsGoBeyond) {
  Grid grid;
  grid.size = glm::ivec3(16);
  Volume box{grid, std::vector<float>(grid.count(), 0.0F)};
  for (int k = 5; k < 11; ++k)
    for (int j = 5; j < 11; ++j)
      for (int i = 5; i < 11; ++i) box.values[size_t((k * 16 + j) * 16 + i)] = 255.0F;
  box.values[0] = std::numeric_limits<float>::quiet_NaN();
  box.values[1] = std::numeric_limits<float>::infinity();
  const auto data = sampled_scalar(box);
  const ScalarSamples samples = data->samples();
  EXPECT_EQ(samples.lowest, 0.0F);
  EXPECT_EQ(samples.highest, 255.0F);
  EXPECT_LT(*std::min_element(samples.values.begin() + 2, samples.values.end()), -30.0F);
  // No finite value: no range.
  std::fill(box.values.begin(), box.values.end(), std::numeric_limits<float>::quiet_NaN());
  const auto none = sampled_scalar(box);
  EXPECT_GT(none->samples().lowest, none->samples().highest);
}

TEST(FrameData, GradientIsThatOfTheVeryValue) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Volume samples = random_volume(test::oblique_grid(), random);
    const Volume volume = spline_coefficients(samples);
    const auto data = sampled_scalar(samples);
    for (int draw = 0; draw < 50; ++draw) {
      const glm::dvec3 index = test::some_index(volume.grid, random, 1.5);
      const glm::dvec3 gradient =
          data->scalar_gradient(volume_from_lps(volume.grid.lps_from_index(index)));
      glm::dvec3 per_index;
      // Of a voxel: the error of the differences is 1e-8.
      const double step = 1e-4;
      for (int a = 0; a < 3; ++a) {
        glm::dvec3 aside(0.0);
        aside[a] = step;
        per_index[a] =
            (slow_value(volume, index + aside) - slow_value(volume, index - aside)) / (2.0 * step);
      }
      const glm::dvec3 expected =
          1e3 * turned(volume.grid.direction * (per_index / volume.grid.spacing_mm));
      // Float sums, per m: a few 6e-8 over 0.7 mm.
      EXPECT_LT(glm::length(gradient - expected), 2e-3) << "seed " << seed << " draw " << draw;
    }
  }
}

TEST(FrameData, GradientIsContinuousEverywhereAndZeroFarOutside) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Grid grid = test::oblique_grid();
    const auto data = sampled_scalar(random_volume(grid, random));
    for (int walk = 0; walk < 40; ++walk) {
      const glm::dvec3 from = test::some_index(grid, random, 4.0);
      const glm::dvec3 to = test::some_index(grid, random, 4.0);
      glm::dvec3 last(0.0);
      for (int step = 0; step <= 4000; ++step) {
        const glm::dvec3 index = from + (step / 4000.0) * (to - from);
        const glm::dvec3 here = data->scalar_gradient(volume_from_lps(grid.lps_from_index(index)));
        // Two samples beyond every border all coefficients are equal.
        const bool outside = glm::all(glm::lessThan(index, glm::dvec3(-2.0))) ||
                             glm::all(glm::greaterThan(index, glm::dvec3(grid.size) + 1.0));
        if (outside) {
          ASSERT_LT(glm::length(here), 1e-3);
        }
        // Slopes are up to 2 per 0.7 mm and change by no more than about ten times that in a voxel;
        // a step is 1 / 200 of a voxel.
        if (step > 0) {
          ASSERT_LT(glm::length(here - last), 3000.0 * 10.0 / 200.0) << seed << " " << step;
        }
        last = here;
      }
    }
  }
}

TEST(FrameData, OfVectorsGivesThemAlongTheAxesOfVolumeSpace) {
  const Grid grid = test::oblique_grid();
  const glm::dmat3 slope(1.0, 2.0, -0.5, 0.25, -1.0, 3.0, 0.75, 0.5, 0.1);
  std::vector<glm::vec3> values(grid.count());
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        values[grid.offset(i, j, k)] =
            glm::vec3(slope * (grid.lps_from_index(glm::dvec3(i, j, k)) - grid.origin_mm));
  const auto data = sampled_vector(grid, values);
  Random random(4);
  for (int draw = 0; draw < 500; ++draw) {
    const glm::dvec3 lps = grid.lps_from_index(test::some_index(grid, random, -1.0));
    const glm::dvec3 x = volume_from_lps(lps), v = turned(slope * (lps - grid.origin_mm));
    EXPECT_LT(glm::length(data->vector(x) - v), 3e-5);
    EXPECT_NEAR(data->scalar(x), glm::length(v), 3e-5);
    const glm::dmat3 jacobian = data->vector_jacobian(x);
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 axis(0.0);
      axis[a] = 1.0;
      EXPECT_LT(glm::length(jacobian[a] - turned(slope * lps_from_volume(axis))), 0.05);
    }
  }
}

TEST(FrameData, MagnitudeOfVectorsHasTheGradientThatItsJacobianGives) {
  Random random(6);
  const Grid grid = test::oblique_grid();
  const auto data = sampled_vector(grid, random_vectors(grid, random));
  for (int draw = 0; draw < 200; ++draw) {
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(test::some_index(grid, random)));
    const glm::dvec3 v = data->vector(x);
    const glm::dvec3 expected = glm::transpose(data->vector_jacobian(x)) * v / glm::length(v);
    EXPECT_LT(glm::length(data->scalar_gradient(x) - expected), 1e-9);
  }
  const auto still = sampled_vector(grid, std::vector<glm::vec3>(grid.count(), glm::vec3(0.0F)));
  EXPECT_EQ(still->scalar_gradient(glm::dvec3(0.0)), glm::dvec3(0.0));
}

TEST(FrameData, KnowsItsBoxAndItsDetail) {
  Random random(7);
  const Grid grid = test::oblique_grid();
  const auto data = sampled_scalar(random_volume(grid, random));
  EXPECT_NEAR(data->detail_m(), 0.7e-3, 1e-15);
  EXPECT_FALSE(data->is_vector());
  for (int draw = 0; draw < 500; ++draw) {
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(test::some_index(grid, random, 0.5)));
    for (int a = 0; a < 3; ++a) {
      EXPECT_GE(x[a], data->low_m()[a]);
      EXPECT_LE(x[a], data->high_m()[a]);
    }
  }
}

TEST(FrameData, ReadsNothingOutsideItsSamplesWhateverItIsAsked) {
  Random random(8);
  const Grid grid = test::cube_grid(3, 1.0);
  const auto scalars = sampled_scalar(random_volume(grid, random));
  const auto vectors = sampled_vector(grid, random_vectors(grid, random));
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e300, -1e300}) {
    for (const FrameData* data : {scalars.get(), vectors.get()}) {
      EXPECT_LE(std::abs(data->scalar({bad, 0.0, 0.0})), 2.0) << bad;
      EXPECT_LE(std::abs(data->vector({0.0, bad, bad}).x), 1e5) << bad;
    }
  }
}

}  // namespace
}  // namespace palpate
