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
    // In sheets thinner than a voxel the label map itself has holes.
    if (half_mm >= 1.0) {
      EXPECT_GT(deepest, 0.2 * half_mm) << half_mm;
    }
    EXPECT_LT(std::abs(sum / count), 0.2) << half_mm;
  }
}

TEST(SignedDistance, KeepsASheetOfOneVoxel) {
  for (const double slope : {0.0, 0.3}) {
    const Mask sheet = mask_of(centred_grid({40, 40, 40}, glm::dvec3(1.0)), [&](glm::dvec3 x) {
      return std::abs(x.z + slope * x.x - 0.5) < 0.5001 && glm::length(x) < 18.0;
    });
    const Volume distance = signed_distance(sheet);
    // Half a voxel in its middle, and so much outside of it.
    for (int i = -6; i < 6; ++i) {
      double most = -1e9;
      for (int k = -10; k < 10; ++k)
        most =
            std::max(most, sample(distance, distance.grid.index_from_lps({i + 0.5, 0.5, k + 0.5})));
      EXPECT_GT(most, 0.35) << slope << " at " << i;
    }
  }
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
