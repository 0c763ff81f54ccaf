// The path of the material between frames (TimeBasis): times decide when it is where, never where
// it is. Properties over random times and random places; the oracle of the curve at even times is
// Catmull and Rom's, written out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "compute/volume/sequence_motion.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

constexpr int kPhases = 40;
constexpr float kRounding = 2e-5F;  // of places of a few mm, summed in float

/// Random frames: x rises or stands still from frame to frame, by steps of very different lengths;
/// y and z go anywhere.
SequenceMotion random_path(test::Random& random, int frames, bool cyclic, int harmonics) {
  SequenceMotion motion;
  Grid grid;
  grid.size = {4, 3, 2};
  double time_s = 0.0;
  for (int k = 0; k < frames; ++k) {
    motion.basis.times_s.push_back(time_s);
    time_s += random.log_draw(1e-3, 1e3);
  }
  motion.basis.cycle_s = cyclic ? time_s : 0.0;
  motion.basis.harmonics = harmonics;
  motion.terms.assign(motion.basis.terms(), still_field(grid));
  for (size_t s = 0; s < grid.count(); ++s) {
    double rises = random.draw(-1.0, 0.0);
    for (Field& term : motion.terms) {
      if (random.chance(0.7)) rises += random.log_draw(1e-4, 3.0);
      term.u_mm[s] = glm::vec3(rises, random.draw(-3.0, 3.0), random.draw(-3.0, 3.0));
    }
  }
  return motion;
}

SequenceMotion at_even_times(SequenceMotion motion) {
  for (size_t k = 0; k < motion.frames(); ++k) motion.basis.times_s[k] = double(k);
  if (motion.basis.cycle_s > 0.0) motion.basis.cycle_s = double(motion.frames());
  return motion;
}

int steps_of(const SequenceMotion& motion) {
  return int(motion.frames()) - (motion.basis.cycle_s > 0.0 ? 0 : 1);
}

float from_segment(glm::vec3 x, glm::vec3 a, glm::vec3 b) {
  const glm::vec3 way = b - a;
  const float square = glm::dot(way, way);
  const float share = square > 0.0F ? glm::clamp(glm::dot(x - a, way) / square, 0.0F, 1.0F) : 0.0F;
  return glm::distance(x, a + share * way);
}

/// How far the path between a frame and the next leaves the straight line, over all samples.
std::vector<float> from_chord(const SequenceMotion& motion, int step, int phases) {
  const Field from = motion.at(motion.basis.at(step, 0.0));
  const Field to = motion.at(motion.basis.at((step + 1) % int(motion.frames()), 0.0));
  std::vector<float> farthest(from.u_mm.size(), 0.0F);
  for (int p = 1; p < phases; ++p) {
    const Field between = motion.at(motion.basis.at(step, double(p) / phases));
    for (size_t s = 0; s < farthest.size(); ++s)
      farthest[s] = std::max(farthest[s], from_segment(between.u_mm[s], from.u_mm[s], to.u_mm[s]));
  }
  return farthest;
}

TEST(PathInTime, IsNoFartherFromTheChordThanAtEvenTimes) {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    test::Random random(seed);
    const bool cyclic = random.chance(0.5);
    const int frames = 2 + random.below(9);
    const int harmonics = cyclic && frames > 3 ? random.below(frames / 2) : 0;
    const SequenceMotion motion = random_path(random, frames, cyclic, harmonics);
    const SequenceMotion even = at_even_times(motion);
    for (int step = 0; step < steps_of(motion); ++step) {
      const auto uneven_mm = from_chord(motion, step, kPhases);
      const auto even_mm = from_chord(even, step, 8 * kPhases);
      for (size_t s = 0; s < even_mm.size(); ++s)
        ASSERT_LE(uneven_mm[s], 1.001F * even_mm[s] + kRounding)
            << "seed " << seed << " step " << step << " harmonics " << harmonics;
    }
  }
}

TEST(PathInTime, RisesWhereTheFramesDoAndPassesThroughThem) {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    test::Random random(seed);
    const SequenceMotion motion = random_path(random, 2 + random.below(9), false, 0);
    for (int step = 0; step < steps_of(motion); ++step) {
      Field before = motion.at(motion.basis.times_s[size_t(step)]);
      for (size_t s = 0; s < before.u_mm.size(); ++s)
        ASSERT_EQ(before.u_mm[s], motion.terms[size_t(step)].u_mm[s]);
      for (int p = 1; p <= kPhases; ++p) {
        const Field now = motion.at(motion.basis.at(step, double(p) / kPhases));
        for (size_t s = 0; s < now.u_mm.size(); ++s)
          ASSERT_GE(now.u_mm[s].x, before.u_mm[s].x - kRounding)
              << "seed " << seed << " step " << step << " phase " << p << " of " << kPhases;
        before = now;
      }
      EXPECT_LT(glm::distance(before.u_mm[5], motion.terms[size_t(step) + 1].u_mm[5]), kRounding);
    }
  }
}

TEST(PathInTime, MovesWithAVelocityThatDoesNotJumpAtFrames) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    test::Random random(seed);
    const bool cyclic = random.chance(0.5);
    const int frames = 4 + random.below(6), harmonics = cyclic && random.chance(0.5) ? 1 : 0;
    const SequenceMotion motion = random_path(random, frames, cyclic, harmonics);
    for (int k = cyclic ? 0 : 1; k < steps_of(motion); ++k) {
      const std::vector<double>& t = motion.basis.times_s;
      const double own_s =
          (k + 1 < frames ? t[size_t(k) + 1] : motion.basis.cycle_s) - t[size_t(k)];
      const double last_s =
          k > 0 ? t[size_t(k)] - t[size_t(k) - 1] : motion.basis.cycle_s - t.back();
      const int last = (k + frames - 1) % frames;
      // In mm per share of the shorter step. As the difference becomes smaller so does the jump.
      const double shorter_s = std::min(own_s, last_s);
      const Field here = motion.at(motion.basis.at(k, 0.0));
      float jumps[2] = {};
      for (const int small : {0, 1}) {
        const double h = small ? 0.004 : 0.02;
        const Field before = motion.at(motion.basis.at(last, 1.0 - h * shorter_s / last_s));
        const Field after = motion.at(motion.basis.at(k, h * shorter_s / own_s));
        for (size_t s = 0; s < here.u_mm.size(); ++s)
          jumps[small] = std::max(jumps[small], glm::distance(here.u_mm[s] - before.u_mm[s],
                                                              after.u_mm[s] - here.u_mm[s]) /
                                                    float(h));
      }
      EXPECT_LT(jumps[1], 0.4F * jumps[0] + 0.02F) << "seed " << seed << " frame " << k;
    }
  }
}

TEST(PathInTime, StaysTheSameIfAllTimesAreMultiplied) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    test::Random random(seed);
    const bool cyclic = random.chance(0.5);
    const SequenceMotion motion = random_path(random, 3 + random.below(7), cyclic, 0);
    SequenceMotion slower = motion;
    const double factor = random.log_draw(1e-4, 1e4);
    for (double& time_s : slower.basis.times_s) time_s *= factor;
    slower.basis.cycle_s *= factor;
    for (int trial = 0; trial < 20; ++trial) {
      const double time_s = random.draw(0.0, motion.basis.times_s.back());
      const Field a = motion.at(time_s), b = slower.at(factor * time_s);
      for (size_t s = 0; s < a.u_mm.size(); ++s)
        ASSERT_LT(glm::distance(a.u_mm[s], b.u_mm[s]), kRounding) << "seed " << seed;
    }
  }
}

TEST(PathInTime, HasAClockThatRisesAndIsNeverFarFromTheShareOfTheStep) {
  // The material moves by one from frame to frame, so its place is the clock.
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    test::Random random(seed);
    SequenceMotion motion = random_path(random, 2 + random.below(9), false, 0);
    for (size_t k = 0; k < motion.frames(); ++k)
      for (glm::vec3& u : motion.terms[k].u_mm) u = glm::vec3(float(k), 0.0F, 0.0F);
    for (int step = 0; step < steps_of(motion); ++step) {
      double before = double(step);
      for (int p = 1; p <= kPhases; ++p) {
        const double now = motion.at(motion.basis.at(step, double(p) / kPhases)).u_mm.front().x;
        ASSERT_GE(now, before - kRounding) << "seed " << seed;
        ASSERT_NEAR(now, step + double(p) / kPhases, 0.0505) << "seed " << seed;
        before = now;
      }
    }
  }
}

TEST(PathInTime, AtEvenTimesIsCatmullAndRomsCurve) {
  test::Random random(8);
  SequenceMotion motion = at_even_times(random_path(random, 6, true, 0));
  // The steps are alike in length, so no slope is limited.
  const std::array<double, 6> places = {0.0, 1.2, 2.5, 1.1, 2.2, 1.0};
  const size_t samples = motion.terms.front().u_mm.size();
  for (size_t s = 0; s < samples; ++s) {
    const double way = random.draw(-2.0, 2.0);
    for (size_t k = 0; k < 6; ++k) motion.terms[k].u_mm[s].y = float(way * places[k]);
  }
  for (const bool cyclic : {true, false}) {
    motion.basis.cycle_s = cyclic ? 6.0 : 0.0;
    for (int step = cyclic ? 0 : 1; step < (cyclic ? 6 : 4); ++step)
      for (const double p : {0.1, 0.4, 0.5, 0.85}) {
        const Field found = motion.at(double(step) + p);
        for (size_t s = 0; s < found.u_mm.size(); ++s) {
          const auto u = [&](int k) { return double(motion.terms[size_t((k + 6) % 6)].u_mm[s].y); };
          const double a = u(step - 1), b = u(step), c = u(step + 1), d = u(step + 2);
          const double expected =
              b + 0.5 * p * (c - a + p * (2 * a - 5 * b + 4 * c - d + p * (3 * (b - c) + d - a)));
          EXPECT_NEAR(found.u_mm[s].y, expected, kRounding);
        }
      }
  }
}

TEST(PathInTime, MayTurnBetweenTwoFramesButDoesNotSwingBackFromRest) {
  Grid grid;
  grid.size = glm::ivec3(1);
  const auto path = [&](std::vector<float> places) {
    SequenceMotion motion;
    for (size_t k = 0; k < places.size(); ++k) {
      motion.basis.times_s.push_back(double(k));
      motion.terms.push_back(still_field(grid));
      motion.terms.back().u_mm.front().x = places[k];
    }
    return motion;
  };
  // Of a breath whose end lies between two frames, which are alike.
  EXPECT_NEAR(path({0.0F, 1.0F, 1.0F, 0.0F}).at(1.5).u_mm.front().x, 1.125F, kRounding);
  EXPECT_EQ(path({0.0F, 1.0F, 1.0F, 1.0F}).at(1.5).u_mm.front().x, 1.0F);
  EXPECT_EQ(path({0.0F, 0.0F, 1.0F, 2.0F}).at(0.5).u_mm.front().x, 0.0F);
}

TEST(PathInTime, IsHeldBeyondItsEndsAndRepeatsInACycle) {
  test::Random random(3);
  SequenceMotion motion = random_path(random, 4, false, 0);
  motion.basis.times_s = {0.0, 1.0, 3.0, 3.5};
  EXPECT_EQ(motion.at(-1.0).u_mm, motion.terms.front().u_mm);
  EXPECT_EQ(motion.at(9.0).u_mm, motion.terms.back().u_mm);
  motion.basis.cycle_s = 4.5;
  for (const double t : {0.3, 2.2, 4.1})
    for (const double other : {t + 13.5, t - 9.0}) {
      const Field a = motion.at(t), b = motion.at(other);
      for (size_t s = 0; s < a.u_mm.size(); ++s)
        EXPECT_LT(glm::distance(a.u_mm[s], b.u_mm[s]), kRounding);
    }
}

TEST(PathInTime, GoesOnThroughALastFrameThatIsTheFirstOnceMore) {
  test::Random random(5);
  SequenceMotion whole = at_even_times(random_path(random, 5, true, 0)), twice = whole;
  twice.basis.times_s.push_back(5.0);
  twice.basis.cycle_s = 5.001;
  twice.basis.repeats_first = true;
  twice.terms.push_back(twice.terms.front());
  for (double t = 0.0; t < 5.0; t += 0.1) {
    const Field a = whole.at(t), b = twice.at(t);
    for (size_t s = 0; s < a.u_mm.size(); ++s)
      EXPECT_LT(glm::distance(a.u_mm[s], b.u_mm[s]), 0.02F) << t;
  }
  const Field last = twice.at_frame(5);
  for (size_t s = 0; s < last.u_mm.size(); ++s)
    EXPECT_LT(glm::distance(last.u_mm[s], twice.terms.front().u_mm[s]), 0.02F);
}

}  // namespace
}  // namespace palpate
