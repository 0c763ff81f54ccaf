#include "module/scene/motion_map.h"

#include <gtest/gtest.h>

#include <limits>

#include "module/scene/transform.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using test::Random;

// The map compared with the oracle: u is stored as float (6e-8 of its size), positions are doubles.
constexpr double kStored = 2e-7;
// Slopes are differences of stored floats over a cell: 6e-8 of u / h, with u up to 10 cells here.
constexpr double kSlope = 5e-6;

glm::dmat3 turned(const glm::dmat3& lps) {
  glm::dmat3 volume;
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 axis(0.0);
    axis[a] = 1.0;
    volume[a] = volume_from_lps(lps * lps_from_volume(axis));
  }
  return volume;
}

double largest(const glm::dmat3& m) {
  double worst = 0.0;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) worst = std::max(worst, std::abs(m[c][r]));
  return worst;
}

double frobenius(const glm::dmat3& m) {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

TEST(MotionMap, IsExactForALinearFieldOnAnObliqueAnisotropicGrid) {
  const Grid grid = test::oblique_grid();
  const glm::dmat3 slope(0.1, -0.2, 0.05, 0.3, -0.15, 0.02, -0.07, 0.11, 0.21);
  const glm::dvec3 offset_mm(1.0, -2.0, 3.0);
  const auto map = MotionMap::of(test::linear_field(grid, offset_mm, slope));
  const glm::dvec3 centre = grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1));
  const glm::dmat3 expected = turned(slope);
  Random random(1);
  for (int draw = 0; draw < 1000; ++draw) {
    const glm::dvec3 lps = grid.lps_from_index(test::some_index(grid, random));
    const MotionSample at = map->sample(volume_from_lps(lps));
    const glm::dvec3 u = volume_from_lps(offset_mm + slope * (lps - centre));
    EXPECT_LT(glm::length(at.u_m - u), kStored * 0.02) << "draw " << draw;
    EXPECT_LT(largest(at.jacobian - expected), kSlope) << "draw " << draw;
    EXPECT_EQ(at.confidence, 1.0);
  }
}

TEST(MotionMap, AgreesWithTheFieldItWasMadeFromInsideAndOutside) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Grid grid = test::oblique_grid();
    const Field field = test::rough_field(grid, random, 5.0);
    const auto map = MotionMap::of(field);
    for (int draw = 0; draw < 200; ++draw) {
      const glm::dvec3 index = test::some_index(grid, random, 2.0);
      const glm::dvec3 x = volume_from_lps(grid.lps_from_index(index));
      const glm::dvec3 expected = volume_from_lps(sample(field, index));
      // The oracle's weights are floats: 6e-8 of differences of up to 10 mm on each axis.
      EXPECT_LT(glm::length(map->sample(x).u_m - expected), 3e-9) << "seed " << seed;
      EXPECT_LT(glm::length(map->sample(x).u_m - map->displacement(x)), 1e-15) << "seed " << seed;
    }
  }
}

TEST(MotionMap, GivesTheJacobianThatNumericDifferencesGive) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Grid grid = test::oblique_grid();
    const auto map = MotionMap::of(test::rough_field(grid, random, 1.0));
    for (int draw = 0; draw < 200; ++draw) {
      // Away from cell faces, where the derivative jumps.
      const glm::dvec3 whole = glm::floor(test::some_index(grid, random, 1.0));
      const glm::dvec3 index = whole + 0.5 + random.vector(0.4);
      const glm::dvec3 x = volume_from_lps(grid.lps_from_index(index));
      const MotionSample at = map->sample(x);
      constexpr double kStepM = 1e-6;
      for (int a = 0; a < 3; ++a) {
        glm::dvec3 step(0.0);
        step[a] = kStepM;
        const glm::dvec3 slope =
            (map->displacement(x + step) - map->displacement(x - step)) / (2.0 * kStepM);
        // Second differences over 1e-6 m of a trilinear field of slope 3 in cells of 0.7 mm.
        EXPECT_LT(glm::length(slope - at.jacobian[a]), 1e-6) << "seed " << seed << " axis " << a;
      }
    }
  }
}

TEST(MotionMap, HoldsTheBorderAndKnowsThatItDoes) {
  Random random(5);
  const Grid grid = test::cube_grid(5, 2.0);
  const auto map = MotionMap::of(test::rough_field(grid, random, 1.0));
  const glm::dvec3 inside = volume_from_lps(grid.lps_from_index({4.0, 1.3, 2.6}));
  const glm::dvec3 outside = volume_from_lps(grid.lps_from_index({9.0, 1.3, 2.6}));
  EXPECT_LT(glm::length(map->sample(inside).u_m - map->sample(outside).u_m), 1e-15);
  // L, the patient's first axis, is volume space's x.
  EXPECT_EQ(map->sample(outside).jacobian[0], glm::dvec3(0.0));
  EXPECT_GT(glm::length(map->sample(outside).jacobian[1]), 0.0);
}

TEST(MotionMap, OfOneSampleIsThatSampleEverywhere) {
  Field field = still_field(test::cube_grid(1, 3.0));
  field.u_mm[0] = {1.0F, 2.0F, 3.0F};
  const auto map = MotionMap::of(field);
  const MotionSample at = map->sample({0.1, -0.2, 0.3});
  EXPECT_LT(glm::length(at.u_m - glm::dvec3(1e-3, 3e-3, -2e-3)), 1e-9);
  EXPECT_EQ(largest(at.jacobian), 0.0);
  // The certificates have only the allowance for rounding.
  EXPECT_LT(map->worst_contraction(), 1e-4F);
  EXPECT_GT(map->worst_determinant(), 0.999F);
}

TEST(MotionMap, TakesConfidenceFromAnotherGridAndKeepsItInItsRange) {
  const Grid grid = test::cube_grid(9, 1.0), coarse = test::cube_grid(5, 2.0);
  Confidence confidence{coarse, std::vector<float>(coarse.count())};
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i)
        confidence.values[coarse.offset(i, j, k)] = 0.5F * float(i) - 0.5F;
  const auto map = MotionMap::of(still_field(grid), &confidence);
  const auto at = [&](double i) {
    return map->sample(volume_from_lps(grid.lps_from_index({i, 4.0, 4.0}))).confidence;
  };
  EXPECT_EQ(at(0.0), 0.0);
  EXPECT_NEAR(at(3.0), 0.25, 1e-6);
  EXPECT_NEAR(at(3.5), 0.375, 1e-6);
  EXPECT_EQ(at(8.0), 1.0);
}

TEST(MotionMap, MakesVectorsThatAreNotNumbersStillUntrustedAndFolded) {
  const Grid grid = test::cube_grid(6, 1.0);
  Field field = still_field(grid);
  field.u_mm[grid.offset(2, 2, 2)].y = std::numeric_limits<float>::quiet_NaN();
  field.u_mm[grid.offset(4, 4, 4)].x = std::numeric_limits<float>::infinity();
  const auto map = MotionMap::of(field);
  const glm::dvec3 bad = volume_from_lps(grid.lps_from_index({2, 2, 2}));
  EXPECT_EQ(map->sample(bad).u_m, glm::dvec3(0.0));
  EXPECT_EQ(map->sample(bad).confidence, 0.0);
  EXPECT_FALSE(map->certificate(bad).determinant > 0.0F);
  EXPECT_EQ(map->folded_cells(), 16U);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isfinite(map->sample({nan, 0.0, nan}).u_m.x));
  EXPECT_EQ(map->certificate({nan, nan, nan}).determinant,
            map->certificate({-1, -1, -1}).determinant);
}

/// Sampled slopes of a cell must never exceed its certificate, for any g.
void expect_sound(const MotionMap& map, const Grid& grid, Random& random, int draws,
                  const std::string& what) {
  for (int draw = 0; draw < draws; ++draw) {
    glm::dvec3 index = test::some_index(grid, random, 1.0);
    // Half of the draws are near a corner of a cell, where extremes are.
    if (draw & 1)
      index = glm::floor(index) +
              glm::dvec3(draw >> 1 & 1, draw >> 2 & 1, draw >> 3 & 1) * 0.999998 + 1e-6;
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(index));
    const CellCertificate promised = map.certificate(x);
    const glm::dmat3 jacobian = map.sample(x).jacobian;
    ASSERT_LE(frobenius(jacobian), double(promised.contraction)) << what << " draw " << draw;
    for (const double g : {0.0, random.draw(0.0, 1.0), 1.0}) {
      ASSERT_GE(glm::determinant(glm::dmat3(1.0) + g * jacobian), double(promised.determinant))
          << what << " draw " << draw << " g " << g;
    }
  }
}

TEST(MotionMap, CertificatesAreNeverBrokenByRoughFields) {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const Grid grid = seed % 2 ? test::oblique_grid() : test::cube_grid(8, 1.0);
    const double reach_mm = std::pow(10.0, random.draw(-2.0, 1.0));
    Field field = test::rough_field(grid, random, reach_mm);
    // A common displacement of many cells must not reduce the precision.
    for (glm::vec3& u : field.u_mm) u += glm::vec3(20.0F, -7.0F, 3.0F);
    const auto map = MotionMap::of(field);
    expect_sound(*map, grid, random, 4000, "seed " + std::to_string(seed));
    if (HasFatalFailure()) return;
  }
}

TEST(MotionMap, CertificatesAreNeverBrokenBySmoothFields) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Grid grid = seed % 2 ? test::oblique_grid() : test::cube_grid(16, 1.0);
    const Field field = test::scaled(test::smooth_field(grid, random, 4.0), random.draw(0.05, 1.0));
    expect_sound(*MotionMap::of(field), grid, random, 4000, "seed " + std::to_string(seed));
    if (HasFatalFailure()) return;
  }
}

/// The smallest determinant of a cell by sampling: corners and a lattice inside, many g.
double sampled_determinant(const MotionMap& map, const Grid& grid, glm::dvec3 cell) {
  double least = 1.0;
  for (int s = 0; s < 125; ++s) {
    const glm::dvec3 part = glm::dvec3(s % 5, s / 5 % 5, s / 25) * 0.2499995 + 1e-6;
    const glm::dmat3 j = map.sample(volume_from_lps(grid.lps_from_index(cell + part))).jacobian;
    for (int g = 1; g <= 8; ++g)
      least = std::min(least, glm::determinant(glm::dmat3(1.0) + (g / 8.0) * j));
  }
  return least;
}

TEST(MotionMap, CertificatesDoNotCallAnUnfoldedCellOfASmoothFieldFolded) {
  int unfolded = 0, called_folded = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Grid grid = test::cube_grid(14, 1.0);
    const Field field = test::scaled(test::smooth_field(grid, random, 5.0), 0.35);
    const auto map = MotionMap::of(field);
    for (int k = 0; k < 13; ++k)
      for (int j = 0; j < 13; ++j)
        for (int i = 0; i < 13; ++i) {
          const glm::dvec3 cell(i, j, k);
          const glm::dvec3 middle = volume_from_lps(grid.lps_from_index(cell + 0.5));
          if (sampled_determinant(*map, grid, cell) <= 0.02) continue;
          ++unfolded;
          called_folded += map->certificate(middle).determinant <= 0.0F;
        }
  }
  EXPECT_GT(unfolded, 20000);
  RecordProperty("called_folded", called_folded);
  // The certificate is a bound: one cell in a thousand, all of them nearly folded, may be rejected.
  EXPECT_LE(called_folded, unfolded / 1000);
}

TEST(MotionMap, CertificatesOfLinearMapsAreTheTruth) {
  const Grid grid = test::oblique_grid();
  struct Case {
    glm::dmat3 slope;
    double least;
  };
  const double c = std::cos(1.0) - 1.0, s = std::sin(1.0);
  const std::vector<Case> cases{
      {glm::dmat3(0.5), 1.0},                            // grows: least at g = 0
      {glm::dmat3(-0.5), 0.125},                         // shrinks
      {glm::dmat3(0, 0, 0, 0.9, 0, 0, 0, 0, 0), 1.0},    // shears
      {glm::dmat3(-1.2, 0, 0, 0, 0, 0, 0, 0, 0), -0.2},  // folds
  };
  for (const Case& one : cases) {
    const auto map = MotionMap::of(test::linear_field(grid, glm::dvec3(2.0), one.slope));
    const glm::dvec3 middle = volume_from_lps(grid.lps_from_index(glm::dvec3(grid.size) * 0.5));
    // Stored floats and the allowance for rounding.
    EXPECT_NEAR(map->certificate(middle).determinant, one.least, 3e-4);
    EXPECT_NEAR(map->certificate(middle).contraction, frobenius(one.slope), 2e-4);
  }
  // A rotation term of 1 rad: det = (1 + g c)^2 + g^2 s^2, with a minimum of 0.77 at g = 0.5; the
  // bound is a little smaller.
  const glm::dmat3 turn(c, s, 0, -s, c, 0, 0, 0, 0);
  const auto map = MotionMap::of(test::linear_field(grid, glm::dvec3(0.0), turn));
  const glm::dvec3 middle = volume_from_lps(grid.lps_from_index(glm::dvec3(grid.size) * 0.5));
  EXPECT_LT(map->certificate(middle).determinant, 0.771F);
  EXPECT_GT(map->certificate(middle).determinant, 0.69F);
  EXPECT_EQ(map->folded_cells(), 0U);
}

TEST(MotionMap, SaysWhatIsLargestAndWorst) {
  const Grid grid = test::oblique_grid();
  Random random(9);
  const Field field = test::rough_field(grid, random, 0.4);
  const auto map = MotionMap::of(field);
  double longest_mm = 0.0;
  for (const glm::vec3& u : field.u_mm)
    longest_mm = std::max(longest_mm, glm::length(glm::dvec3(u)));
  EXPECT_NEAR(map->largest_u_m(), 1e-3 * longest_mm, 1e-9);
  EXPECT_NEAR(map->cell_m(), 0.7e-3, 1e-15);
  float worst_q = 0.0F, worst_det = 1.0F;
  size_t folded = 0;
  for (int k = -1; k < grid.size.z; ++k)
    for (int j = -1; j < grid.size.y; ++j)
      for (int i = -1; i < grid.size.x; ++i) {
        const glm::dvec3 middle = grid.lps_from_index(glm::dvec3(i, j, k) + 0.5);
        const CellCertificate cell = map->certificate(volume_from_lps(middle));
        worst_q = std::max(worst_q, cell.contraction);
        worst_det = std::min(worst_det, cell.determinant);
        folded += cell.determinant <= 0.0F;
      }
  EXPECT_EQ(map->worst_contraction(), worst_q);
  EXPECT_EQ(map->worst_determinant(), worst_det);
  EXPECT_EQ(map->folded_cells(), folded);
}

}  // namespace
}  // namespace palpate
