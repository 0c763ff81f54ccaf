#include "compute/volume/heart_phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random.h"
#include "tests/volume/grids.h"
#include "tests/volume/jumps.h"

namespace palpate {
namespace {

/// The determinant of d heart_point(p, from, to) / dp, by central differences.
double determinant(glm::dvec3 p, int from, int to) {
  constexpr double kStep = 1e-4;
  glm::dmat3 jacobian;
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 aside(0.0);
    aside[a] = kStep;
    jacobian[a] =
        (heart_point(p + aside, from, to) - heart_point(p - aside, from, to)) / (2.0 * kStep);
  }
  return glm::determinant(jacobian);
}

size_t voxels(const Mask& mask) {
  return size_t(std::count(mask.values.begin(), mask.values.end(), 1));
}

// The place of the chambers in frame 0, LPS mm: the middle of the left ventricle and the direction
// from its apex to its base, as in the phantom.
const glm::dvec3 kLeftMiddle(15.0, 0.0, -16.0);
const glm::dvec3 kBase = glm::normalize(glm::dvec3(-0.62, 0.50, 0.60));
/// From the left ventricle away from the right one.
const glm::dvec3 kAwayFromRight = glm::normalize(glm::dvec3(0.54, 0.83, -0.13));

/// Where the value along a ray first rises above (or falls below) the iso-value; < 0: nowhere.
double crossing(glm::dvec3 from, glm::dvec3 way, int frame, bool rising, double start = 0.0) {
  constexpr double kSurface = 350.0;
  for (double t = start; t < 60.0; t += 0.05)
    if ((heart_value(from + t * way, frame) > kSurface) == rising) return t;
  return -1.0;
}

TEST(HeartPoint, ThereAndBackIsTheIdentity) {
  test::Random random(1);
  for (int draw = 0; draw < 5000; ++draw) {
    const int from = draw % kHeartFrames, to = draw / kHeartFrames % kHeartFrames;
    const glm::dvec3 p = random.vector(70.0);
    const glm::dvec3 back = heart_point(heart_point(p, from, to), to, from);
    ASSERT_LT(glm::length(back - p), 1e-9) << "frames " << from << ", " << to << " draw " << draw;
  }
}

TEST(HeartPoint, HasADeterminantWithinTheBoundsThatAreSaid) {
  double least = 1e9, most = 0.0;
  for (int to = 1; to < kHeartFrames; ++to)
    for (double x = -60.0; x < 60.0; x += 2.7)
      for (double y = -60.0; y < 60.0; y += 2.7)
        for (double z = -60.0; z < 60.0; z += 2.7) {
          const double here = determinant({x, y, z}, 0, to);
          least = std::min(least, here), most = std::max(most, here);
        }
  EXPECT_GT(least, 0.25);
  EXPECT_LT(most, 3.0);
  // The determinant must vary: blood leaves and comes.
  EXPECT_LT(least, 0.5);
  EXPECT_GT(most, 1.5);
}

TEST(HeartPoint, ClosesTheCycleAndIsStillOutside) {
  glm::dvec3 p(11.0, 7.0, -9.0);
  const glm::dvec3 start = p;
  for (int k = 0; k < kHeartFrames; ++k) p = heart_point(p, k, k + 1);
  EXPECT_LT(glm::length(p - start), 1e-8);
  // On the faces of the cube.
  for (int face = 0; face < 6; ++face)
    for (double u = -64.0; u <= 64.0; u += 4.0)
      for (double v = -64.0; v <= 64.0; v += 4.0) {
        glm::dvec3 outside;
        outside[face % 3] = face < 3 ? -64.0 : 64.0;
        outside[(face + 1) % 3] = u, outside[(face + 2) % 3] = v;
        for (int k = 0; k < kHeartFrames; ++k)
          ASSERT_LT(glm::distance(heart_point(outside, 0, k), outside), 0.05) << "frame " << k;
      }
}

TEST(HeartValue, MovesWithTheMaterial) {
  test::Random random(2);
  int moving = 0;
  for (int draw = 0; draw < 3000; ++draw) {
    const glm::dvec3 p = random.vector(50.0);
    const int to = 1 + draw % (kHeartFrames - 1);
    const glm::dvec3 there = heart_point(p, 0, to);
    moving += glm::distance(p, there) > 1.0;
    // Rounding of the place, times slopes of up to 2000 per mm.
    ASSERT_NEAR(heart_value(p, 0), heart_value(there, to), 1e-5) << "draw " << draw;
  }
  EXPECT_GT(moving, 500);
}

TEST(HeartValue, HasNoJumps) {
  // The largest step is from lung to veins, 1240 in 1.5 mm, at the steepest 1.5 times that, and
  // stretched by up to 1.8; two edges may coincide.
  constexpr double kSlope = 2.0 * 1.5 * 1.8 * 1240.0 / 1.5;
  test::Random random(3);
  for (int draw = 0; draw < 400; ++draw) {
    const int frame = draw % kHeartFrames;
    const glm::dvec3 from = random.vector(60.0);
    const double change = test::largest_narrow_change(
        [&](glm::dvec3 at) { return heart_value(at, frame); }, from, random.direction());
    ASSERT_LT(change, kSlope * test::kNarrow_mm) << "draw " << draw;
  }
}

TEST(HeartValue, HasTheGradientThatIsGiven) {
  test::Random random(4);
  int steep = 0, kinks = 0;
  for (int draw = 0; draw < 3000; ++draw) {
    const int frame = draw % kHeartFrames;
    const glm::dvec3 p = random.vector(50.0);
    const glm::dvec3 gradient = heart_gradient(p, frame);
    constexpr double kStep = 1e-5;
    glm::dvec3 slope;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 aside(0.0);
      aside[a] = kStep;
      slope[a] = (heart_value(p + aside, frame) - heart_value(p - aside, frame)) / (2.0 * kStep);
    }
    steep += glm::length(slope) > 100.0;
    // The curvature of edges is up to 1e4 per mm^2, over a step of 1e-5 mm. Where two shapes meet
    // the value has a kink, which only few steps contain.
    kinks += glm::distance(gradient, slope) > 0.5;
  }
  EXPECT_GT(steep, 200);
  EXPECT_EQ(kinks, 0);
}

TEST(HeartAnatomy, HasAThickLeftWallThatThickensAndAThinRightOne) {
  // From the middle of the left ventricle between the papillary muscles: blood, wall, lung.
  const glm::dvec3 free_side =
      glm::normalize(kAwayFromRight - std::sqrt(3.0) * glm::cross(kBase, kAwayFromRight));
  const auto wall_mm = [&](int frame) {
    const glm::dvec3 middle = heart_point(kLeftMiddle, 0, frame);
    const double inner = crossing(middle, free_side, frame, true);
    // The wall ends at the lung, or at fat on it.
    double outer = inner + 2.0;
    for (double value = 500.0; value > 350.0 && value < 650.0; outer += 0.05)
      value = heart_value(middle + outer * free_side, frame);
    return outer - inner;
  };
  EXPECT_NEAR(wall_mm(0), 11.0, 1.5);
  const double thickening = wall_mm(3) / wall_mm(0);
  EXPECT_GT(thickening, 1.15);
  EXPECT_LT(thickening, 1.6);
  // In the other direction: septum, blood of the right ventricle, its free wall.
  const double septum = crossing(kLeftMiddle, -kAwayFromRight, 0, true);
  const double right_blood = crossing(kLeftMiddle, -kAwayFromRight, 0, false, septum);
  const double free_wall = crossing(kLeftMiddle, -kAwayFromRight, 0, true, right_blood);
  const double outside = crossing(kLeftMiddle, -kAwayFromRight, 0, false, free_wall);
  ASSERT_GT(septum, 0.0);
  ASSERT_GT(free_wall, right_blood);
  EXPECT_GT(right_blood - septum, 9.0);
  EXPECT_GT(free_wall - right_blood, 6.0) << "the right ventricle holds blood";
  EXPECT_NEAR(outside - free_wall, 4.5, 1.5);
}

TEST(HeartAnatomy, PumpsAndShortens) {
  // The volume of the left ventricle's cavity: the blood of frame 0, scaled by the map's
  // determinant.
  double filled = 0.0, emptied = 0.0;
  for (double x = -30.0; x <= 30.0; x += 1.5)
    for (double y = -30.0; y <= 30.0; y += 1.5)
      for (double z = -30.0; z <= 30.0; z += 1.5) {
        const glm::dvec3 p = kLeftMiddle + glm::dvec3(x, y, z);
        const double up = glm::dot(p - kLeftMiddle, kBase);
        const double out = glm::length(p - kLeftMiddle - up * kBase);
        if (out > 15.0 || std::abs(up) > 22.0 || heart_value(p, 0) > 350.0) continue;
        filled += 1.0;
        emptied += determinant(p, 0, 3);
      }
  ASSERT_GT(filled, 1000.0);
  const double ejected = 1.0 - emptied / filled;
  EXPECT_GT(ejected, 0.5);
  EXPECT_LT(ejected, 0.75);
  const glm::dvec3 base = kLeftMiddle + 28.0 * kBase, apex = kLeftMiddle - 40.0 * kBase;
  const glm::dvec3 base_moves = heart_point(base, 0, 3) - base;
  EXPECT_LT(glm::dot(base_moves, kBase), -8.0) << "the base comes towards the apex";
  EXPECT_LT(glm::length(heart_point(apex, 0, 3) - apex), 2.0) << "the apex must stay";
  // Twist: at the apex and at the base the wall rotates about the long axis in opposite directions.
  const auto turns = [](double up) {
    const glm::dvec3 across = kAwayFromRight, p = kLeftMiddle + up * kBase + 20.0 * across;
    return glm::dot(heart_point(p, 0, 3) - p, glm::cross(kBase, across));
  };
  EXPECT_LT(turns(-20.0) * turns(24.0), 0.0);
}

TEST(HeartPhantom, SamplesItsFormulaInEveryFrame) {
  const Grid grid = test::oblique_grid();
  const Sequence beat = heart_phantom(grid, kHeartFrames, 5, 0.0);
  ASSERT_EQ(beat.frames.size(), size_t(kHeartFrames));
  const double voxel = std::cbrt(grid.spacing_mm.x * grid.spacing_mm.y * grid.spacing_mm.z);
  for (int k = 0; k < kHeartFrames; ++k)
    for (size_t n = 0; n < grid.count(); ++n) {
      const glm::ivec3 at(int(n) % grid.size.x, int(n) / grid.size.x % grid.size.y,
                          int(n) / (grid.size.x * grid.size.y));
      const glm::dvec3 p = grid.lps_from_index(glm::dvec3(at));
      // Floats of up to 1400.
      ASSERT_NEAR(double(beat.frames[size_t(k)].values[n]),
                  heart_value(p, k, kHeartFrames, 5, voxel), 1e-3);
    }
}

TEST(HeartPhantom, MuscleIsWhereTheMaskSays) {
  const Grid grid = heart_grid(64);
  for (const uint32_t seed : {1U, 7U}) {
    const Mask muscle = heart_muscle(grid, 0, 1, seed);
    EXPECT_GT(voxels(muscle), 10'000U);
    int deep = 0, held = 0;
    for (int k = 1; k < 63; ++k)
      for (int j = 1; j < 63; ++j)
        for (int i = 1; i < 63; ++i) {
          const auto in = [&](int x, int y, int z) { return muscle.values[grid.offset(x, y, z)]; };
          if (!(in(i, j, k) && in(i - 1, j, k) && in(i + 1, j, k) && in(i, j - 1, k) &&
                in(i, j + 1, k) && in(i, j, k - 1) && in(i, j, k + 1)))
            continue;
          ++deep;
          held += heart_value(grid.lps_from_index({i, j, k}), 0, 1, seed) > 470.0;
        }
    EXPECT_GT(deep, 1000);
    // The openings of valves and the great vessels pass through muscle.
    EXPECT_GT(held, 0.9 * deep);
  }
}

TEST(HeartPhantom, WarpedByTheTruthShowsTheFixedFrame) {
  const Grid grid = heart_grid(64);
  const Sequence beat = heart_phantom(64, kHeartFrames, 5, 0.0);
  const Mask muscle = heart_muscle(grid, 1, kHeartFrames, 5);
  const Field truth = heart_truth(grid, 1, 2);
  double still = 0.0, warped = 0.0;
  for (int k = 0; k < 64; ++k)
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        if (!muscle.values[grid.offset(i, j, k)]) continue;
        const glm::dvec3 at = grid.lps_from_index({i, j, k}) + glm::dvec3(truth.at(i, j, k));
        const double fixed = double(beat.frames[1].at(i, j, k));
        warped += std::abs(fixed - sample(beat.frames[2], grid.index_from_lps(at)));
        still += std::abs(fixed - double(beat.frames[2].at(i, j, k)));
      }
  // The remaining error is interpolation of 1.5-voxel edges and 2-voxel texture.
  EXPECT_LT(warped, 0.35 * still);
}

TEST(HeartPhantom, NoiseHasTheAskedSdAndTheSeedDecides) {
  const Sequence clean = heart_phantom(32, 2, 8, 0.0);
  const Sequence noisy = heart_phantom(32, 2, 8, 0.02);
  double squares = 0.0;
  const size_t count = clean.frames[0].values.size();
  for (size_t n = 0; n < count; ++n) {
    const double e = double(noisy.frames[0].values[n]) - double(clean.frames[0].values[n]);
    squares += e * e;
  }
  // 2 % of 480; 32,768 draws: the SD of the SD is 0.04; the limit is five of these.
  EXPECT_NEAR(std::sqrt(squares / double(count)), 9.6, 0.2);
  EXPECT_EQ(noisy.frames[1].values, heart_phantom(32, 2, 8, 0.02).frames[1].values);
  EXPECT_NE(noisy.frames[0].values, heart_phantom(32, 2, 9, 0.02).frames[0].values);
  EXPECT_NE(clean.frames[0].values, heart_phantom(32, 2, 9, 0.0).frames[0].values);
}

}  // namespace
}  // namespace palpate
