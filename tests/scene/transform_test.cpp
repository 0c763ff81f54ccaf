// Oracle: the matrix of which the transform was made.
#include "module/scene/transform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

/// Products of a few doubles of order one: about 1e-16 each, with a margin for a scale of 1e4.
constexpr double kRounding = 1e-11;

double distance(const glm::dmat4& a, const glm::dmat4& b) {
  double most = 0.0;
  for (int c = 0; c < 4; ++c) most = std::max(most, glm::length(a[c] - b[c]));
  return most;
}

std::string refusal(const glm::dmat4& m) {
  const auto t = split(m);
  return t ? "" : t.error().message;
}

TEST(Transform, ComesBackFromItsMatrix) {
  for (uint32_t seed = 0; seed < 2000; ++seed) {
    test::Random random(seed);
    Transform t;
    t.translation_m = random.vector(10.0);
    t.rotation = glm::angleAxis(random.draw(-7.0, 7.0), glm::normalize(random.vector(1.0)));
    for (int a = 0; a < 3; ++a) t.scale[a] = std::pow(10.0, random.draw(-3.9, 3.9));
    const auto back = split(matrix(t));
    ASSERT_TRUE(back) << "seed " << seed << ": " << back.error().message;
    EXPECT_LT(distance(matrix(*back), matrix(t)), kRounding * 1e4) << "seed " << seed;
    EXPECT_GT(std::abs(glm::dot(back->rotation, t.rotation)), 1.0 - kRounding) << "seed " << seed;
    const glm::dvec3 x = random.vector(0.1);
    // The world point is rounded relative to its own size, and the smallest scale magnifies this on
    // the way back; ten operations.
    const glm::dvec3 world = t.world_from_volume(x);
    const double smallest = std::min({t.scale.x, t.scale.y, t.scale.z});
    const double allowed = 10 * 2.3e-16 * (glm::length(world) + 18.0) / smallest;
    EXPECT_LT(glm::length(t.volume_from_world(world) - x), allowed) << "seed " << seed;
  }
}

TEST(Transform, KeepsRotationsNearAHalfTurn) {
  for (const glm::dvec3 axis :
       {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1),
        glm::normalize(glm::dvec3(1, 1, 0)), glm::normalize(glm::dvec3(-1, 2, 3))}) {
    for (const double off : {-1e-3, -1e-9, -1e-14, 0.0, 1e-14, 1e-9, 1e-3}) {
      const glm::dmat4 m = glm::rotate(glm::dmat4(1.0), glm::pi<double>() + off, axis);
      const auto t = split(m);
      ASSERT_TRUE(t) << off;
      EXPECT_LT(distance(matrix(*t), m), kRounding) << off;
      EXPECT_NEAR(glm::length(t->rotation), 1.0, kRounding);
    }
  }
}

TEST(Transform, KeepsAScaleThatDiffersByAxis) {
  const glm::dmat4 m = glm::scale(glm::rotate(glm::dmat4(1.0), 0.7, glm::dvec3(0.6, 0.8, 0.0)),
                                  glm::dvec3(0.5, 3.0, 20.0));
  const auto t = split(m);
  ASSERT_TRUE(t);
  EXPECT_LT(glm::length(t->scale - glm::dvec3(0.5, 3.0, 20.0)), kRounding);
  EXPECT_LT(distance(matrix(*t), m), kRounding);
}

TEST(Transform, RefusesAMirrorImage) {
  EXPECT_THAT(refusal(glm::scale(glm::dmat4(1.0), glm::dvec3(1, 1, -1))), HasSubstr("mirror"));
  EXPECT_THAT(refusal(glm::scale(glm::dmat4(1.0), glm::dvec3(-2, -2, -2))), HasSubstr("mirror"));
  // Two reflections are a half turn.
  EXPECT_EQ(refusal(glm::scale(glm::dmat4(1.0), glm::dvec3(-1, -1, 1))), "");
}

TEST(Transform, RefusesShearAndTakesTheRoundingOfFloats) {
  glm::dmat4 m(1.0);
  m[1][0] = 1e-3;
  EXPECT_THAT(refusal(m), HasSubstr("sheared"));
  m[1][0] = 2e-6;
  EXPECT_THAT(refusal(m), HasSubstr("sheared"));
  m[1][0] = 5e-7;
  EXPECT_EQ(refusal(m), "");
  for (uint32_t seed = 0; seed < 200; ++seed) {
    test::Random random(seed);
    const glm::vec3 axis(glm::normalize(random.vector(1.0)));
    const glm::mat4 f = glm::rotate(glm::mat4(1.0f), float(random.draw(-4, 4)), axis) *
                        glm::rotate(glm::mat4(1.0f), 1.0f, glm::vec3(0, 1, 0));
    EXPECT_EQ(refusal(glm::dmat4(f)), "") << "seed " << seed;
  }
}

TEST(Transform, RefusesWhatIsNotAffineOrNotFiniteOrTooThin) {
  glm::dmat4 m(1.0);
  m[0][3] = 0.1;
  EXPECT_THAT(refusal(m), HasSubstr("projection"));
  m = glm::dmat4(1.0);
  m[3][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(m), HasSubstr("not finite"));
  EXPECT_THAT(refusal(glm::scale(glm::dmat4(1.0), glm::dvec3(1, 0, 1))), HasSubstr("scaled"));
  EXPECT_THAT(refusal(glm::scale(glm::dmat4(1.0), glm::dvec3(1, 1e5, 1))), HasSubstr("scaled"));
}

TEST(Transform, PutsThePatientUprightWithoutMirroring) {
  // Left, posterior, superior of the patient are +x, -z, +y of volume space.
  EXPECT_EQ(volume_from_lps({10, 0, 0}), glm::dvec3(0.01, 0, 0));
  EXPECT_EQ(volume_from_lps({0, 10, 0}), glm::dvec3(0, 0, -0.01));
  EXPECT_EQ(volume_from_lps({0, 0, 10}), glm::dvec3(0, 0.01, 0));
  const glm::dmat3 m(volume_from_lps({1, 0, 0}), volume_from_lps({0, 1, 0}),
                     volume_from_lps({0, 0, 1}));
  EXPECT_GT(glm::determinant(m), 0.0);
  EXPECT_LT(glm::length(lps_from_volume(volume_from_lps({1, -2, 3})) - glm::dvec3(1, -2, 3)),
            kRounding);
}

}  // namespace
}  // namespace palpate
