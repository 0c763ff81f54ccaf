#include "module/scene/analytic_data.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compute/volume/phantom.h"
#include "module/scene/transform.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

glm::dvec3 unit(int axis) {
  glm::dvec3 v(0.0);
  v[axis] = 1.0;
  return v;
}

TEST(AnalyticShell, IsWhatThePhantomSamples) {
  const Grid grid = heart_grid(32);
  const Sequence sampled = shell_phantom(grid, 4, 5, 0.0);
  for (int frame = 0; frame < 4; ++frame) {
    const auto data = analytic_shell(frame, 4, 5, 4.0);
    Random random{uint32_t(frame)};
    for (int draw = 0; draw < 500; ++draw) {
      const glm::ivec3 at(test::some_index(grid, random));
      const glm::dvec3 x = volume_from_lps(grid.lps_from_index(glm::dvec3(at)));
      // Samples are floats of up to 1150; the place is converted from mm to m and back.
      EXPECT_NEAR(data->scalar(x), double(sampled.frames[size_t(frame)].at(at.x, at.y, at.z)),
                  1e-3);
    }
  }
}

TEST(AnalyticShell, HasTheGradientOfItsValue) {
  Random random(2);
  const auto data = analytic_shell(1);
  for (int draw = 0; draw < 2000; ++draw) {
    const glm::dvec3 x = random.vector(0.06);
    const glm::dvec3 gradient = data->scalar_gradient(x);
    constexpr double kStepM = 1e-7;
    for (int a = 0; a < 3; ++a) {
      const glm::dvec3 aside = kStepM * unit(a);
      const double slope = (data->scalar(x + aside) - data->scalar(x - aside)) / (2.0 * kStepM);
      // Edges are 900 high in 1.5 mm: slopes up to 1e6 per m and curvatures of 1e9 per m^2, with
      // kinks that may be within the step of 1e-7; rounding is 1e-13 / 1e-7 of 1000.
      EXPECT_NEAR(gradient[a], slope, 200.0) << "draw " << draw;
    }
  }
}

TEST(AnalyticShell, HasNoSlopeThatIsNotANumberAtItsCentre) {
  const auto data = analytic_shell(2);
  EXPECT_TRUE(std::isfinite(data->scalar(glm::dvec3(0.0))));
  const glm::dvec3 gradient = data->scalar_gradient(glm::dvec3(0.0));
  EXPECT_TRUE(std::isfinite(gradient.x + gradient.y + gradient.z));
}

TEST(AnalyticHeart, IsWhatThePhantomSays) {
  Random random(6);
  const auto data = analytic_heart(2, 8, 5, 1.0);
  for (int draw = 0; draw < 500; ++draw) {
    const glm::dvec3 x = random.vector(0.06), lps = lps_from_volume(x);
    EXPECT_EQ(data->scalar(x), heart_value(lps, 2, 8, 5, 1.0));
    EXPECT_EQ(data->scalar_gradient(x), 1e6 * volume_from_lps(heart_gradient(lps, 2, 8, 5, 1.0)));
  }
}

TEST(PointCharges, FollowCoulombFarAwayAndStayFiniteNearby) {
  const auto one =
      point_charges({{{0.01, 0.02, 0.03}, 5.0, 0.001}}, glm::dvec3(-0.1), glm::dvec3(0.1));
  EXPECT_NEAR(one->scalar({0.01, 0.02, 0.03}), 5000.0, 1e-9);
  EXPECT_EQ(one->scalar_gradient({0.01, 0.02, 0.03}), glm::dvec3(0.0));
  // At 1 m the softening is 1e-6 of the square of the distance, half of that of the potential.
  EXPECT_NEAR(one->scalar({1.01, 0.02, 0.03}), 5.0, 5e-6);
  EXPECT_NEAR(one->scalar_gradient({1.01, 0.02, 0.03}).x, -5.0, 1e-5);
  EXPECT_EQ(one->low_m(), glm::dvec3(-0.1));
  EXPECT_EQ(one->high_m(), glm::dvec3(0.1));
}

TEST(Dichloroethane, HasTheGeometryItIsSaidToHave) {
  const auto atoms = dichloroethane_atoms_m();
  ASSERT_EQ(atoms.size(), 8U);
  const auto angstrom = [&](size_t a, size_t b) { return glm::length(atoms[a] - atoms[b]) / 0.02; };
  EXPECT_NEAR(angstrom(0, 1), 1.79, 1e-12);
  EXPECT_NEAR(angstrom(4, 5), 1.79, 1e-12);
  EXPECT_NEAR(angstrom(1, 5), 1.53, 1e-12);
  for (const size_t hydrogen : {2, 3}) EXPECT_NEAR(angstrom(1, hydrogen), 1.09, 1e-12);
  const auto cosine = [&](size_t a, size_t b) {
    return glm::dot(glm::normalize(atoms[a] - atoms[1]), glm::normalize(atoms[b] - atoms[1]));
  };
  const double said = std::cos(109.5 / 180.0 * std::acos(-1.0));
  for (const size_t other : {0, 2, 3}) EXPECT_NEAR(cosine(5, other), said, 1e-12);
  // Three bonds at 120 degrees to each other and at 109.5 to the fourth: 109.4 between them.
  EXPECT_NEAR(cosine(0, 2), said, 3e-3);
  EXPECT_NEAR(cosine(2, 3), said, 3e-3);
  // About 0.1 m wide: from chlorine to chlorine, without the atoms' own size.
  EXPECT_NEAR(glm::length(atoms[0] - atoms[4]), 0.087, 1e-3);
}

TEST(Dichloroethane, IsNeutralSymmetricAndNegativeAtItsChlorines) {
  const auto data = dichloroethane();
  const auto atoms = dichloroethane_atoms_m();
  EXPECT_LT(data->scalar(atoms[0]), 0.0);
  EXPECT_GT(data->scalar(atoms[2]), 0.0);
  Random random(3);
  for (int draw = 0; draw < 100; ++draw) {
    const glm::dvec3 x = random.vector(0.08);
    EXPECT_NEAR(data->scalar(x), data->scalar(-x), 1e-12);
    EXPECT_LT(glm::length(data->scalar_gradient(x) + data->scalar_gradient(-x)), 1e-10);
    // No charge and, by symmetry, no dipole: it falls with the third power of the distance.
    const glm::dvec3 far = 2.0 * glm::normalize(x);
    EXPECT_NEAR(data->scalar(2.0 * far) / data->scalar(far), 0.125, 0.01);
  }
}

TEST(Dichloroethane, HasTheDerivativesOfItsPotential) {
  const auto data = dichloroethane();
  Random random(4);
  for (int draw = 0; draw < 500; ++draw) {
    const glm::dvec3 x = random.vector(0.08);
    const glm::dmat3 jacobian = data->vector_jacobian(x);
    EXPECT_EQ(data->vector(x), data->scalar_gradient(x));
    constexpr double kStepM = 1e-6;
    for (int a = 0; a < 3; ++a) {
      const glm::dvec3 aside = kStepM * unit(a);
      const double slope = (data->scalar(x + aside) - data->scalar(x - aside)) / (2.0 * kStepM);
      // Third derivatives are at most a few V / (10 mm)^3 = 1e7: 1e-12 * 1e7, and rounding.
      EXPECT_NEAR(data->scalar_gradient(x)[a], slope, 1e-4);
      const glm::dvec3 bend = (data->vector(x + aside) - data->vector(x - aside)) / (2.0 * kStepM);
      EXPECT_LT(glm::length(jacobian[a] - bend), 1e-2);
    }
  }
}

}  // namespace
}  // namespace palpate
