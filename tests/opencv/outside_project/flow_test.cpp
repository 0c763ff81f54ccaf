// Cross-checks the motion of a moving pattern, as a project with its own flow code would.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "compute/motion/verdict.h"
#include "compute/volume/field.h"
#include "integration/opencv/cross_check.h"
#include "integration/opencv/testing.h"

namespace {

using palpate::Field;
using palpate::Grid;
using palpate::Volume;
using palpate::testing::AgreesWithOpticalFlow;
using palpate::testing::HasNoFolds;
using palpate::testing::IsUndoneBy;
using palpate::testing::IsWithin;
using ::testing::Not;

Grid grid() {
  Grid grid;
  grid.size = {48, 44, 40};
  return grid;
}

/// Waves of several lengths and directions, so that all places are different.
Volume pattern(glm::dvec3 drift) {
  Volume volume{grid(), std::vector<float>(grid().count())};
  for (int k = 0; k < volume.grid.size.z; ++k)
    for (int j = 0; j < volume.grid.size.y; ++j)
      for (int i = 0; i < volume.grid.size.x; ++i) {
        const glm::dvec3 p = glm::dvec3(i, j, k) - drift;
        const double value = std::sin(0.61 * p.x + 0.2 * p.z) + std::sin(0.53 * p.y - 0.31 * p.x) +
                             std::sin(0.47 * p.z + 0.29 * p.y) + std::sin(0.17 * (p.x + p.y + p.z));
        volume.values[volume.grid.offset(i, j, k)] = static_cast<float>(100.0 * value);
      }
  return volume;
}

Field my_flow(glm::vec3 u_mm) {
  return {grid(), std::vector<glm::vec3>(grid().count(), u_mm)};
}

TEST(MyFlow, AgreesWithOpticalFlowOnADriftingPattern) {
  const Volume fixed = pattern({0, 0, 0});
  const Volume moving = pattern({1.5, -1.0, 0.4});
  const Field right = my_flow({1.5F, -1.0F, 0.4F});
  const Field wrong = my_flow({-1.5F, 1.0F, -0.4F});
  EXPECT_THAT(right, AgreesWithOpticalFlow(fixed, moving));
  EXPECT_THAT(wrong, Not(AgreesWithOpticalFlow(fixed, moving)));
  EXPECT_THAT(right, HasNoFolds());
  EXPECT_THAT(right, IsUndoneBy(wrong, 0.01));
  EXPECT_THAT(right, IsWithin(my_flow({1.5F, -1.0F, 0.4F}), 0.0));
}

TEST(MyFlow, GetsAVerdict) {
  const auto evidence = palpate::examined(pattern({0, 0, 0}), pattern({1.5, -1.0, 0.4}),
                                          my_flow({1.5F, -1.0F, 0.4F}));
  ASSERT_TRUE(evidence);
  EXPECT_EQ(palpate::judged(*evidence).trust, palpate::Trust::kOk);
}

}  // namespace
