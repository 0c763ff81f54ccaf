#include <gtest/gtest.h>

#include <limits>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "tests/volume/grids.h"

namespace palpate {
namespace {

using test::oblique_grid;

// Trilinear interpolation is exact for a linear function of space, up to float rounding of values
// of about 100.
constexpr double kLinearTolerance = 1e-4;

double linear(glm::dvec3 p) {
  return 3.0 + 0.5 * p.x - 1.25 * p.y + 2.0 * p.z;
}
glm::dvec3 linear_vector(glm::dvec3 p) {
  return {linear(p), -linear(p) + p.x, 0.25 * p.y};
}

Volume linear_volume(const Grid& grid) {
  Volume volume{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        volume.values[grid.offset(i, j, k)] = float(linear(grid.lps_from_index({i, j, k})));
  return volume;
}

Field linear_field(const Grid& grid) {
  Field field = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(linear_vector(grid.lps_from_index({i, j, k})));
  return field;
}

/// A finer grid inside `grid`, with axes rotated by `turn`.
Grid inner_grid(const Grid& grid, const glm::dmat3& turn) {
  Grid inner;
  inner.size = {9, 8, 5};
  inner.spacing_mm = 0.4 * grid.spacing_mm;
  inner.direction = turn * grid.direction;
  const glm::dvec3 centre = grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1));
  inner.origin_mm =
      centre - inner.direction * (inner.spacing_mm * (0.5 * glm::dvec3(inner.size - 1)));
  return inner;
}

void expect_linear(const Volume& volume, const Field& field) {
  const Grid& grid = volume.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 p = grid.lps_from_index({i, j, k});
        ASSERT_NEAR(volume.at(i, j, k), linear(p), kLinearTolerance) << i << ' ' << j << ' ' << k;
        ASSERT_LT(glm::length(glm::dvec3(field.at(i, j, k)) - linear_vector(p)),
                  2 * kLinearTolerance);
      }
}

TEST(Resampled, IsExactForLinearDataOnParallelAxes) {
  const Grid grid = oblique_grid();
  const Grid inner = inner_grid(grid, glm::dmat3(1.0));
  expect_linear(resampled(linear_volume(grid), inner), resampled(linear_field(grid), inner));
}

TEST(Resampled, IsExactForLinearDataOnTurnedAxes) {
  const Grid grid = oblique_grid();
  const Grid inner = inner_grid(grid, test::some_rotation(9));
  expect_linear(resampled(linear_volume(grid), inner), resampled(linear_field(grid), inner));
}

TEST(Resampled, AgreesWithPointwiseSamplingBeyondTheBorderToo) {
  const Grid grid = oblique_grid();
  Grid larger = inner_grid(grid, glm::dmat3(1.0));
  larger.spacing_mm = 1.7 * grid.spacing_mm;
  larger.origin_mm = grid.lps_from_index({-1.3, -2.0, -1.7});
  const Volume volume = linear_volume(grid);
  const Field field = linear_field(grid);
  const Volume big_volume = resampled(volume, larger);
  const Field big_field = resampled(field, larger);
  for (int k = 0; k < larger.size.z; ++k)
    for (int j = 0; j < larger.size.y; ++j)
      for (int i = 0; i < larger.size.x; ++i) {
        const glm::dvec3 p = larger.lps_from_index({i, j, k});
        ASSERT_NEAR(big_volume.at(i, j, k), sample(volume, grid.index_from_lps(p)),
                    kLinearTolerance);
        ASSERT_LT(glm::length(glm::dvec3(big_field.at(i, j, k)) - sample_at_lps(field, p)),
                  2 * kLinearTolerance);
      }
}

TEST(Resampled, OntoTheSameGridCopies) {
  const Volume volume = linear_volume(oblique_grid());
  EXPECT_EQ(resampled(volume, volume.grid).values, volume.values);
}

TEST(Sample, HoldsTheBorderValueOutside) {
  const Volume volume = linear_volume(oblique_grid());
  EXPECT_EQ(sample(volume, {-5.0, 3.0, 2.0}), double(volume.at(0, 3, 2)));
  EXPECT_EQ(sample(volume, {99.0, 3.0, 2.0}), double(volume.at(12, 3, 2)));
  EXPECT_EQ(sample(volume, {4.0, 99.0, -99.0}), double(volume.at(4, 10, 0)));
}

TEST(Sample, OfNotANumberStaysInsideTheSamples) {
  const Volume volume = linear_volume(oblique_grid());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(sample(volume, {nan, 3.0, 2.0}), double(volume.at(0, 3, 2)));
}

TEST(Sample, WorksOnAxesOfOneSample) {
  Grid grid = oblique_grid();
  grid.size = {5, 1, 1};
  const Volume volume = linear_volume(grid);
  EXPECT_NEAR(sample(volume, {1.5, 0.3, -2.0}), 0.5 * (volume.at(1, 0, 0) + volume.at(2, 0, 0)),
              kLinearTolerance);
}

TEST(StillField, IsZeroEverywhere) {
  const Field field = still_field(oblique_grid());
  ASSERT_EQ(field.u_mm.size(), oblique_grid().count());
  for (const glm::vec3& u : field.u_mm) EXPECT_EQ(u, glm::vec3(0.0F));
}

}  // namespace
}  // namespace palpate
