// Oracle: the requested time, summed in long double, and the frame from a search in a list.
#include "module/scene/playback.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate {
namespace {

const FrameTimes kHeart{{0.0, 0.25, 0.5, 0.75}, 1.0};
const FrameTimes kUneven{{0.0, 0.1, 0.13, 0.7}, 1.1};
const FrameTimes kOnce{{0.0, 0.1, 0.13, 0.7}, 0.0};

/// F of the method: frame + phase, unwrapped over cycles.
struct Unwrapped {
  int64_t frames = 0;
  double value(const Playback& p) const { return double(frames) + p.now().phase; }
  void follow(const Playback& p) { frames += p.crossed(); }
};

double seconds(const Playback& p, const FrameTimes& times) {
  const size_t k = size_t(p.now().frame);
  const double end = k + 1 < times.times_s.size() ? times.times_s[k + 1] : times.cycle_s;
  return times.times_s[k] + p.now().phase * (end - times.times_s[k]);
}

/// Properties that must hold after every step.
void expect_sound(const Playback& p, const FrameTimes& times, int frame_before) {
  const int n = int(times.times_s.size());
  ASSERT_GE(p.now().frame, 0);
  ASSERT_LT(p.now().frame, n);
  ASSERT_GE(p.now().phase, 0.0);
  ASSERT_LT(p.now().phase, 1.0);
  ASSERT_EQ((frame_before + p.crossed() + n) % n, p.now().frame);
}

TEST(Playback, StandsInTheFirstFrameWithoutASequence) {
  Playback p;
  EXPECT_EQ(p.step(0.1).frame, 0);
  EXPECT_EQ(p.now().phase, 0.0);
  EXPECT_TRUE(p.at_rest());
  const FrameTimes single{{0.0}, 0.0};
  Playback one(&single);
  EXPECT_EQ(one.step(0.1).phase, 0.0);
  one.scrub_to(3.0);
  EXPECT_TRUE(one.at_rest());
}

TEST(Playback, PlaysAsRecordedFromTheFirstStepOn) {
  Playback p(&kHeart);
  FramePointer f;
  for (int i = 0; i < 300; ++i) f = p.step(1e-3);
  EXPECT_EQ(f.frame, 1);
  // A sum of 300 times the nearest double to 0.001.
  EXPECT_NEAR(f.phase, 0.2, 1e-12);
  EXPECT_FALSE(p.at_rest());
}

TEST(Playback, AgreesWithLongDoubleAfterTenMillionSteps) {
  // Rates whose products with dt are not exact; phases of uneven frames.
  for (const double rate : {1.0, 0.37, -1.9}) {
    Playback p(&kUneven);
    p.set_rate(rate);
    // After the ramp.
    for (int i = 0; i < 40; ++i) p.step(1e-3);
    ASSERT_EQ(p.rate(), rate);
    long double asked = p.time_s();
    uint32_t bits = 12345;
    for (int i = 0; i < 10'000'000; ++i) {
      bits = bits * 1664525u + 1013904223u;
      const double dt = 1e-3 * (0.9 + 0.2 * double(bits >> 8) * 0x1p-24);
      p.step(dt);
      asked += static_cast<long double>(rate) * dt;
    }
    long double want = std::fmod(asked, static_cast<long double>(kUneven.cycle_s));
    if (want < 0) want += kUneven.cycle_s;
    EXPECT_NEAR(seconds(p, kUneven), double(want), 1e-9) << rate;
    EXPECT_NEAR(p.time_s(), double(want), 1e-9) << rate;
  }
}

TEST(Playback, FindsTheFrameOfUnevenTimesAtEveryRate) {
  for (uint32_t seed = 0; seed < 100; ++seed) {
    test::Random random(seed);
    FrameTimes times{{0.0}, 0.0};
    const int n = 2 + int(random.draw(0, 9));
    // 0.1 to 100 frames per second.
    for (int k = 1; k < n; ++k)
      times.times_s.push_back(times.times_s.back() + std::pow(10.0, random.draw(-2, 1)));
    times.cycle_s = times.times_s.back() + std::pow(10.0, random.draw(-2, 1));
    Playback p(&times);
    const double rate = random.draw(-3, 3);
    p.set_rate(rate);
    for (int i = 0; i < 40; ++i) p.step(1e-3);
    long double asked = p.time_s();
    for (int i = 0; i < 5000; ++i) {
      const double dt = random.draw(0.0, 3e-3);  // 3 ms at rate 3 stays below the 10 ms frames
      const int before = p.now().frame;
      p.step(dt);
      asked += static_cast<long double>(rate) * dt;
      ASSERT_NO_FATAL_FAILURE(expect_sound(p, times, before)) << "seed " << seed;
      long double want = std::fmod(asked, static_cast<long double>(times.cycle_s));
      if (want < 0) want += times.cycle_s;
      const double error = std::remainder(seconds(p, times) - double(want), times.cycle_s);
      ASSERT_NEAR(error, 0.0, 1e-12) << "seed " << seed << " step " << i;
    }
  }
}

TEST(Playback, ComesBackToTheSamePhaseAfterReversing) {
  Playback p(&kUneven);
  p.set_rate(0.0);
  for (int i = 0; i < 40; ++i) p.step(1e-3);
  const FramePointer start = p.now();
  Unwrapped way;
  p.set_rate(2.0);
  for (int i = 0; i < 5000; ++i) p.step(1e-3), way.follow(p);
  EXPECT_GT(way.frames, 30);
  p.set_rate(-2.0);
  // Forward: 20 ms of ramp and 4,980 ms. Backward: 20 ms for the reversal, 4,980 ms, and the ramp
  // to 0.
  for (int i = 0; i < 5000; ++i) p.step(1e-3), way.follow(p);
  p.set_rate(0.0);
  for (int i = 0; i < 40; ++i) p.step(1e-3), way.follow(p);
  EXPECT_EQ(way.frames, 0);
  EXPECT_EQ(p.now().frame, start.frame);
  EXPECT_NEAR(p.now().phase, start.phase, 1e-9);
  EXPECT_TRUE(p.at_rest());
}

TEST(Playback, ChangesItsVelocityOverTwentyMilliseconds) {
  Playback p(&kHeart);
  p.step(1e-3);
  p.set_rate(-1.0);
  double before = p.rate();
  for (int i = 0; i < 20; ++i) {
    p.step(1e-3);
    EXPECT_NEAR(p.rate() - before, -0.1, 1e-12) << i;
    before = p.rate();
  }
  p.step(1e-3);
  EXPECT_EQ(p.rate(), -1.0);
}

TEST(Playback, GoesTheSameWayThroughARampHoweverItIsCut) {
  Playback fine(&kHeart), coarse(&kHeart);
  fine.set_rate(0.0), coarse.set_rate(0.0);
  for (int i = 0; i < 3000; ++i) fine.step(1e-5);
  coarse.step(0.03);
  // A triangle of 20 ms.
  EXPECT_NEAR(fine.time_s(), 0.010, 1e-12);
  EXPECT_NEAR(coarse.time_s(), 0.010, 1e-12);
}

TEST(Playback, RestsWhenPausedAndGoesOnAfterwards) {
  Playback p(&kHeart);
  p.set_rate(0.0);
  EXPECT_FALSE(p.at_rest());
  for (int i = 0; i < 21; ++i) p.step(1e-3);
  EXPECT_TRUE(p.at_rest());
  const FramePointer paused = p.now();
  for (int i = 0; i < 100; ++i) p.step(1e-3);
  EXPECT_EQ(p.now().frame, paused.frame);
  EXPECT_EQ(p.now().phase, paused.phase);
  p.set_rate(1.0);
  EXPECT_FALSE(p.at_rest());
  for (int i = 0; i < 900; ++i) p.step(1e-3);
  EXPECT_NEAR(p.time_s(), 0.010 + 0.890, 1e-12);  // the two ramps lose 10 ms each
}

TEST(Playback, CrossesOneBorderPerStepAndCatchesUp) {
  for (const double sign : {1.0, -1.0}) {
    Playback p(&kUneven);
    p.set_rate(sign);
    for (int i = 0; i < 30; ++i) p.step(1e-3);
    Unwrapped way;
    int before = p.now().frame;
    long double asked = p.time_s();
    p.step(2.5);  // ten borders
    asked += sign * 2.5L;
    ASSERT_NO_FATAL_FAILURE(expect_sound(p, kUneven, before));
    for (int i = 0; i < 20; ++i) {
      way.follow(p);
      before = p.now().frame;
      p.step(1e-3);
      asked += sign * static_cast<long double>(1e-3);
      ASSERT_NO_FATAL_FAILURE(expect_sound(p, kUneven, before));
    }
    long double want = std::fmod(asked, static_cast<long double>(kUneven.cycle_s));
    if (want < 0) want += kUneven.cycle_s;
    EXPECT_NEAR(seconds(p, kUneven), double(want), 1e-12) << sign;
  }
}

TEST(Playback, KeepsUpAtAThousandFramesPerSecond) {
  FrameTimes fast{{}, 0.1};
  for (int k = 0; k < 100; ++k) fast.times_s.push_back(1e-3 * k);
  Playback p(&fast);
  Unwrapped way;
  for (int i = 0; i < 5000; ++i) p.step(0.999e-3), way.follow(p);
  EXPECT_NEAR(way.value(p), 0.999 * 5000, 1e-6);
}

TEST(Playback, ForgetsWhatItOwesWhenPaused) {
  Playback p(&kHeart);
  p.step(0.9);
  p.set_rate(0.0);
  for (int i = 0; i < 100; ++i) p.step(1e-3);
  // The second border was crossed only by the ramp.
  EXPECT_LT(seconds(p, kHeart), 0.52);
  EXPECT_TRUE(p.at_rest());
}

TEST(Playback, EndsInTheLastFrameWithoutAVelocityJump) {
  Playback p(&kOnce);
  double before = p.rate();
  for (int i = 0; i < 1500; ++i) {
    const int frame = p.now().frame;
    p.step(1e-3);
    ASSERT_NO_FATAL_FAILURE(expect_sound(p, kOnce, frame));
    // 20 ms from 1 to 0 are 0.05 per step; the last part brakes twice as hard at most.
    ASSERT_LT(std::abs(p.rate() - before), 0.1001) << i;
    before = p.rate();
  }
  EXPECT_EQ(p.now().frame, 3);
  EXPECT_EQ(p.now().phase, 0.0);
  EXPECT_EQ(p.time_s(), 0.7);
  EXPECT_TRUE(p.at_rest());
  p.set_rate(-1.0);
  EXPECT_FALSE(p.at_rest());
  for (int i = 0; i < 1500; ++i) p.step(1e-3);
  EXPECT_EQ(p.now().frame, 0);
  EXPECT_EQ(p.now().phase, 0.0);
  EXPECT_TRUE(p.at_rest());
}

TEST(Playback, ScrubsToItsTargetNoFasterThanAllowed) {
  Playback p(&kOnce);
  p.set_rate(0.0);
  for (int i = 0; i < 30; ++i) p.step(1e-3);
  p.scrub_to(0.6, 2.0);
  double before = p.rate();
  int steps = 0;
  while (!p.at_rest() && steps < 2000) {
    p.step(1e-3), ++steps;
    ASSERT_LE(std::abs(p.rate()), 2.0);
    ASSERT_LE(std::abs(p.rate() - before), 0.2001);
    before = p.rate();
  }
  EXPECT_NEAR(p.time_s(), 0.6, 1e-12);
  EXPECT_NEAR(seconds(p, kOnce), 0.6, 1e-12);
  // 0.59 s at 2 s per s, and the ramps.
  EXPECT_GT(steps, 295);
  EXPECT_LT(steps, 450);
  p.scrub_to(-7.0);
  while (!p.at_rest() && steps < 4000) p.step(1e-3), ++steps;
  EXPECT_EQ(p.now().frame, 0);
  EXPECT_NEAR(p.time_s(), 0.0, 1e-12);
}

TEST(Playback, ScrubsTheShorterWayRoundACycle) {
  Playback p(&kHeart);
  p.set_rate(0.0);
  for (int i = 0; i < 30; ++i) p.step(1e-3);
  Unwrapped way;
  p.scrub_to(0.9);
  for (int i = 0; i < 2000 && !p.at_rest(); ++i) p.step(1e-3), way.follow(p);
  EXPECT_EQ(way.frames, -1);
  EXPECT_NEAR(p.time_s(), 0.9, 1e-12);
  p.scrub_to(5.2);
  for (int i = 0; i < 2000 && !p.at_rest(); ++i) p.step(1e-3), way.follow(p);
  EXPECT_EQ(way.frames, 0);
  EXPECT_NEAR(p.time_s(), 0.2, 1e-9);
}

TEST(Playback, NeverPassesAScrubsTargetWhenStepsComeLate) {
  for (uint32_t seed = 0; seed < 300; ++seed) {
    test::Random random(seed);
    Playback p(&kHeart);
    p.set_rate(0.0);
    for (int i = 0; i < 30; ++i) p.step(1e-3);
    p.scrub_to(0.7);
    while (!p.at_rest()) p.step(1e-3);
    // Backward, one target after the other, as from a stick that is held.
    double target = 0.7, before = p.time_s();
    for (int i = 0; i < 200; ++i) {
      if (i % 10 == 0) p.scrub_to(target -= random.draw(0.0, 0.03));
      p.step(random.draw(0, 4) < 1 ? random.draw(2e-3, 30e-3) : 1e-3);
      ASSERT_LE(p.time_s(), before + 1e-12) << "seed " << seed << " step " << i;
      ASSERT_GE(p.time_s(), target - 1e-12) << "seed " << seed << " step " << i;
      before = p.time_s();
    }
  }
}

TEST(Playback, PlaysOnAfterAScrub) {
  Playback p(&kHeart);
  p.step(1e-3);
  p.scrub_to(0.5);
  for (int i = 0; i < 400; ++i) p.step(1e-3);
  EXPECT_EQ(p.rate(), 1.0);
  const double time = p.time_s();
  for (int i = 0; i < 100; ++i) p.step(1e-3);
  EXPECT_NEAR(p.time_s() - time, 0.1, 1e-12);
}

TEST(Playback, NeverLeavesTheSequenceWhateverIsAsked) {
  for (uint32_t seed = 0; seed < 300; ++seed) {
    test::Random random(seed);
    const FrameTimes& times = seed % 2 ? kUneven : kOnce;
    Playback p(&times);
    for (int i = 0; i < 3000; ++i) {
      const double what = random.draw(0, 100);
      if (what < 1) p.set_rate(random.draw(-5, 5));
      if (what > 1 && what < 1.3) p.set_rate(0.0);
      if (what > 2 && what < 3) p.scrub_to(random.draw(-2, 2), random.draw(0.1, 8));
      const int before = p.now().frame;
      p.step(what > 99 ? random.draw(0, 1) : random.draw(0, 2e-3));
      ASSERT_NO_FATAL_FAILURE(expect_sound(p, times, before)) << "seed " << seed << " step " << i;
      ASSERT_GE(p.time_s(), 0.0);
      ASSERT_LE(p.time_s(), times.length_s());
      // Two sums of numbers below 2.
      ASSERT_NEAR(std::remainder(seconds(p, times) - p.time_s(), 2 * times.length_s()), 0.0, 1e-12)
          << "seed " << seed << " step " << i;
    }
  }
}

TEST(Playback, IgnoresWhatIsNoTime) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Playback p(&kHeart);
  p.step(0.1);
  const double time = p.time_s();
  for (const double dt : {0.0, -1.0, kNan, kInfinity, -kInfinity}) p.step(dt);
  EXPECT_EQ(p.time_s(), time);
  p.set_rate(kNan);
  p.set_rate(kInfinity);
  p.scrub_to(kNan);
  p.scrub_to(0.3, 0.0);
  p.scrub_to(0.3, kNan);
  p.step(0.1);
  EXPECT_NEAR(p.time_s(), time + 0.1, 1e-15);
}

TEST(Playback, GoesOnAtTheSameTimeOfExchangedData) {
  const FrameTimes copy = kUneven;
  Playback p(&kUneven), q(&kUneven);
  for (int i = 0; i < 3456; ++i) {
    p.step(1e-3), q.step(1e-3);
    if (i % 7 == 0) q.set_times(i % 2 ? &copy : &kUneven);
    ASSERT_EQ(p.now().frame, q.now().frame) << i;
    ASSERT_EQ(p.now().phase, q.now().phase) << i;
  }
  for (int i = 0; i < 400; ++i) q.step(1e-3);
  ASSERT_GT(q.time_s(), 0.5);
  const FrameTimes shorter{{0.0, 0.2}, 0.0};
  q.set_times(&shorter);
  EXPECT_EQ(q.time_s(), 0.2);
  EXPECT_EQ(q.now().frame, 1);
  EXPECT_EQ(q.now().phase, 0.0);
}

TEST(PointerAt, AgreesWithThePlaybackAtEveryTime) {
  for (const FrameTimes& times :
       {FrameTimes{{0.0, 0.4, 0.5, 1.1}, 1.5}, FrameTimes{{0.0, 0.4, 0.5, 1.1}, 0.0}}) {
    Playback playback(&times);
    for (int k = 0; k < 4000; ++k) {
      const FramePointer played = playback.step(0.7e-3);
      const FramePointer at = pointer_at(times, playback.time_s());
      // The playback adds up small steps; at a border the two may be on different sides.
      const double difference = std::remainder(
          (at.frame + at.phase) - (played.frame + played.phase), double(times.steps()));
      ASSERT_NEAR(difference, 0.0, 1e-9) << "step " << k;
    }
  }
}

TEST(PointerAt, WrapsInACycleAndStaysAtTheEndsOtherwise) {
  const FrameTimes cyclic{{0.0, 1.0, 2.0}, 3.0}, open{{0.0, 1.0, 2.0}, 0.0};
  EXPECT_EQ(pointer_at(cyclic, -0.5).frame, 2);
  EXPECT_DOUBLE_EQ(pointer_at(cyclic, -0.5).phase, 0.5);
  EXPECT_EQ(pointer_at(cyclic, 7.25).frame, 1);
  EXPECT_DOUBLE_EQ(pointer_at(cyclic, 7.25).phase, 0.25);
  EXPECT_EQ(pointer_at(open, -1.0).frame, 0);
  EXPECT_EQ(pointer_at(open, 9.0).frame, 2);
  EXPECT_EQ(pointer_at(open, 9.0).phase, 0.0);
  EXPECT_EQ(pointer_at(open, std::nan("")).frame, 0);
  EXPECT_EQ(pointer_at(FrameTimes{{0.0}, 0.0}, 5.0).frame, 0);
}

}  // namespace
}  // namespace palpate
