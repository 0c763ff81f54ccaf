// Distances to the borders of masks: exact ones compared with all pairs of samples, smooth ones
// with shapes of known distance.
#include "compute/volume/signed_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "tests/volume/grids.h"

namespace palpate {
namespace {

/// The samples whose centres are inside by a formula.
Mask mask_of(const Grid& grid, const std::function<bool(glm::dvec3 lps_mm)>& inside) {
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        mask.values[grid.offset(i, j, k)] = inside(grid.lps_from_index({i, j, k}));
  return mask;
}

/// A grid whose middle is at the origin.
Grid centred_grid(glm::ivec3 size, glm::dvec3 spacing_mm) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.origin_mm = -0.5 * spacing_mm * glm::dvec3(size - 1);
  return grid;
}

/// The distance from a sample to the box of another voxel.
double to_box(const Grid& grid, glm::ivec3 from, glm::ivec3 voxel) {
  const glm::dvec3 apart = glm::abs(glm::dvec3(from - voxel)) - 0.5;
  return glm::length(grid.spacing_mm * glm::max(apart, glm::dvec3(0.0)));
}

TEST(ExactSignedDistance, IsThatToTheNearestBoxOfTheOtherKind) {
  Grid grid = test::oblique_grid();
  grid.size = {7, 6, 5};
  std::mt19937 random(3);
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  for (uint8_t& value : mask.values) value = random() % 3 == 0;
  const Volume distance = exact_signed_distance(mask);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const bool inside = mask.values[grid.offset(i, j, k)];
        double nearest = 1e300;
        // Samples beyond the grid are outside.
        for (int z = -1; z <= grid.size.z; ++z)
          for (int y = -1; y <= grid.size.y; ++y)
            for (int x = -1; x <= grid.size.x; ++x) {
              const bool beyond = x < 0 || y < 0 || z < 0 || x == grid.size.x || y == grid.size.y ||
                                  z == grid.size.z;
              const bool counts = !beyond && mask.values[grid.offset(x, y, z)];
              if (counts != inside) nearest = std::min(nearest, to_box(grid, {i, j, k}, {x, y, z}));
            }
        // Squares of some tens of mm^2 in single precision.
        EXPECT_NEAR(distance.at(i, j, k), inside ? nearest : -nearest, 1e-5) << i << j << k;
      }
}

TEST(ExactSignedDistance, OfNothingIsInfinitelyFarOutside) {
  const Grid grid = centred_grid({4, 4, 4}, glm::dvec3(1.0));
  const Volume distance = exact_signed_distance(mask_of(grid, [](glm::dvec3) { return false; }));
  for (const float d : distance.values) EXPECT_EQ(d, -std::numeric_limits<float>::infinity());
}

/// The error of a smooth distance within `near_mm` of the border.
struct Fit {
  double mean = 0.0, rms = 0.0, worst = 0.0;
};
Fit fit(const Volume& distance, double near_mm,
        const std::function<double(glm::dvec3 lps_mm)>& truth) {
  Fit fit;
  double count = 0.0;
  const Grid& grid = distance.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const double wanted = truth(grid.lps_from_index({i, j, k}));
        if (std::abs(wanted) > near_mm) continue;
        const double off = distance.at(i, j, k) - wanted;
        fit.mean += off;
        fit.rms += off * off;
        fit.worst = std::max(fit.worst, std::abs(off));
        ++count;
      }
  fit.mean /= count;
  fit.rms = std::sqrt(fit.rms / count);
  return fit;
}

TEST(SignedDistance, OfABallLiesWhereTheBallEnds) {
  const auto truth = [](glm::dvec3 x) { return 15.0 - glm::length(x); };
  const Mask ball = mask_of(centred_grid({44, 44, 44}, glm::dvec3(1.0)),
                            [&](glm::dvec3 x) { return truth(x) > 0.0; });
  const Fit found = fit(signed_distance(ball), 1.0, truth);
  // A Gaussian of 1.5 mm moves it in by 1.5^2 / 15 = 0.15 mm; half a voxel is the resolution of a
  // label.
  EXPECT_LT(std::abs(found.mean), 0.2);
  EXPECT_LT(found.rms, 0.2);
  EXPECT_LT(found.worst, 0.5);
}

TEST(SignedDistance, InterpolatesThickSlices) {
  // As in short-axis MR: a cone, whose border moves by 3 mm from slice to slice of 6 mm.
  const auto truth = [](glm::dvec3 x) {
    return (20.0 - 0.5 * x.z - std::hypot(x.x, x.y)) / std::hypot(1.0, 0.5);
  };
  const Mask cone = mask_of(centred_grid({80, 80, 9}, {1.0, 1.0, 6.0}),
                            [&](glm::dvec3 x) { return truth(x) > 0.0; });
  const Volume distance = signed_distance(cone);
  EXPECT_NEAR(distance.grid.spacing_mm.z, 1.0, 1e-9);
  const Fit found = fit(distance, 1.5, [&](glm::dvec3 x) {
    // Not at its ends.
    return std::abs(x.z) < 15.0 ? truth(x) : 1e9;
  });
  EXPECT_LT(std::abs(found.mean), 0.2);
  EXPECT_LT(found.rms, 0.25);
}

TEST(SignedDistance, KeepsWallsThatAreThinnerThanItsGaussian) {
  for (const double half_mm : {0.5, 1.0, 2.0, 5.0}) {
    // Oblique, so that the voxels form steps.
    const glm::dvec3 across = glm::normalize(glm::dvec3(0.31, 1.0, 0.17));
    const auto truth = [&](glm::dvec3 x) { return half_mm - std::abs(glm::dot(across, x)); };
    const Mask sheet = mask_of(centred_grid({40, 40, 40}, glm::dvec3(1.0)), [&](glm::dvec3 x) {
      return truth(x) > 0.0 && glm::length(x) < 18.0;
    });
    const Volume distance = signed_distance(sheet);
    double deepest = 1e300, sum = 0.0, count = 0.0;
    const Grid& grid = distance.grid;
    for (int k = 0; k < grid.size.z; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const glm::dvec3 x = grid.lps_from_index({i, j, k});
          if (glm::length(x) > 10.0) continue;
          if (std::abs(glm::dot(across, x)) < 0.25)
            deepest = std::min(deepest, double(distance.at(i, j, k)));
          if (std::abs(truth(x)) > 0.6) continue;
          sum += distance.at(i, j, k) - truth(x);
          ++count;
        }
    EXPECT_GT(deepest, 0.2 * half_mm) << half_mm;
    EXPECT_LT(std::abs(sum / count), 0.2) << half_mm;
  }
}

TEST(SignedDistance, KeepsASheetOfOneVoxel) {
  for (const double slope : {0.0, 0.1, 0.3, 0.6, 1.0}) {
    const Mask sheet = mask_of(centred_grid({40, 40, 40}, glm::dvec3(1.0)), [&](glm::dvec3 x) {
      return std::abs(x.z + slope * x.x - 0.5) < 0.5001 && glm::length(x) < 18.0;
    });
    const Volume distance = signed_distance(sheet);
    // Half a voxel in its middle, less what the samples (half a voxel apart) miss of the ridge; and
    // so everywhere.
    double least = 1e9, most = -1e9;
    for (double x = -8.0; x < 8.0; x += 0.1) {
      double deepest = -1e9;
      for (double z = -10.0; z < 10.0; z += 0.02)
        deepest = std::max(deepest, sample(distance, distance.grid.index_from_lps({x, 0.5, z})));
      least = std::min(least, deepest);
      most = std::max(most, deepest);
    }
    EXPECT_GT(least, 0.35) << slope;
    // The steepest one has two layers, 1.4 voxels thick.
    EXPECT_LT(most, slope < 1.0 ? 0.7 : 0.8) << slope;
  }
}

/// Voxels whose centres are this close to a plane through the middle of the grid, in a disc around
/// it.
Mask disc(glm::dvec3 normal, double half_mm, const std::function<bool(glm::dvec3)>& in_disc) {
  return mask_of(centred_grid({40, 40, 40}, glm::dvec3(1.0)), [&](glm::dvec3 x) {
    return std::abs(glm::dot(normal, x) - 0.4) < half_mm && in_disc(x);
  });
}

/// The deepest value on the line across a sheet at a place.
double deepest_across(const Volume& distance, glm::dvec3 normal, glm::dvec3 place) {
  double most = -1e9;
  for (double w = -1.5; w < 1.5; w += 0.02)
    most = std::max(most, sample(distance, distance.grid.index_from_lps(place + w * normal)));
  return most;
}

/// Two directions along a plane.
std::pair<glm::dvec3, glm::dvec3> along_plane(glm::dvec3 normal) {
  const glm::dvec3 a = glm::normalize(glm::cross(normal, glm::dvec3(0.3, 0.2, 0.9)));
  return {a, glm::cross(normal, a)};
}

TEST(SignedDistance, OfASheetThinnerThanAVoxelIsThatOfAPlateOfOne) {
  const auto whole = [](glm::dvec3 x) { return glm::length(x) < 17.0; };
  for (const glm::dvec3 across : {glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 1), glm::dvec3(1, 1, 1),
                                  glm::dvec3(0.31, 1.0, 0.17), glm::dvec3(1.0, -0.6, 0.5)}) {
    const glm::dvec3 n = glm::normalize(across);
    // 0.7 and 1 voxel thick: of an oblique one up to every second voxel is missing.
    for (const double half_mm : {0.35, 0.5}) {
      const Volume distance = signed_distance(disc(n, half_mm, whole));
      EXPECT_EQ(distance.grid.spacing_mm, glm::dvec3(0.5));
      const auto [a, b] = along_plane(n);
      for (double u = -10.0; u <= 10.0; u += 1.7)
        for (double v = -10.0; v <= 10.0; v += 1.7)
          EXPECT_GT(deepest_across(distance, n, u * a + v * b), 0.15)
              << half_mm << ", " << n.x << " " << n.y << " " << n.z << " at " << u << " " << v;
      // Where it ends is half a voxel from the plane. (Along diagonals the label has whole layers:
      // their plane is not that of the formula.)
      if (across.x == across.z || across.x == 0.0) continue;
      const Fit found = fit(distance, 0.3, [&](glm::dvec3 x) {
        return glm::length(x) < 10.0 ? 0.5 - std::abs(glm::dot(n, x) - 0.4) : 1e9;
      });
      EXPECT_LT(std::abs(found.mean), 0.15) << half_mm << ", " << n.x << " " << n.y << " " << n.z;
      EXPECT_LT(found.rms, 0.25) << half_mm << ", " << n.x << " " << n.y << " " << n.z;
    }
  }
}

TEST(SignedDistance, OfASheetEndsAtItsRimAndAtItsHole) {
  for (const glm::dvec3 across :
       {glm::dvec3(0, 0, 1), glm::dvec3(1, 1, 1), glm::dvec3(0.31, 1.0, 0.17)}) {
    const glm::dvec3 n = glm::normalize(across);
    const Volume distance = signed_distance(
        disc(n, 0.45, [](glm::dvec3 x) { return glm::length(x) < 16.0 && glm::length(x) > 5.0; }));
    const auto [a, b] = along_plane(n);
    for (double turn = 0.0; turn < 6.2; turn += 0.5) {
      const glm::dvec3 out = std::cos(turn) * a + std::sin(turn) * b;
      const auto deepest = [&](double radius) {
        return deepest_across(distance, n, radius * out + 0.4 * n);
      };
      EXPECT_LT(deepest(0.0), 0.0);
      EXPECT_LT(deepest(3.5), 0.0) << turn;
      EXPECT_GT(deepest(6.5), 0.15) << turn;
      EXPECT_GT(deepest(14.5), 0.15) << turn;
      EXPECT_LT(deepest(17.5), 0.0) << turn;
    }
  }
}

TEST(SignedDistance, OfAnOrganStaysAsItIsAlsoWithASheetOnIt) {
  const auto ball = [](glm::dvec3 x) { return glm::length(x) < 9.0; };
  const auto sheet = [](glm::dvec3 x) {
    return std::abs(glm::dot(glm::normalize(glm::dvec3(1, 1, 0)), x)) < 0.5 && x.z > -3.0;
  };
  const Grid grid = centred_grid({50, 50, 40}, glm::dvec3(1.0));
  const Volume alone = signed_distance(mask_of(grid, ball));
  EXPECT_EQ(alone.grid.spacing_mm, glm::dvec3(1.0));
  const Volume both =
      signed_distance(mask_of(grid, [&](glm::dvec3 x) { return ball(x) || sheet(x); }));
  EXPECT_EQ(both.grid.spacing_mm, glm::dvec3(0.5));
  // Away from the sheet the ball ends at the same place.
  const Fit found = fit(both, 1.0, [&](glm::dvec3 x) {
    return std::abs(x.x + x.y) < 6.0 ? 1e9 : sample(alone, alone.grid.index_from_lps(x));
  });
  EXPECT_LT(found.worst, 0.12);
  EXPECT_LT(std::abs(found.mean), 0.02);
}

TEST(SignedDistance, OfTwoPartsThatTouchHasOneSurfaceBetweenThem) {
  const Grid grid = centred_grid({48, 48, 12}, {1.0, 1.0, 4.0});
  const auto pool = [](glm::dvec3 x) { return glm::length(x / glm::dvec3(1, 1, 1.2)) < 10.0; };
  const auto wall = [&](glm::dvec3 x) {
    return glm::length(x / glm::dvec3(1, 1, 1.2)) < 18.0 && !pool(x);
  };
  const Volume inner = signed_distance(mask_of(grid, pool));
  const Volume outer = signed_distance(mask_of(grid, wall));
  double worst = 0.0;
  for (int k = 0; k < inner.grid.size.z; ++k)
    for (int j = 0; j < inner.grid.size.y; ++j)
      for (int i = 0; i < inner.grid.size.x; ++i) {
        const float d = inner.at(i, j, k);
        if (std::abs(d) > 0.3) continue;
        const glm::dvec3 at = outer.grid.index_from_lps(inner.grid.lps_from_index({i, j, k}));
        worst = std::max(worst, std::abs(d + sample(outer, at)));
      }
  // The depth of one is the height of the other.
  EXPECT_LT(worst, 0.1);
}

}  // namespace
}  // namespace palpate
