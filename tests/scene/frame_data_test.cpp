#include "module/scene/frame_data.h"

#include <gtest/gtest.h>

#include <limits>

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

/// A direction of the patient (LPS) along volume space's axes, without the change of unit.
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
    const glm::dvec3 lps = grid.lps_from_index(test::some_index(grid, random));
    const glm::dvec3 x = volume_from_lps(lps);
    // Samples are floats of up to 300: 2e-5 each, and 4e-5 over a cell of 0.7 mm as slope.
    EXPECT_NEAR(data->scalar(x), 10.0 + glm::dot(per_mm, lps), 4e-5) << "draw " << draw;
    EXPECT_LT(glm::length(data->scalar_gradient(x) - 1e3 * turned(per_mm)), 0.15) << draw;
  }
}

TEST(FrameData, HasTheValuesOfTheVolumeItWasMadeFrom) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Grid grid = test::oblique_grid();
    const Volume volume = random_volume(grid, random);
    const auto data = sampled_scalar(volume);
    for (int draw = 0; draw < 200; ++draw) {
      const glm::dvec3 index = test::some_index(grid, random, 2.0);
      // The oracle's weights are floats.
      EXPECT_NEAR(data->scalar(volume_from_lps(grid.lps_from_index(index))), sample(volume, index),
                  1e-6)
          << "seed " << seed << " draw " << draw;
    }
  }
}

/// The definition, slowly: central differences at every sample (one-sided at the border) as three
/// volumes, blended as values are.
glm::dvec3 slow_gradient(const Volume& volume, glm::dvec3 index) {
  const Grid& grid = volume.grid;
  glm::dvec3 per_index(0.0);
  for (int a = 0; a < 3; ++a) {
    Volume slopes{grid, std::vector<float>(grid.count())};
    for (int k = 0; k < grid.size.z; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          glm::ivec3 low(i, j, k), high(i, j, k);
          low[a] = std::max(low[a] - 1, 0);
          high[a] = std::min(high[a] + 1, grid.size[a] - 1);
          const float rise = volume.at(high.x, high.y, high.z) - volume.at(low.x, low.y, low.z);
          slopes.values[grid.offset(i, j, k)] = rise / float(std::max(1, high[a] - low[a]));
        }
    per_index[a] = sample(slopes, index);
  }
  return 1e3 * turned(grid.direction * (per_index / grid.spacing_mm));
}

TEST(FrameData, GradientIsTheBlendOfCentralDifferences) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    Grid grid = test::oblique_grid();
    if (seed == 2) grid.size = {1, 5, 4};
    if (seed == 3) grid.size = {2, 1, 3};
    const Volume volume = random_volume(grid, random);
    const auto data = sampled_scalar(volume);
    for (int draw = 0; draw < 50; ++draw) {
      const glm::dvec3 index = test::some_index(grid, random);
      const glm::dvec3 gradient =
          data->scalar_gradient(volume_from_lps(grid.lps_from_index(index)));
      // Float slopes and weights in the oracle, per m: 1e-7 * 1e3 / 0.7, a few times.
      EXPECT_LT(glm::length(gradient - slow_gradient(volume, index)), 2e-3)
          << "seed " << seed << " draw " << draw;
    }
  }
}

TEST(FrameData, GradientIsContinuousEverywhereAndZeroOutside) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const Grid grid = test::oblique_grid();
    const auto data = sampled_scalar(random_volume(grid, random));
    for (int walk = 0; walk < 40; ++walk) {
      const glm::dvec3 from = test::some_index(grid, random, 1.5);
      const glm::dvec3 to = test::some_index(grid, random, 1.5);
      glm::dvec3 last(0.0);
      for (int step = 0; step <= 4000; ++step) {
        const glm::dvec3 index = from + (step / 4000.0) * (to - from);
        const glm::dvec3 here = data->scalar_gradient(volume_from_lps(grid.lps_from_index(index)));
        const bool outside = glm::any(glm::lessThan(index, glm::dvec3(-0.5))) ||
                             glm::any(glm::greaterThan(index, glm::dvec3(grid.size) - 0.5));
        if (outside) {
          ASSERT_EQ(here, glm::dvec3(0.0));
        }
        // Slopes are up to 2 per 0.7 mm and change by no more than some ten times that in a
        // voxel; a step is 1 / 200 of a voxel.
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
    const glm::dvec3 lps = grid.lps_from_index(test::some_index(grid, random));
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
