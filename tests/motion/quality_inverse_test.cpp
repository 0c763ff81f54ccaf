#include "compute/motion/quality_inverse.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate {
namespace {

using test::field_of;
using test::grid_at_origin;
using test::oblique_grid;

// The solver's own tolerance, a thousandth of a voxel, times the inverse Jacobian (at most 2 here),
// and float rounding.
constexpr double kSolved = 3e-3;

TEST(InverseOf, AShiftIsTheOppositeShift) {
  const Field u = field_of(oblique_grid(), [](glm::dvec3) { return glm::dvec3(3.0, -1.0, 7.0); });
  const Inverse inverse = inverse_of(u, u.grid);
  EXPECT_EQ(inverse.unconverged, 0u);
  for (const glm::vec3& w : inverse.w.u_mm) {
    ASSERT_LT(glm::length(w - glm::vec3(-3.0F, 1.0F, -7.0F)), 1e-5F);
  }
}

TEST(InverseOf, ALinearMapIsTheInverseMatrixEvenWhereTheFixedPointDiverges) {
  // x + u = (I + a) x with |a| > 1: the plain fixed-point iteration diverges, Newton's method does
  // not.
  const glm::dmat3 a(1.4, 0.2, 0.0, -0.2, 1.2, 0.1, 0.0, 0.0, 0.3);
  Grid grid = grid_at_origin(31);
  grid.origin_mm = glm::dvec3(-15.0);
  const Field u = field_of(grid, [&](glm::dvec3 p) { return a * p; });
  const Inverse inverse = inverse_of(u, grid);
  EXPECT_EQ(inverse.unconverged, 0u);
  const glm::dmat3 back = glm::inverse(glm::dmat3(1.0) + a) - glm::dmat3(1.0);
  for (int k = 5; k < 26; ++k) {
    const glm::dvec3 y = grid.lps_from_index({10, 20, k});
    EXPECT_LT(glm::length(glm::dvec3(inverse.w.at(10, 20, k)) - back * y), kSolved) << "k = " << k;
  }
}

TEST(InverseOf, TheHeartsBeatIsTheBeatBack) {
  const Grid grid = heart_grid(64);
  const Inverse inverse = inverse_of(shell_truth(grid, 0, 2), grid);
  EXPECT_EQ(inverse.unconverged, 0u);
  const auto error = endpoint_error(inverse.w, shell_truth(grid, 2, 0));
  ASSERT_TRUE(error);
  // Linear interpolation of u at 2 mm: h^2/8 |u''| with |u''| up to about 0.1 / mm for the whole
  // motion.
  EXPECT_LT(error->mm.max, 0.1);
}

TEST(InverseOf, ItsOwnFieldIsConsistentOnAnotherGrid) {
  const Field u = shell_truth(coarsened(heart_grid(64), {2, 2, 2}), 0, 1);
  Grid onto = heart_grid(48);
  onto.direction = test::some_rotation(5);
  onto.origin_mm = onto.direction * onto.origin_mm;
  const Inverse inverse = inverse_of(u, onto);
  EXPECT_EQ(inverse.unconverged, 0u);
  for (int n = 0; n < 48; ++n) {
    const glm::dvec3 y = onto.lps_from_index({n, 47 - n, 20});
    const glm::dvec3 w = glm::dvec3(inverse.w.at(n, 47 - n, 20));
    EXPECT_LT(glm::length(w + sample_at_lps(u, y + w)), kSolved * onto.finest_mm());
  }
}

TEST(InverseOf, OfAFoldedFieldTheResidualSaysHowFarItHolds) {
  std::mt19937 engine(4);
  Field u = still_field(grid_at_origin(17));
  for (glm::vec3& v : u.u_mm) {
    for (int axis = 0; axis < 3; ++axis)
      v[axis] = 4.0F * float(double(engine()) / 4294967295.0 - 0.5);
  }
  const Inverse inverse = inverse_of(u, u.grid);
  size_t missed = 0;
  for (int k = 0; k < 17; ++k)
    for (int j = 0; j < 17; ++j)
      for (int i = 0; i < 17; ++i) {
        const size_t n = u.grid.offset(i, j, k);
        const glm::dvec3 w = glm::dvec3(inverse.w.u_mm[n]);
        const double gap = glm::length(w + sample_at_lps(u, glm::dvec3(i, j, k) + w));
        // w is stored in float and the field is steep here: up to 4 mm per mm.
        ASSERT_NEAR(gap, double(inverse.residual_mm[n]), 1e-5);
        missed += inverse.residual_mm[n] > 1e-3F;
      }
  EXPECT_EQ(inverse.unconverged, missed);
}

TEST(InverseOf, NotANumberIsReportedAndDoesNotSpread) {
  Field u = field_of(grid_at_origin(16), [](glm::dvec3) { return glm::dvec3(0.5, 0.0, 0.0); });
  u.u_mm[u.grid.offset(8, 8, 8)].x = std::numeric_limits<float>::quiet_NaN();
  const Inverse inverse = inverse_of(u, u.grid);
  EXPECT_GT(inverse.unconverged, 0u);
  // At most the samples whose cell contains the broken sample.
  EXPECT_LT(inverse.unconverged, 28u);
  EXPECT_LT(inverse.residual_mm[u.grid.offset(12, 8, 8)], 1e-3F);
}

}  // namespace
}  // namespace palpate
