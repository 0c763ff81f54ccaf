#include "module/scene/spline_coefficients.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "module/scene/frame_data.h"
#include "module/scene/transform.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

Volume random_volume(glm::ivec3 size, Random& random) {
  Grid grid = test::cube_grid(1, 1.0);
  grid.size = size;
  Volume volume{grid, std::vector<float>(grid.count())};
  for (float& value : volume.values) value = float(random.draw(-1.0, 1.0));
  return volume;
}

/// One axis by the formula.
Volume filtered(const Volume& from, int axis) {
  constexpr double kTaps[5] = {-31.0, 84.0, 134.0, 84.0, -31.0};
  Volume to = from;
  const glm::ivec3 size = from.grid.size;
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const glm::ivec3 at(x, y, z);
        if (size[axis] < 5 || at[axis] < 2 || at[axis] + 2 >= size[axis]) continue;
        double sum = 0.0;
        for (int tap = 0; tap < 5; ++tap) {
          glm::ivec3 q = at;
          q[axis] += tap - 2;
          sum += kTaps[tap] / 240.0 * double(from.at(q.x, q.y, q.z));
        }
        to.values[to.grid.offset(x, y, z)] = float(sum);
      }
  return to;
}

TEST(SplineCoefficients, AreWhatTheFormulaSaysAlongEachAxis) {
  for (const glm::ivec3 size : {glm::ivec3(9, 7, 6), {5, 4, 8}, {1, 6, 5}, {64, 3, 70}}) {
    Random random(7);
    const Volume samples = random_volume(size, random);
    Volume expected = samples;
    for (int axis = 0; axis < 3; ++axis) expected = filtered(expected, axis);
    const Volume found = spline_coefficients(samples);
    for (size_t i = 0; i < found.values.size(); ++i)
      ASSERT_NEAR(found.values[i], expected.values[i], 3e-7) << i;  // a few float roundings of 1
  }
}

TEST(SplineCoefficients, MakeTheSplineExactForCubics) {
  const Grid grid = test::cube_grid(14, 1.0);
  Random random(3);
  for (int draw = 0; draw < 20; ++draw) {
    double c[4][3];
    for (auto& power : c)
      for (double& axis : power) axis = random.draw(-1.0, 1.0);
    const auto cubic = [&](glm::dvec3 mm) {
      const glm::dvec3 t = 0.2 * mm;
      double product = 1.0;
      for (int a = 0; a < 3; ++a)
        product *= c[0][a] + t[a] * (c[1][a] + t[a] * (c[2][a] + t[a] * c[3][a]));
      return product;
    };
    Volume volume{grid, std::vector<float>(grid.count())};
    double largest = 0.0;
    for (int k = 0; k < grid.size.z; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const double value = cubic(grid.lps_from_index({i, j, k}));
          volume.values[grid.offset(i, j, k)] = float(value);
          largest = std::max(largest, std::abs(value));
        }
    const auto data = sampled_scalar(volume);
    for (int place = 0; place < 100; ++place) {
      // The samples beside the border are not filtered: the exact part begins three and a half
      // samples further in.
      const glm::dvec3 mm = grid.lps_from_index(test::some_index(grid, random, -3.5));
      EXPECT_NEAR(data->scalar(volume_from_lps(mm)), cubic(mm), 1e-6 * largest) << draw;
    }
  }
}

TEST(SplineCoefficients, LetThroughWavesAsTheFormulaOfTheirLengthSays) {
  const Grid grid = test::cube_grid(24, 1.0);
  for (int axis = 0; axis < 3; ++axis)
    for (const double per_sample : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5}) {
      const double w = 2.0 * std::numbers::pi * per_sample;
      Volume volume{grid, std::vector<float>(grid.count())};
      for (int k = 0; k < grid.size.z; ++k)
        for (int j = 0; j < grid.size.y; ++j)
          for (int i = 0; i < grid.size.x; ++i)
            volume.values[grid.offset(i, j, k)] = float(std::cos(w * glm::ivec3(i, j, k)[axis]));
      const double passes = (134.0 + 168.0 * std::cos(w) - 62.0 * std::cos(2.0 * w)) / 240.0;
      const Volume found = spline_coefficients(volume);
      for (int at = 2; at < 22; ++at) {
        glm::ivec3 place(12, 12, 12);
        place[axis] = at;
        EXPECT_NEAR(found.at(place.x, place.y, place.z), passes * std::cos(w * at), 3e-7);
      }
      // The guaranteed values of the description.
      if (per_sample == 0.3) {
        EXPECT_NEAR(passes, 0.55, 0.01);
      }
      if (per_sample == 0.4) {
        EXPECT_LT(std::abs(passes), 0.1);
      }
    }
}

TEST(SplineCoefficients, KeepWhatIsNotFiniteToItself) {
  Random random(5);
  const Volume clean = random_volume({9, 9, 9}, random);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Volume volume = clean;
    const size_t at = volume.grid.offset(4, 4, 4);
    volume.values[at] = bad;
    const Volume found = spline_coefficients(volume);
    for (size_t i = 0; i < found.values.size(); ++i)
      EXPECT_EQ(std::isfinite(found.values[i]), i != at) << i;
  }
}

TEST(SplineCoefficients, SwingOverBySixPercentOfAStep) {
  Grid grid = test::cube_grid(20, 1.0);
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        volume.values[grid.offset(i, j, k)] = i < 10 ? 0.0F : 1.0F;
  const auto data = sampled_scalar(volume);
  double highest = 0.0;
  for (double i = 3.0; i < 17.0; i += 0.01)
    highest =
        std::max(highest, data->scalar(volume_from_lps(grid.lps_from_index({i, 10.0, 10.0}))));
  // From the taps: the maximum is a quarter of a voxel beyond the second sample inside.
  EXPECT_NEAR(highest, 1.0637, 1e-4);
}

}  // namespace
}  // namespace palpate
