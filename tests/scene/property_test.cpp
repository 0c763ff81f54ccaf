#include "module/scene/property.h"

#include <gtest/gtest.h>

#include <cmath>

#include "module/scene/analytic_data.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

/// Vectors along volume space's axes, given by a function of the place, on a grid of 2 mm.
template <class Function>
std::shared_ptr<const FrameData> flow(const Function& vector_at) {
  const Grid grid = test::cube_grid(24, 2.0);
  std::vector<glm::vec3> values(grid.count());
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = volume_from_lps(grid.lps_from_index(glm::dvec3(i, j, k)));
        const glm::dvec3 v = vector_at(x);
        values[grid.offset(i, j, k)] = glm::vec3(v.x, -v.z, v.y);
      }
  return sampled_vector(grid, values);
}

/// v = spin x r + swell r / 3 + offset: everywhere its curl is twice the spin and its divergence
/// the swell.
std::shared_ptr<const FrameData> swirl(glm::dvec3 spin, double swell, glm::dvec3 offset) {
  return flow([=](glm::dvec3 x) { return glm::cross(spin, x) + swell / 3.0 * x + offset; });
}

// Samples are floats of up to 1: 6e-8 over cells of 2 mm, three slopes and their signs.
constexpr double kLargestSlope = 4e-4;

TEST(Property, FindsCurlAndDivergenceOfASwirl) {
  const glm::dvec3 spin(3.0, -4.0, 12.0), offset(0.1, 0.2, -0.3);
  const auto data = swirl(spin, 9.0, offset);
  Random random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const glm::dvec3 x = random.vector(0.02);
    const glm::dvec3 v = glm::cross(spin, x) + 3.0 * x + offset;
    EXPECT_LT(glm::length(vector_of(*data, VectorProperty::kVector, x) - v), 1e-6);
    EXPECT_LT(glm::length(vector_of(*data, VectorProperty::kCurl, x) - 2.0 * spin), kLargestSlope);
    EXPECT_NEAR(scalar_of(*data, ScalarProperty::kDivergence, x), 9.0, kLargestSlope);
    EXPECT_NEAR(scalar_of(*data, ScalarProperty::kCurlMagnitude, x), 26.0, kLargestSlope);
    EXPECT_NEAR(scalar_of(*data, ScalarProperty::kMagnitude, x), glm::length(v), 1e-6);
    EXPECT_NEAR(scalar_of(*data, ScalarProperty::kValue, x), glm::length(v), 1e-6);
    // Both are constant: differences over 2 mm of values that are right to kLargestSlope.
    EXPECT_LT(glm::length(gradient_of(*data, ScalarProperty::kDivergence, x)),
              kLargestSlope / 1e-3);
    EXPECT_LT(glm::length(gradient_of(*data, ScalarProperty::kCurlMagnitude, x)),
              kLargestSlope / 1e-3);
  }
}

TEST(Property, OfScalarDataIsThatOfItsGradient) {
  const auto data = dichloroethane();
  Random random(2);
  for (int draw = 0; draw < 200; ++draw) {
    const glm::dvec3 x = random.vector(0.06);
    const glm::dvec3 gradient = data->scalar_gradient(x);
    EXPECT_EQ(scalar_of(*data, ScalarProperty::kValue, x), data->scalar(x));
    EXPECT_EQ(scalar_of(*data, ScalarProperty::kGradientMagnitude, x), glm::length(gradient));
    EXPECT_EQ(scalar_of(*data, ScalarProperty::kMagnitude, x), glm::length(gradient));
    EXPECT_EQ(vector_of(*data, VectorProperty::kGradient, x), gradient);
    EXPECT_EQ(gradient_of(*data, ScalarProperty::kValue, x), gradient);
    // The gradient of a potential has no curl.
    EXPECT_EQ(vector_of(*data, VectorProperty::kCurl, x), glm::dvec3(0.0));
  }
}

/// A property's gradient compared with differences of the property, to a fraction of the largest
/// slope found.
void expect_gradients(const FrameData& data, ScalarProperty property, double reach_m, double share,
                      uint32_t seed) {
  Random random(seed);
  double largest = 0.0, worst = 0.0;
  for (int draw = 0; draw < 300; ++draw) {
    const glm::dvec3 x = random.vector(reach_m);
    const glm::dvec3 gradient = gradient_of(data, property, x);
    glm::dvec3 numeric;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 aside(0.0);
      aside[a] = 1e-6;
      numeric[a] =
          (scalar_of(data, property, x + aside) - scalar_of(data, property, x - aside)) / 2e-6;
    }
    largest = std::max(largest, glm::length(numeric));
    worst = std::max(worst, glm::length(gradient - numeric));
  }
  EXPECT_GT(largest, 0.0);
  EXPECT_LE(worst, share * largest) << "property " << int(property) << " seed " << seed;
}

TEST(Property, HasTheGradientsOfItsValues) {
  const auto molecule = dichloroethane();
  // Closed forms.
  expect_gradients(*molecule, ScalarProperty::kValue, 0.06, 1e-6, 1);
  expect_gradients(*molecule, ScalarProperty::kGradientMagnitude, 0.06, 1e-4, 2);
  expect_gradients(*molecule, ScalarProperty::kMagnitude, 0.06, 1e-4, 3);
}

TEST(Property, DifferencesAreExactForVectorsThatGrowWithTheSquareOfThePlace) {
  // Central differences of a parabola are exact, at samples and interpolated.
  const double k = 100.0;
  const auto sheared = flow([=](glm::dvec3 x) { return glm::dvec3(0.0, 0.0, k * x.x * x.x); });
  const auto swelling = flow([=](glm::dvec3 x) { return glm::dvec3(k * x.x * x.x, 0.0, 0.0); });
  Random random(5);
  for (int draw = 0; draw < 200; ++draw) {
    // At least two voxels away from x = 0, where lengths have a kink, and away from the border.
    glm::dvec3 x = random.vector(0.017);
    x.x = (x.x < 0.0 ? -1.0 : 1.0) * (0.004 + 0.75 * std::abs(x.x));
    const glm::dvec3 expected(x.x < 0.0 ? -2.0 * k : 2.0 * k, 0.0, 0.0);
    // Floats of up to 0.05: 3e-9 over 2 mm twice, and their signs; of a slope of 200.
    constexpr double kTwice = 0.02;
    EXPECT_NEAR(scalar_of(*sheared, ScalarProperty::kCurlMagnitude, x), 2.0 * k * std::abs(x.x),
                1e-4);
    EXPECT_LT(glm::length(gradient_of(*sheared, ScalarProperty::kCurlMagnitude, x) - expected),
              kTwice);
    EXPECT_LT(glm::length(gradient_of(*swelling, ScalarProperty::kDivergence, x) -
                          glm::dvec3(2.0 * k, 0.0, 0.0)),
              kTwice);
    EXPECT_NEAR(scalar_of(*swelling, ScalarProperty::kGradientMagnitude, x),
                2.0 * k * std::abs(x.x), 1e-4);
    EXPECT_LT(glm::length(gradient_of(*swelling, ScalarProperty::kGradientMagnitude, x) - expected),
              kTwice);
  }
}

TEST(Property, IsZeroAndNotNaNWhereTheVectorVanishes) {
  const auto data = swirl(glm::dvec3(0.0), 0.0, glm::dvec3(0.0));
  const glm::dvec3 x(1e-3, 2e-3, 3e-3);
  for (const ScalarProperty property :
       {ScalarProperty::kValue, ScalarProperty::kGradientMagnitude, ScalarProperty::kMagnitude,
        ScalarProperty::kDivergence, ScalarProperty::kCurlMagnitude}) {
    EXPECT_EQ(scalar_of(*data, property, x), 0.0);
    EXPECT_EQ(gradient_of(*data, property, x), glm::dvec3(0.0));
  }
}

}  // namespace
}  // namespace palpate
