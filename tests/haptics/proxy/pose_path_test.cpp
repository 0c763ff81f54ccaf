// Oracles: the source's own motion in closed form, and numeric derivatives of the result.
#include "module/haptics/proxy/pose_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include "tests/support/random.h"

namespace palpate {
namespace {

constexpr int64_t kMs = 1'000'000;
using Source = std::function<Transform(double)>;

/// 1 rad/s about an axis through the volume's middle.
Transform turning(double time_s) {
  Transform t;
  t.rotation = glm::angleAxis(time_s, glm::dvec3(0.0, 1.0, 0.0));
  return t;
}

const glm::dvec3 kPoint(0.05, 0.0, 0.0);  // 50 mm from the axis

/// Length of frame n, s, about a mean.
using Frames = std::function<double(int n, double mean_s)>;
double steady(int, double mean_s) {
  return mean_s;
}
double alternating(int n, double mean_s) {
  return mean_s * (n % 2 ? 4.0 / 3.0 : 2.0 / 3.0);
}
Frames varying(uint32_t seed) {
  auto random = std::make_shared<test::Random>(seed);
  return [random](int, double mean_s) { return mean_s * random->draw(2.0 / 3.0, 4.0 / 3.0); };
}

/// The path of one point of the volume.
struct Trace {
  std::vector<glm::dvec3> points;
  glm::dvec3 velocity(size_t k) const { return 1e3 * (points[k] - points[k - 1]); }
  /// Over all ticks from `first` on.
  double fastest(size_t first) const {
    double most = 0.0;
    for (size_t k = first; k < points.size(); ++k) most = std::max(most, glm::length(velocity(k)));
    return most;
  }
  double velocity_step(size_t first) const {
    double most = 0.0;
    for (size_t k = first; k < points.size(); ++k)
      most = std::max(most, glm::length(velocity(k) - velocity(k - 1)));
    return most;
  }
};

/// Runs a source with its own frame times against a haptic loop of 1 kHz.
Trace follow(MovingPose& moving, const Source& source, const Frames& frames, double mean_s,
             double seconds, double first_s = 0.0) {
  Trace trace;
  double next = first_s;
  int n = 0;
  for (int64_t tick = 1; tick <= int64_t(1e3 * seconds); ++tick) {
    while (next <= 1e-3 * double(tick)) {
      const int64_t stamp = int64_t(1e9 * next);
      moving.add(source(1e-9 * double(stamp)), stamp);
      next += frames(n++, mean_s);
    }
    trace.points.push_back(moving.at(tick * kMs).world_from_volume(kPoint));
  }
  return trace;
}

/// Stands still at a pose, bit by bit, for 0.1 s from this time on.
bool stands_at(MovingPose& moving, const Transform& pose, int64_t from_ms) {
  for (int64_t ms = from_ms; ms < from_ms + 100; ++ms) {
    const Transform shown = moving.at(ms * kMs);
    if (shown.translation_m != pose.translation_m || shown.rotation != pose.rotation ||
        shown.scale != pose.scale)
      return false;
  }
  return true;
}

/// Velocity step of the exact path from one haptic frame to the next: 1 rad/s squared, 50 mm, 1 ms.
constexpr double kExactStep = 0.05e-3;

TEST(SmoothPath, HasNoTickAtFrameEndsHoweverFrameTimesVary) {
  for (const double mean_s : {1.0 / 5, 1.0 / 60, 1.0 / 240}) {
    for (uint32_t seed = 0; seed < 10; ++seed) {
      MovingPose moving(PosePath::kSmooth, turning(0.0));
      const Frames frames = seed == 0 ? Frames(steady) : seed == 1 ? alternating : varying(seed);
      const Trace trace = follow(moving, turning, frames, mean_s, 20.0);
      // After the delay is found (5 s) the force slope at 1000 N/m may be at most 0.02 N/ms above
      // that of the exact path, that is 0.02 m/s. The test allows a tenth of it. The clock may
      // still be changing the delay after a frame that was longer than any before.
      EXPECT_LT(trace.fastest(5000) - 0.05, 0.002) << mean_s << " seed " << seed;
      // A change of the clock's rate is ramped: at most 1/30 of the velocity per ms.
      EXPECT_LT(trace.velocity_step(5000), kExactStep + 0.05 / 30) << mean_s << " seed " << seed;
    }
  }
}

TEST(SmoothPath, FollowsConstantVelocityExactly) {
  // A screw motion with growth: translation, rotation and log scale at constant rates.
  const Source source = [](double s) {
    Transform t = turning(s);
    t.translation_m = glm::dvec3(0.02, -0.01, 0.03) * s;
    t.scale = glm::exp(glm::dvec3(0.01, 0.02, -0.01) * s);
    return t;
  };
  for (const Frames& frames : {Frames(steady), Frames(alternating)}) {
    MovingPose moving(PosePath::kSmooth, source(0.0));
    follow(moving, source, frames, 1.0 / 60, 10.0);
    double next = 10.0;
    int n = 0;
    for (int64_t tick = 10'001; tick < 12'000; ++tick) {
      if (next <= 1e-3 * double(tick)) {
        moving.add(source(next), int64_t(std::llround(1e9 * next)));
        next += frames(n++, 1.0 / 60);
      }
      const Transform got = moving.at(tick * kMs);
      const Transform want = source(1e-3 * double(tick) - moving.delay_s());
      // Time stamps are cut to 1 ns, which is 1e-9 of every rate; else the path only adds rounding.
      ASSERT_LT(glm::length(got.translation_m - want.translation_m), 1e-9) << tick;
      ASSERT_LT(glm::length(got.scale - want.scale), 1e-9) << tick;
      ASSERT_GT(std::abs(glm::dot(got.rotation, want.rotation)), 1.0 - 1e-15) << tick;
    }
  }
}

TEST(SmoothPath, StaysALittleMoreThanTheLongestFrameBehind) {
  MovingPose moving(PosePath::kSmooth, turning(0.0));
  follow(moving, turning, alternating, 1.0 / 60, 10.0);
  EXPECT_GT(moving.delay_s(), 4.0 / 3 / 60);
  EXPECT_LT(moving.delay_s(), 1.6 * 4.0 / 3 / 60);
}

/// A source with stalls, bursts and several poses in one haptic frame, followed in haptic frames of
/// 1 / per_ms ms.
std::vector<glm::dvec3> follow_unruly(uint32_t seed, int per_ms) {
  test::Random random(seed);
  const double rate = random.draw(-2.0, 2.0), wobble = random.draw(0.0, 20.0);
  const double mean_s = std::pow(10.0, random.draw(-2.4, -0.7));
  const auto source = [=](double s) {
    Transform t;
    t.rotation = glm::angleAxis(rate * s + 0.02 * std::sin(wobble * s),
                                glm::normalize(glm::dvec3(1.0, 2.0, -0.5)));
    t.translation_m = 0.01 * glm::dvec3(std::sin(3.0 * s), s, std::cos(wobble * s));
    return t;
  };
  MovingPose moving(PosePath::kSmooth, source(0.0));
  std::vector<glm::dvec3> points;
  double next = 0.0, arrives = 0.0;
  for (int tick = 1; tick <= 10'000 * per_ms; ++tick) {
    const double now = 1e-3 * tick / per_ms;
    while (std::max(next, arrives) <= now) {
      moving.add(source(next), int64_t(1e9 * next));
      const double what = random.draw(0, 100), long_s = random.draw(0.0, 1.5);
      // A burst: sent in time, but received late.
      if (what > 97) arrives = next + long_s;
      next += what < 3 ? long_s : what < 6 ? 1e-3 * long_s : mean_s * (0.5 + long_s);
    }
    points.push_back(moving.at(int64_t(1e9 * now)).world_from_volume(kPoint));
  }
  return points;
}

TEST(SmoothPath, HasNoVelocityJumpWhateverArrives) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    double steps[2], fastest = 0.0;
    for (const int per_ms : {1, 32}) {
      const auto p = follow_unruly(seed, per_ms);
      double& most = steps[per_ms > 1];
      most = 0.0;
      for (size_t k = 2; k < p.size(); ++k) {
        most = std::max(most, 1e3 * per_ms * glm::length(p[k] - 2.0 * p[k - 1] + p[k - 2]));
        fastest = std::max(fastest, 1e3 * per_ms * glm::length(p[k] - p[k - 1]));
      }
    }
    // With the haptic frame 32 times shorter, the velocity step of a smooth path becomes 32 times
    // smaller; at a kink it stays the same. A factor of 8 is for poses that arrive in another
    // haptic frame. A path that hardly bends gives nothing to compare.
    EXPECT_LT(steps[1], std::max(0.25 * steps[0], 0.002)) << "seed " << seed;
    // At worst the way of 1.5 s (3 rad at 50 mm, and about 40 mm) is done in 0.25 s. A cubic is up
    // to three times as fast as its mean, and the clock up to 3/2 fast.
    EXPECT_LT(fastest, (0.15 + 0.04) / 0.25 * 3.0 * 1.5) << "seed " << seed;
  }
}

TEST(SmoothPath, IsContinuouslyDifferentiableAtEveryScaleOfTime) {
  // With half the haptic frame the velocity step of a C1 path is halved; at a kink it stays the
  // same.
  double steps[2];
  for (const int fine : {1, 8}) {
    MovingPose moving(PosePath::kSmooth, turning(0.0));
    auto random = varying(7);
    std::vector<glm::dvec3> points;
    double next = 0.0;
    for (int64_t tick = 1; tick < 8000 * fine; ++tick) {
      const double now = 1e-3 * double(tick) / fine;
      if (next <= now && (now < 3.0 || now > 3.3) && now < 6.0) {
        moving.add(turning(now), int64_t(1e9 * now));
        next = now + random(0, 1.0 / 60);
      }
      points.push_back(moving.at(int64_t(1e9 * now)).world_from_volume(kPoint));
    }
    double most = 0.0;
    for (size_t k = size_t(500 * fine); k < points.size(); ++k)
      most =
          std::max(most, 1e3 * fine * glm::length(points[k] - 2.0 * points[k - 1] + points[k - 2]));
    steps[fine == 8] = most;
  }
  // 1/8, and a factor of 2 for where the frames fall.
  EXPECT_LT(steps[1], 0.25 * steps[0]);
}

TEST(SmoothPath, RestsAtTheLastPoseWithoutOvershootWhenTheSourceStalls) {
  MovingPose moving(PosePath::kSmooth, turning(0.0));
  follow(moving, turning, alternating, 1.0 / 60, 3.0);
  const Transform last = turning(3.005);
  moving.add(last, 3005 * kMs);
  double before = -1.0;
  glm::dvec3 p2(0.0), p1(0.0);
  for (int64_t tick = 3005; tick < 3500; ++tick) {
    const Transform t = moving.at(tick * kMs);
    const double angle = 2.0 * std::atan2(t.rotation.y, t.rotation.w);
    ASSERT_GE(angle, before) << tick;         // never back
    ASSERT_LE(angle, 3.005 + 1e-12) << tick;  // never beyond
    before = angle;
    const glm::dvec3 p = t.world_from_volume(kPoint);
    // The room for braking is 0.9 * 0.4 of a frame of 22 ms: at most 2 / 8 ms of the velocity a ms.
    const double step = tick > 3007 ? 1e3 * glm::length(p - 2.0 * p1 + p2) : 0.0;
    ASSERT_LT(step, 0.05 * 0.26) << tick;
    p2 = p1, p1 = p;
  }
  EXPECT_TRUE(stands_at(moving, last, 3500));
}

TEST(SmoothPath, DoesNotOvershootWhenTheSourceStopsButGoesOnSending) {
  const Source source = [](double s) {
    Transform t;
    t.translation_m.x = 0.1 * std::min(s, 2.0);
    return t;
  };
  for (uint32_t seed = 0; seed < 20; ++seed) {
    MovingPose moving(PosePath::kSmooth, source(0.0));
    const Trace trace = follow(moving, source, varying(seed), 1.0 / 60, 3.0);
    // The source may stop right after a pose. Then a velocity of 0.1 m/s has to end within a
    // shorter way than a C1 path needs; in the 8 ms that it has it goes at least 4/27 of v * h too
    // far.
    for (const glm::dvec3& p : trace.points)
      ASSERT_LE(p.x, 0.05 + 0.2 + 0.1 * 0.008 * 4.0 / 27.0) << "seed " << seed;
    EXPECT_TRUE(stands_at(moving, source(3.0), 3001)) << "seed " << seed;
  }
}

TEST(SmoothPath, EasesInWhenTheSourceGoesOnAfterAPause) {
  // A silent source is at rest, as a SpaceMouse: at rest for two seconds, then 0.05 m/s.
  const Source source = [](double s) {
    Transform t;
    t.translation_m.x = s < 3.0 ? 0.0 : 0.05 * (s - 3.0);
    return t;
  };
  MovingPose moving(PosePath::kSmooth, source(0.0));
  follow(moving, source, steady, 1.0 / 60, 1.0);
  EXPECT_TRUE(stands_at(moving, source(1.0), 1001));
  Trace trace;
  double next = 3.0 + 1.0 / 60;
  for (int64_t tick = 1101; tick < 6000; ++tick) {
    if (next <= 1e-3 * double(tick)) {
      moving.add(source(next), int64_t(1e9 * next));
      next += 1.0 / 60;
    }
    trace.points.push_back(moving.at(tick * kMs).world_from_volume(glm::dvec3(0.0)));
  }
  // A cubic from rest to a velocity has at most 4/3 of the mean velocity. Its velocity rises by 4 /
  // h at first, where h is the delay: 23 ms or more here.
  EXPECT_LT(trace.fastest(2), 0.05 * 4.0 / 3 + 1e-9);
  EXPECT_LT(trace.velocity_step(3), 0.05 * 4.0 / 23);
  EXPECT_LT(moving.delay_s(), 0.03);
}

TEST(SmoothPath, EasesInWhenASourceThatAlwaysSendsBeginsToMove) {
  const Source source = [](double s) {
    Transform t;
    t.translation_m.x = s < 3.0 ? 0.0 : 0.05 * (s - 3.0);
    return t;
  };
  MovingPose moving(PosePath::kSmooth, source(0.0));
  const Trace trace = follow(moving, source, steady, 1.0 / 60, 4.0);
  EXPECT_LT(trace.velocity_step(2), 0.05 * 4.0 / 23);  // as after a pause
}

TEST(SmoothPath, FollowsAFastSourceThatSendsEachPoseTwice) {
  // 1 m/s, measured at 60 Hz and sent at 120: five times what is allowed to a source that stood.
  const Source source = [](double s) {
    Transform t;
    t.translation_m.x = std::floor(60.0 * s + 1e-6) / 60.0;
    return t;
  };
  MovingPose moving(PosePath::kSmooth, source(0.0));
  follow(moving, source, steady, 1.0 / 120, 3.0);
  EXPECT_LT(moving.delay_s(), 0.05);
}

TEST(SmoothPath, CatchesUpAfterABurst) {
  // 40 poses arrive together after 0.6 s.
  MovingPose moving(PosePath::kSmooth, turning(0.0));
  follow(moving, turning, steady, 1.0 / 60, 2.0);
  double sent = 2.0;
  Trace trace;
  for (int64_t tick = 2001; tick < 8000; ++tick) {
    const double now = 1e-3 * double(tick);
    if (now > 2.6)
      for (; sent < now; sent += 1.0 / 60) moving.add(turning(sent), int64_t(1e9 * sent));
    trace.points.push_back(moving.at(tick * kMs).world_from_volume(kPoint));
  }
  EXPECT_LT(trace.fastest(2), 2.0 * 0.05);  // the clock's 3/2 times a cubic's 4/3 from rest
  EXPECT_LT(moving.delay_s(), 0.035);
}

TEST(SmoothPath, NeverThrowsWhatLeaps) {
  MovingPose moving(PosePath::kSmooth, Transform{});
  Transform far;
  far.translation_m.x = 0.5;
  std::vector<double> x;
  for (int64_t tick = 1; tick < 1500; ++tick) {
    if (tick % 16 == 0) moving.add(tick < 500 ? Transform{} : far, tick * kMs);
    x.push_back(moving.at(tick * kMs).translation_m.x);
  }
  double most = 0.0;
  for (size_t k = 1; k < x.size(); ++k) most = std::max(most, 1e3 * (x[k] - x[k - 1]));
  // 0.25 s; a cubic from rest to rest has 3/2 of its mean, and somewhat more because the rest is
  // detected late; the clock is up to 3/2 fast.
  EXPECT_LT(most, 0.5 / 0.25 * 2.0 * 1.5);
  EXPECT_EQ(x.back(), 0.5);
}

TEST(SmoothPath, TurnsTheShorterWayAndThroughHalfTurns) {
  for (const double degrees : {170.0, 179.999999, 180.0, 180.000001, 190.0}) {
    const double angle = glm::radians(degrees);
    Transform to;
    to.rotation = glm::angleAxis(angle, glm::normalize(glm::dvec3(1.0, 1.0, 0.3)));
    MovingPose moving(PosePath::kSmooth, Transform{});
    moving.add(Transform{}, kMs);
    double turned = 0.0;
    glm::dquat before(1.0, 0.0, 0.0, 0.0);
    for (int64_t tick = 2; tick < 1000; ++tick) {
      if (tick == 20) moving.add(to, tick * kMs);
      const Transform t = moving.at(tick * kMs);
      ASSERT_NEAR(glm::length(t.rotation), 1.0, 1e-12);
      turned += glm::length(rotation_of(glm::conjugate(before) * t.rotation));
      before = t.rotation;
    }
    EXPECT_NEAR(turned, std::min(angle, 2 * glm::pi<double>() - angle), 1e-6) << degrees;
    EXPECT_GT(std::abs(glm::dot(before, to.rotation)), 1.0 - 1e-15) << degrees;
  }
}

TEST(MovingPoseOfAnyPath, TakesBothSignsOfAQuaternion) {
  for (const PosePath path : {PosePath::kSmooth, PosePath::kPaper, PosePath::kExact}) {
    int n = 0;
    const Source flipping = [&n](double s) {
      Transform t = turning(s);
      if (++n % 2) t.rotation = -t.rotation;
      return t;
    };
    MovingPose plain(path, turning(0.0)), flipped(path, turning(0.0));
    const Trace a = follow(plain, turning, alternating, 1.0 / 60, 7.0);
    const Trace b = follow(flipped, flipping, alternating, 1.0 / 60, 7.0);
    for (size_t k = 0; k < a.points.size(); ++k)
      ASSERT_EQ(glm::length(a.points[k] - b.points[k]), 0.0) << int(path) << " " << k;
  }
}

TEST(MovingPoseOfAnyPath, KeepsAScaleThatDiffersByAxis) {
  const Source source = [](double s) {
    Transform t = turning(s);
    t.scale = glm::dvec3(0.5, 2.0 + std::sin(s), 4.0);
    return t;
  };
  for (const PosePath path : {PosePath::kSmooth, PosePath::kPaper}) {
    MovingPose moving(path, source(0.0));
    follow(moving, source, varying(3), 1.0 / 60, 4.0);
    const Transform t = moving.at(4001 * kMs);
    EXPECT_EQ(t.scale.x, 0.5);
    EXPECT_EQ(t.scale.z, 4.0);
    // A value of the last two frames. The interpolation of a sine over 20 ms is right to 1e-4.
    EXPECT_GT(t.scale.y, 2.0 + std::sin(4.0) - 1e-4);
    EXPECT_LT(t.scale.y, 2.0 + std::sin(4.0 - 0.05) + 1e-4);
  }
}

TEST(MovingPoseOfAnyPath, IgnoresWhatIsNoPoseOrComesTwice) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Transform> bad(6);
  bad[0].translation_m.y = kNan;
  bad[1].rotation = glm::dquat(0.0, 0.0, 0.0, 0.0);
  bad[2].rotation.x = kNan;
  bad[3].scale.z = 0.0;
  bad[4].scale.x = -1.0;
  bad[5].translation_m.x = std::numeric_limits<double>::infinity();
  for (const PosePath path : {PosePath::kSmooth, PosePath::kPaper, PosePath::kExact}) {
    MovingPose plain(path, turning(0.0)), fed(path, turning(0.0));
    double next = 0.0;
    for (int64_t tick = 1; tick < 2000; ++tick) {
      const double now = 1e-3 * double(tick);
      if (now >= next) {
        plain.add(turning(now), tick * kMs);
        for (const Transform& b : bad) fed.add(b, tick * kMs);
        fed.add(turning(now), tick * kMs);
        fed.add(turning(now + 1.0), tick * kMs);      // twice
        fed.add(turning(now + 1.0), tick * kMs - 5);  // backwards
        next += 1.0 / 60;
      }
      const Transform a = plain.at(tick * kMs), b = fed.at(tick * kMs);
      ASSERT_EQ(std::memcmp(&a, &b, sizeof a), 0) << int(path) << " " << tick;
    }
  }
}

TEST(MovingPoseOfAnyPath, EndsAtTheNewestPoseAndThenRests) {
  for (const PosePath path : {PosePath::kSmooth, PosePath::kPaper, PosePath::kExact}) {
    MovingPose moving(path, turning(0.0));
    EXPECT_TRUE(stands_at(moving, turning(0.0), 1)) << int(path);
    follow(moving, turning, steady, 1.0 / 60, 1.0);
    const Transform last = turning(1.0);
    moving.add(last, 1000 * kMs + 1);
    for (int64_t tick = 1001; tick < 1300; ++tick) moving.at(tick * kMs);
    EXPECT_TRUE(stands_at(moving, last, 1300)) << int(path);
    // Adding the same pose again is no motion; another pose is one.
    moving.add(last, 1401 * kMs);
    EXPECT_EQ(moving.at(1401 * kMs).rotation, last.rotation) << int(path);
    moving.add(turning(1.01), 1510 * kMs);
    EXPECT_FALSE(stands_at(moving, last, 1511)) << int(path);
  }
}

TEST(MovingPoseOfAnyPath, TakesStampsFarInTheFutureAndLateCalls) {
  MovingPose moving(PosePath::kSmooth, turning(0.0));
  follow(moving, turning, steady, 1.0 / 60, 2.0);
  moving.add(turning(2.01), 60'000 * kMs);
  glm::dvec3 before = moving.at(2001 * kMs).world_from_volume(kPoint);
  for (int64_t tick = 2002; tick < 2100; ++tick) {
    const glm::dvec3 p = moving.at(tick * kMs).world_from_volume(kPoint);
    ASSERT_LT(glm::length(p - before), 3.0 * 0.05e-3);
    before = p;
  }
  for (int k = 0; k < 60; ++k) {
    const int64_t tick = 2100 + 16 * k;
    moving.add(turning(1e-3 * double(tick)), tick * kMs);
    for (int64_t i = 0; i < 16; ++i) before = moving.at((tick + i) * kMs).world_from_volume(kPoint);
  }
  EXPECT_LT(moving.delay_s(), 0.05);
  EXPECT_NEAR(rotation_of(moving.at(3060 * kMs).rotation).y, 3.06 - moving.delay_s(), 0.01);
  const Transform now = moving.at(3060 * kMs), again = moving.at(3060 * kMs);
  EXPECT_EQ(now.rotation, again.rotation);
  EXPECT_EQ(moving.at(1000 * kMs).rotation, now.rotation);
}

TEST(PaperPath, KeepsThePapersKinkAndNothingWorse) {
  // Where frames take alternately 11 and 22 ms, each frame's motion is played in the estimated 16.7
  // ms. For the short ones the velocity is 2/3 of the true one, and after them the volume stops.
  // This is the tick of Fig. 15.
  MovingPose moving(PosePath::kPaper, turning(0.0));
  const Trace trace = follow(moving, turning, alternating, 1.0 / 60, 10.0);
  EXPECT_GT(trace.velocity_step(1000), 0.02);
  // C0: no step is longer than that of the fastest piece.
  for (size_t k = 1; k < trace.points.size(); ++k)
    ASSERT_LT(glm::length(trace.points[k] - trace.points[k - 1]), 2.0 * 0.05e-3) << k;
  // With steady frames of a whole number of haptic frames there is no tick.
  MovingPose even(PosePath::kPaper, turning(0.0));
  const Trace smooth = follow(even, turning, steady, 0.016, 10.0, 0.016);
  EXPECT_LT(smooth.velocity_step(1000), 2.0 * kExactStep);
}

TEST(PaperPath, TakesTheFrameTimeByEquation21) {
  FrameIntervals intervals;
  EXPECT_EQ(intervals.inter_quartile_mean_s(), 0.0);
  intervals.add(0.02);
  EXPECT_EQ(intervals.inter_quartile_mean_s(), 0.02);
  // These are older than the window.
  for (int k = 0; k < 30; ++k) intervals.add(9.0);
  // 12 frame times: the three shortest and the three longest are ignored.
  for (const double t : {1.0, 1.0, 1.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 99.0, 99.0, 99.0})
    intervals.add(t);
  EXPECT_NEAR(intervals.inter_quartile_mean_s(), 35.0, 1e-12);
}

TEST(PaperPath, InterpolatesByLerpSlerpLerpAndHolds) {
  Transform from, to;
  from.translation_m = {0.0, 1.0, 0.0};
  to.translation_m = {1.0, 1.0, 2.0};
  to.rotation = glm::angleAxis(2.0, glm::dvec3(0.0, 0.0, 1.0));
  to.scale = {3.0, 1.0, 2.0};
  MovingPose moving(PosePath::kPaper, from);
  moving.add(from, 0);
  moving.at(0);
  moving.add(from, 100 * kMs);
  moving.at(100 * kMs);
  moving.add(to, 200 * kMs);  // both frame times are 100 ms
  moving.at(200 * kMs);
  const Transform t = moving.at(225 * kMs);
  EXPECT_LT(glm::length(t.translation_m - glm::dvec3(0.25, 1.0, 0.5)), 1e-14);
  EXPECT_LT(glm::length(t.scale - glm::dvec3(1.5, 1.0, 1.25)), 1e-14);
  EXPECT_NEAR(glm::length(rotation_of(t.rotation)), 0.5, 1e-14);
  EXPECT_EQ(moving.at(300 * kMs).translation_m, to.translation_m);
  EXPECT_EQ(moving.at(900 * kMs).scale, to.scale);
}

TEST(ExactPath, IsTheNewestPose) {
  MovingPose moving(PosePath::kExact, turning(0.0));
  for (int64_t tick = 1; tick < 100; ++tick) {
    const Transform want = turning(1e-3 * double(tick));
    moving.add(want, tick * kMs);
    EXPECT_LT(glm::length(moving.at(tick * kMs).rotation - want.rotation), 1e-15);
  }
  EXPECT_EQ(moving.delay_s(), 0.0);
}

TEST(PoseCurve, HasTheRatesItWasGivenAtBothEnds) {
  for (uint32_t seed = 0; seed < 1000; ++seed) {
    test::Random random(seed);
    const auto pose = [&] {
      Transform t;
      t.translation_m = random.vector(1.0);
      t.rotation = quaternion_of(random.vector(1.8));  // up to 3.1 rad
      t.scale = glm::exp(random.vector(1.0));
      return t;
    };
    const auto rate = [&] {
      PoseRate r;
      r.translation = random.vector(1.0);
      r.rotation = random.vector(3.0);
      r.log_scale = random.vector(1.0);
      return r;
    };
    const Transform from = pose(), to = pose();
    const PoseRate start = rate(), end = rate();
    const double h = random.draw(0.01, 1.0);
    const PoseCurve curve(from, start, to, end, h);
    const auto expect_near = [&](const PoseRate& a, const PoseRate& b, double tolerance) {
      EXPECT_LT(glm::length(a.translation - b.translation), tolerance) << "seed " << seed;
      EXPECT_LT(glm::length(a.rotation - b.rotation), tolerance) << "seed " << seed;
      EXPECT_LT(glm::length(a.log_scale - b.log_scale), tolerance) << "seed " << seed;
    };
    expect_near(curve.rate(0.0), start, 1e-12 / h);
    // Near half a turn the Jacobian is up to 10.
    expect_near(curve.rate(1.0), end, 1e-10 / h);
    expect_near(difference(curve.pose(1.0 - 1e-12), to), {}, 1e-10);
    // Numeric derivative: rounding 1e-16 / 2e-6 and truncation (2e-6 / h)^2.
    const double u = random.draw(0.05, 0.95), d = 1e-6;
    const PoseRate numeric =
        (1.0 / (2.0 * d * h)) * difference(curve.pose(u - d), curve.pose(u + d));
    expect_near(curve.rate(u), numeric, 1e-7 / h);
  }
}

TEST(PoseCurve, RotationVectorsComeBack) {
  for (uint32_t seed = 0; seed < 2000; ++seed) {
    test::Random random(seed);
    const double angle = std::pow(10.0, random.draw(-9.0, 0.49));  // to 3.09
    const glm::dvec3 r = angle * glm::normalize(random.vector(1.0));
    EXPECT_LT(glm::length(rotation_of(quaternion_of(r)) - r), 1e-14 * std::max(1.0, angle) + 1e-15)
        << "seed " << seed;
  }
}

}  // namespace
}  // namespace palpate
