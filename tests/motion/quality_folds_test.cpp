#include "compute/motion/quality_folds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate {
namespace {

using test::field_of;
using test::oblique_grid;

// A determinant of order one from float differences of displacements of up to 50 mm over 0.7 mm.
constexpr double kFloatDet = 1e-4;

/// The definition, voxel by voxel in double precision and in LPS axes: the oracle of folds().
Folds plain_folds(const Field& u) {
  const Grid& g = u.grid;
  Folds result;
  result.min_det = std::numeric_limits<double>::infinity();
  for (int k = 0; k < g.size.z; ++k)
    for (int j = 0; j < g.size.y; ++j)
      for (int i = 0; i < g.size.x; ++i) {
        double least = std::numeric_limits<double>::infinity();
        for (int corner = 0; corner < 8; ++corner) {
          glm::dmat3 by_index(0.0);
          for (int axis = 0; axis < 3; ++axis) {
            glm::ivec3 a(i, j, k);
            int step = (corner >> axis) & 1 ? 1 : -1;
            if (a[axis] + step < 0 || a[axis] + step >= g.size[axis]) step = -step;
            glm::ivec3 b = a;
            b[axis] += step;
            if (b[axis] < 0 || b[axis] >= g.size[axis]) continue;
            const glm::dvec3 du = glm::dvec3(u.at(b.x, b.y, b.z)) - glm::dvec3(u.at(a.x, a.y, a.z));
            by_index[axis] = du / (step * g.spacing_mm[axis]);
          }
          const glm::dmat3 gradient = by_index * glm::transpose(g.direction);
          least = std::min(least, glm::determinant(glm::dmat3(1.0) + gradient));
        }
        ++result.voxels;
        result.folded += least <= 0.0;
        result.min_det = std::min(result.min_det, least);
      }
  return result;
}

TEST(Folds, OfALinearMapAreItsDeterminantOnAnyGrid) {
  const glm::dmat3 a(0.1, 0.2, 0.0, -0.3, 0.15, 0.05, 0.02, 0.0, -0.25);
  const Field u = field_of(oblique_grid(), [&](glm::dvec3 p) { return a * p; });
  const Folds found = folds(u);
  EXPECT_EQ(found.voxels, u.grid.count());
  EXPECT_EQ(found.folded, 0u);
  EXPECT_NEAR(found.min_det, glm::determinant(glm::dmat3(1.0) + a), kFloatDet);
  EXPECT_NEAR(found.sd_log_det, 0.0, kFloatDet);
}

TEST(Folds, OfAMirrorAreAllVoxels) {
  const Field u =
      field_of(oblique_grid(), [](glm::dvec3 p) { return glm::dvec3(-2.0 * p.x, 0.0, 0.0); });
  const Folds found = folds(u);
  EXPECT_EQ(found.folded, u.grid.count());
  EXPECT_NEAR(found.min_det, -1.0, kFloatDet);
}

TEST(Folds, AgreeWithTheDefinitionOnRandomFields) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    std::mt19937 engine(seed);
    Field u = still_field(oblique_grid());
    for (glm::vec3& v : u.u_mm) {
      for (int axis = 0; axis < 3; ++axis)
        v[axis] = 1.2F * float(double(engine()) / 4294967295.0 - 0.5);
    }
    const Folds found = folds(u);
    const Folds expected = plain_folds(u);
    EXPECT_GT(expected.folded, 0u);
    EXPECT_LT(expected.folded, expected.voxels);
    // A determinant within rounding of zero may be on either side.
    EXPECT_NEAR(double(found.folded), double(expected.folded), 1.0) << "seed " << seed;
    EXPECT_NEAR(found.min_det, expected.min_det, kFloatDet) << "seed " << seed;
  }
}

TEST(Folds, SeesTheFoldBetweenTwoSamplesThatCentralDifferencesMiss) {
  Field u = still_field(test::grid_at_origin(9));
  u.u_mm[u.grid.offset(4, 4, 4)] = {1.5F, 0.0F, 0.0F};
  // Sample 4 moves past sample 5: the one-sided difference there is -1.5 mm per mm, the central one
  // only -0.75.
  const Folds found = folds(u);
  EXPECT_GT(found.folded, 0u);
  EXPECT_NEAR(found.min_det, -0.5, kFloatDet);
}

TEST(Folds, LookOnlyInsideTheMask) {
  Field u = still_field(test::grid_at_origin(9));
  u.u_mm[u.grid.offset(4, 4, 4)] = {1.5F, 0.0F, 0.0F};
  Mask far{u.grid, std::vector<uint8_t>(u.grid.count())};
  far.values[u.grid.offset(1, 1, 1)] = 1;
  const Folds found = folds(u, &far);
  EXPECT_EQ(found.voxels, 1u);
  EXPECT_EQ(found.folded, 0u);
}

TEST(Folds, CountNotANumberAsFolded) {
  Field u = still_field(test::grid_at_origin(9));
  u.u_mm[u.grid.offset(4, 4, 4)].y = std::numeric_limits<float>::quiet_NaN();
  const Folds found = folds(u);
  EXPECT_EQ(found.not_finite, 1u);
  EXPECT_EQ(found.folded, 7u);  // the sample and its six neighbours
}

TEST(Folds, WorkOnASingleSliceAndASingleSample) {
  Grid slice = test::grid_at_origin(6);
  slice.size.z = 1;
  const Field u = field_of(slice, [](glm::dvec3 p) { return glm::dvec3(0.5 * p.x, 0.0, 0.0); });
  EXPECT_NEAR(folds(u).min_det, 1.5, kFloatDet);
  EXPECT_NEAR(folds(still_field(test::grid_at_origin(1))).min_det, 1.0, kFloatDet);
}

TEST(Folds, SdOfLogDetIsThatOfTwoHalvesOfDifferentGrowth) {
  // u = +-g x on either side of x = 20: det is 1.2 for half of the samples and 0.8 for the others.
  const Field u = field_of(test::grid_at_origin(41), [](glm::dvec3 p) {
    const double x = p.x - 20.0;
    return glm::dvec3(x > 0.0 ? 0.2 * x : -0.2 * x, 0.0, 0.0);
  });
  const double expected = 0.5 * (std::log(1.2) - std::log(0.8));
  // The one sample at the kink in 41 has log det 0.
  EXPECT_NEAR(folds(u).sd_log_det, expected, expected * 0.02);
}

TEST(Folds, OfTheHeartAreNone) {
  const Folds found = folds(shell_truth(heart_grid(64), 0, 2));
  EXPECT_EQ(found.folded, 0u);
  EXPECT_GT(found.min_det,
            0.4);  // the phantom's header promises 0.5; one-sided differences add a little
}

}  // namespace
}  // namespace palpate
