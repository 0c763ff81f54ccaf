#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "shaders/interface/motion.h"
#include "tests/motion/quality_fields.h"

namespace palpate {
namespace {

using test::field_of;
using test::oblique_grid;
using test::whole;

// Displacements of a few mm in float: seven digits.
constexpr double kFloat = 1e-5;

TEST(SpreadOf, HundredKnownValuesGivesTheirRanks) {
  std::vector<float> values(100);
  std::iota(values.begin(), values.end(), 1.0F);
  std::reverse(values.begin(), values.end());
  const Spread spread = spread_of(values);
  EXPECT_EQ(spread.count, 100u);
  EXPECT_DOUBLE_EQ(spread.mean, 50.5);
  EXPECT_DOUBLE_EQ(spread.median, 50.0);
  EXPECT_DOUBLE_EQ(spread.p95, 95.0);
  EXPECT_DOUBLE_EQ(spread.p99, 99.0);
  EXPECT_DOUBLE_EQ(spread.max, 100.0);
}

TEST(SpreadOf, NotANumberCanNotHide) {
  std::vector<float> values = {1.0F, std::numeric_limits<float>::quiet_NaN(), 2.0F};
  const Spread spread = spread_of(values);
  EXPECT_TRUE(std::isnan(spread.max));
  EXPECT_TRUE(std::isnan(spread.mean));
  EXPECT_DOUBLE_EQ(spread.median, 2.0);
}

TEST(EndpointError, OfAConstantOffsetIsItsLengthInMmAndInVoxels) {
  const Grid grid = oblique_grid();
  const Field truth = still_field(grid);
  const Field u =
      field_of(coarsened(grid, {4, 4, 2}), [](glm::dvec3) { return glm::dvec3(2.0, -1.0, 2.0); });
  const auto error = endpoint_error(u, truth);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->mm.count, grid.count());
  EXPECT_NEAR(error->mm.mean, 3.0, kFloat);
  EXPECT_NEAR(error->mm.max, 3.0, kFloat);
  EXPECT_NEAR(error->voxels.p95, 3.0 / 0.7, kFloat);  // 0.7 mm is the finest edge
  const glm::dvec3 along = glm::transpose(grid.direction) * glm::dvec3(2.0, -1.0, 2.0);
  EXPECT_NEAR(error->own_voxels.mean, glm::length(along / grid.spacing_mm), kFloat);
}

TEST(EndpointError, LooksOnlyInsideTheMask) {
  const Grid grid = oblique_grid();
  Field u = still_field(grid);
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  u.u_mm[5] = {0.0F, 4.0F, 3.0F};
  u.u_mm[6] = {100.0F, 0.0F, 0.0F};
  mask.values[5] = 1;
  mask.values[7] = 255;
  const auto error = endpoint_error(u, still_field(grid), &mask);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->mm.count, 2u);
  EXPECT_DOUBLE_EQ(error->mm.mean, 2.5);
  EXPECT_DOUBLE_EQ(error->mm.max, 5.0);
}

TEST(EndpointError, RefusesAMaskThatIsEmptyOrElsewhere) {
  const Grid grid = oblique_grid();
  Grid other = grid;
  other.origin_mm.x += 1.0;
  const Mask empty{grid, std::vector<uint8_t>(grid.count())};
  const Mask elsewhere = whole(other);
  const Field field = still_field(grid);
  const auto of_empty = endpoint_error(field, field, &empty);
  ASSERT_FALSE(of_empty);
  EXPECT_EQ(of_empty.error().kind, ErrorKind::kBadInput);
  EXPECT_FALSE(endpoint_error(field, field, &elsewhere));
}

TEST(TargetRegistrationError, MeasuresEachPairInMm) {
  const Grid grid = oblique_grid();
  const glm::dvec3 shift(1.0, 2.0, -3.0);
  const Field u = field_of(grid, [&](glm::dvec3) { return shift; });
  const std::vector<glm::dvec3> fixed = {grid.lps_from_index({3, 3, 3}),
                                         grid.lps_from_index({5.5, 2.25, 1})};
  const std::vector<glm::dvec3> moving = {fixed[0] + shift,
                                          fixed[1] + shift + glm::dvec3(0.0, 3.0, 4.0)};
  const auto error = target_registration_error_mm(u, fixed, moving);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->count, 2u);
  EXPECT_NEAR(error->mean, 2.5, kFloat);
  EXPECT_NEAR(error->max, 5.0, kFloat);
  EXPECT_FALSE(target_registration_error_mm(u, fixed, std::span(moving).first(1)));
  EXPECT_FALSE(target_registration_error_mm(u, {}, {}));
}

TEST(InverseConsistency, OfExactlyOppositeShiftsIsZeroAndOtherwiseTheGap) {
  const Grid grid = oblique_grid();
  const Field u = field_of(grid, [](glm::dvec3) { return glm::dvec3(0.5, 0.0, 0.0); });
  const Field w = field_of(grid, [](glm::dvec3) { return glm::dvec3(-0.5, 0.0, 0.0); });
  const Field off = field_of(grid, [](glm::dvec3) { return glm::dvec3(-0.5, 0.0, 0.35); });
  EXPECT_NEAR(inverse_consistency(u, w, grid)->mm.max, 0.0, kFloat);
  EXPECT_NEAR(inverse_consistency(u, off, grid)->mm.mean, 0.35, kFloat);
  EXPECT_NEAR(inverse_consistency(u, off, grid)->voxels.p99, 0.5, kFloat);
}

TEST(InverseConsistency, OfTheHeartsTwoDirectionsIsInterpolationOnly) {
  const Grid grid = heart_grid(64);
  const auto error = inverse_consistency(shell_truth(grid, 0, 1), shell_truth(grid, 1, 0), grid);
  ASSERT_TRUE(error);
  // The error of linear interpolation is h^2/8 |u''|; here h = 2 mm and |u''| up to about 0.05 /
  // mm.
  EXPECT_LT(error->mm.max, 0.05);
  EXPECT_GT(error->mm.max, 0.0);
}

TEST(InverseConsistency, DoesNotCountWhatLeavesAndSaysSoIfAllDoes) {
  const Grid grid = test::grid_at_origin(10);
  const Field u = field_of(grid, [](glm::dvec3) { return glm::dvec3(0.0, 0.0, 5.0); });
  const Field w = field_of(grid, [](glm::dvec3) { return glm::dvec3(0.0, 0.0, -5.0); });
  EXPECT_EQ(inverse_consistency(u, w, grid)->mm.count, 500u);
  const Field far = field_of(grid, [](glm::dvec3) { return glm::dvec3(0.0, 0.0, 200.0); });
  const auto gone = inverse_consistency(far, w, grid);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, ErrorKind::kBadInput);
}

TEST(InverseConsistency, TakesAtMostAboutAQuarterOfAMillionPoints) {
  const Grid grid = test::grid_at_origin(90);
  const Field still = still_field(test::grid_at_origin(3, 45.0));
  const auto found = inverse_consistency(still, still, grid);
  ASSERT_TRUE(found);
  EXPECT_GE(found->mm.count, 240000u);
  EXPECT_LE(found->mm.count, 500000u);
}

TEST(FinestMm, IsNotTheThicknessOfASingleSlice) {
  Grid grid = test::grid_at_origin(8, 2.0);
  grid.spacing_mm.y = 0.5;
  EXPECT_EQ(grid.finest_mm(), 0.5);
  grid.size.y = 1;
  EXPECT_EQ(grid.finest_mm(), 2.0);
  grid.size = glm::ivec3(1);
  EXPECT_EQ(grid.finest_mm(), 0.5);
}

TEST(CycleDrift, OfTheHeartsCycleIsInterpolationOnly) {
  const Grid grid = heart_grid(64);
  std::vector<Field> fields;
  for (int k = 0; k < 4; ++k) fields.push_back(shell_truth(grid, k, k + 1));
  const auto drift = cycle_drift(fields, grid);
  ASSERT_TRUE(drift);
  EXPECT_LT(drift->mm.max, 0.2);  // four times the interpolation error of one field, see above
  EXPECT_GT(drift->mm.max, 0.0);
}

TEST(CycleDrift, AddsUpWhatTheFieldsDoNotUndo) {
  const Grid grid = test::grid_at_origin(12, 2.0);
  const Field step = field_of(grid, [](glm::dvec3) { return glm::dvec3(0.3, 0.0, 0.0); });
  const std::vector<Field> fields = {step, step, step, step};
  const Mask mask = whole(grid, 3);
  const auto drift = cycle_drift(fields, grid, &mask);
  ASSERT_TRUE(drift);
  EXPECT_EQ(drift->mm.count, 216u);
  EXPECT_NEAR(drift->mm.mean, 1.2, kFloat);
  EXPECT_NEAR(drift->voxels.max, 0.6, kFloat);
  EXPECT_FALSE(cycle_drift({}, grid));
}

TEST(CycleDrift, FollowsAtMostAboutAQuarterOfAMillionPoints) {
  const Grid grid = test::grid_at_origin(90);
  const std::vector<Field> fields = {still_field(test::grid_at_origin(3, 30.0))};
  const auto drift = cycle_drift(fields, grid);
  ASSERT_TRUE(drift);
  EXPECT_GE(drift->mm.count, 240000u);
  EXPECT_LE(drift->mm.count, 500000u);
}

TEST(LowConfidenceShare, CountsInsideTheMaskOnly) {
  const Grid grid = test::grid_at_origin(4);
  Confidence confidence{grid, std::vector<float>(64, 0.9F)};
  Mask mask{grid, std::vector<uint8_t>(64)};
  for (size_t n = 0; n < 8; ++n) mask.values[n] = 1;
  confidence.values[0] = confidence.values[1] = 0.1F;
  confidence.values[40] = 0.0F;
  EXPECT_DOUBLE_EQ(*low_confidence_share(confidence, &mask), 0.25);
  EXPECT_DOUBLE_EQ(*low_confidence_share(confidence), 3.0 / 64.0);
}

TEST(ErrorRadius, IsThatOfTheDistributionThatConfidenceHas) {
  const Grid grid{{8, 4, 2}};
  // One radius everywhere: it contains 95 %.
  Deviation deviation{grid, std::vector<glm::vec2>(grid.count(), {0.3F, 0.4F})};
  const double radius = shaders::kErrorRadius * std::sqrt(0.3 * 0.3 + 2.0 * 0.4 * 0.4);
  EXPECT_NEAR(*error_radius_mm(deviation), radius, 1e-5);
  // Half of the voxels: the odds are 1 instead of 19.
  EXPECT_NEAR(*error_radius_mm(deviation, nullptr, 0.5),
              radius * std::pow(1.0 / 19.0, 1.0 / shaders::kErrorTail), 1e-5);
  // An eighth of the cells is far less certain: the sum of both shares is 95 %.
  for (size_t i = 0; i < grid.count(); i += 8) deviation.mm[i] *= 10.0F;
  const double all = *error_radius_mm(deviation);
  const auto inside = [&](double of) {
    return 1.0 / (1.0 + std::pow(of / all, shaders::kErrorTail) / 19.0);
  };
  EXPECT_NEAR(0.875 * inside(radius) + 0.125 * inside(10.0 * radius), 0.95, 1e-5);
  // A mask leaves them out.
  Mask mask{grid, std::vector<uint8_t>(grid.count(), 1)};
  for (size_t i = 0; i < grid.count(); i += 8) mask.values[i] = 0;
  EXPECT_NEAR(*error_radius_mm(deviation, &mask), radius, 1e-5);
  // Nothing to say.
  std::fill(mask.values.begin(), mask.values.end(), uint8_t(0));
  EXPECT_EQ(error_radius_mm(deviation, &mask).error().kind, ErrorKind::kBadInput);
  EXPECT_EQ(error_radius_mm(Deviation()).error().kind, ErrorKind::kBadInput);
}

}  // namespace
}  // namespace palpate
