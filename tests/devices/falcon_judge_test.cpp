// The assessment of a Falcon's answers: exchange by exchange, without a bus or a clock. The oracle
// for positions is the closed-form inverse kinematics; for counts of exchanges, the meaning of the
// constants.
#include "integration/devices/falcon_judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "integration/devices/falcon_kinematics.h"
#include "tests/devices/print_fault.h"

namespace palpate::devices::falcon {
namespace {

using Exchange = FalconJudge::FalconExchange;
constexpr int64_t kMs = 1'000'000;
// Half a count of each of three encoders, anywhere.
constexpr double kCount_m = 60e-6;

/// A judge, and the simulated device whose answers it gets.
struct Court {
  FalconJudge judge;
  glm::dvec3 place{0.0, 0.0, 0.130};
  glm::dvec3 force_n{0.0};
  uint8_t homed = kAllHomed;
  int64_t now_ns = 7 * kMs;

  FalconAnswer answer() const {
    FalconAnswer answer;
    const glm::dvec3 counts = encoder_counts(inverse(place).value().arm);
    for (int e = 0; e < 3; ++e) answer.encoders[size_t(e)] = int16_t(std::lround(counts[e]));
    answer.homed = homed;
    return answer;
  }
  DeviceReading tell(std::optional<FalconAnswer> answer, bool garbage = false) {
    now_ns += kMs;
    return judge.judge({answer, garbage, now_ns, force_n});
  }
  DeviceReading good() { return tell(answer()); }
  DeviceReading miss(bool garbage = false) { return tell(std::nullopt, garbage); }
  DeviceReading goods(int count) {
    DeviceReading reading;
    for (int n = 0; n < count; ++n) reading = good();
    return reading;
  }
  void trust() { ASSERT_EQ(goods(AnswerJudge::kRecover).fault, DeviceFault::kNone); }
};

TEST(FalconJudge, TrustsADeviceOnlyAfterSomeGoodAnswers) {
  Court court;
  const DeviceReading before = court.goods(AnswerJudge::kRecover - 1);
  EXPECT_EQ(before.fault, DeviceFault::kStarting);
  EXPECT_TRUE(before.fresh) << "the position is known already";
  EXPECT_EQ(court.good().fault, DeviceFault::kNone);
}

TEST(FalconJudge, GivesThePositionThatTheEncodersSay) {
  std::mt19937 random(41);
  std::normal_distribution<double> any;
  for (int n = 0; n < 500; ++n) {
    Court court;
    const glm::dvec3 way(any(random), any(random), any(random));
    court.place =
        kWorkspaceCentre + way * (0.9 * kWorkspaceRadius / std::max(1.0, glm::length(way)));
    const DeviceReading reading = court.good();
    ASSERT_TRUE(reading.fresh) << n;
    ASSERT_EQ(reading.time_ns, court.now_ns);
    ASSERT_LT(glm::distance(reading.position_m, court.place), kCount_m) << n;
  }
}

TEST(FalconJudge, DoesNotTrustCountsBeforeHomingAndSettlesAfterIt) {
  Court court;
  court.homed = 0x5;
  const DeviceReading reading = court.goods(1000);
  EXPECT_EQ(reading.fault, DeviceFault::kNotHomed);
  EXPECT_FALSE(reading.fresh);
  EXPECT_FALSE(court.judge.homed());
  court.homed = kAllHomed;
  EXPECT_EQ(court.goods(AnswerJudge::kSettle - 1).fault, DeviceFault::kStarting);
  EXPECT_EQ(court.good().fault, DeviceFault::kNone);
}

TEST(FalconJudge, DoesNotTakeTheJumpAtHomingForAFault) {
  Court court;
  court.homed = 0;
  court.goods(10);
  court.homed = kAllHomed;
  court.place = {0.03, 0.0, 0.100};
  EXPECT_EQ(court.good().fault, DeviceFault::kStarting);
}

TEST(FalconJudge, ForgivesTwoMissesInARowButNotThree) {
  Court court;
  court.trust();
  const glm::dvec3 last = court.judge.position();
  for (int round = 0; round < 5; ++round) {
    for (int n = 0; n < AnswerJudge::kMisses - 1; ++n) {
      const DeviceReading reading = court.miss();
      EXPECT_EQ(reading.fault, DeviceFault::kNone);
      EXPECT_FALSE(reading.fresh);
      EXPECT_EQ(reading.position_m, last);
    }
    EXPECT_EQ(court.good().fault, DeviceFault::kNone);
  }
  for (int n = 0; n < AnswerJudge::kMisses - 1; ++n) court.miss();
  EXPECT_EQ(court.miss().fault, DeviceFault::kTimeout);
}

TEST(FalconJudge, CallsMissesGarbageIfBytesCame) {
  Court court;
  court.trust();
  court.miss(true);
  court.miss();
  EXPECT_EQ(court.miss().fault, DeviceFault::kGarbage);
  // Misses before the last good answer do not count any more.
  court.goods(AnswerJudge::kRecover);
  for (int n = 0; n < AnswerJudge::kMisses - 1; ++n) court.miss();
  EXPECT_EQ(court.miss().fault, DeviceFault::kTimeout);
}

TEST(FalconJudge, LatchesAFaultUntilAllAnswersAreGoodForAWhile) {
  Court court;
  court.trust();
  for (int n = 0; n < AnswerJudge::kMisses; ++n) court.miss();
  EXPECT_EQ(court.goods(AnswerJudge::kRecover - 1).fault, DeviceFault::kTimeout);
  // Again, just before the first one is forgotten.
  court.judge.fail(DeviceFault::kTransfer);
  EXPECT_EQ(court.goods(AnswerJudge::kRecover - 1).fault, DeviceFault::kTransfer);
  EXPECT_EQ(court.good().fault, DeviceFault::kNone);
}

TEST(FalconJudge, GivesUpOnADeviceThatStaysSilent) {
  Court court;
  court.trust();
  for (int n = 0; n < AnswerJudge::kGiveUp - 1; ++n) court.miss();
  EXPECT_FALSE(court.judge.hopeless());
  court.miss();
  EXPECT_TRUE(court.judge.hopeless());
  court.judge.restart();
  EXPECT_FALSE(court.judge.hopeless());
  EXPECT_EQ(court.judge.fault(), DeviceFault::kStarting);
}

TEST(FalconJudge, TellsAJumpFromTheFastestHand) {
  Court court;
  court.trust();
  // In a millisecond.
  court.place.y += AnswerJudge::kHandSpeed * 1e-3;
  EXPECT_EQ(court.good().fault, DeviceFault::kNone);
  court.place.y -= AnswerJudge::kHandSpeed * 1e-3 + AnswerJudge::kJumpSlack + 2 * kCount_m;
  const DeviceReading reading = court.good();
  EXPECT_EQ(reading.fault, DeviceFault::kJumped);
  EXPECT_FALSE(reading.fresh);
  // The new place is accepted: the next answers are good.
  EXPECT_EQ(court.goods(AnswerJudge::kRecover).fault, DeviceFault::kNone);
}

TEST(FalconJudge, NeverSuspectsAHandThatMovesAsHandsDo) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> any;
    Court court;
    court.trust();
    glm::dvec3 speed(0.0);
    for (int n = 0; n < 2000; ++n) {
      // Up to 2 m/s, pulled back to the middle.
      speed += 0.1 * glm::dvec3(any(random), any(random), any(random)) -
               2.0 * (court.place - kWorkspaceCentre);
      if (glm::length(speed) > 2.0) speed *= 2.0 / glm::length(speed);
      glm::dvec3 way = court.place + 1e-3 * speed - kWorkspaceCentre;
      if (glm::length(way) > 0.95 * kWorkspaceRadius) {
        way *= 0.95 * kWorkspaceRadius / glm::length(way);
        speed = glm::dvec3(0.0);
      }
      court.place = kWorkspaceCentre + way;
      court.force_n = glm::dvec3(2.0 * std::sin(0.05 * n), 0.0, 1.0);
      ASSERT_EQ(court.good().fault, DeviceFault::kNone) << "seed " << seed << " exchange " << n;
    }
  }
}

TEST(FalconJudge, DoesNotBlameTheDeviceForALateHost) {
  Court court;
  court.trust();
  court.now_ns += 500 * kMs;
  court.place.x += 0.008;
  EXPECT_EQ(court.good().fault, DeviceFault::kNone);
}

TEST(FalconJudge, AllowsNoFurtherJumpAfterAPause) {
  Court court;
  court.trust();
  court.now_ns += 500 * kMs;
  court.place.x += 0.013;
  EXPECT_EQ(court.good().fault, DeviceFault::kJumped);
}

TEST(FalconJudge, RefusesWhatNoArmCanReach) {
  Court court;
  court.trust();
  const glm::dvec3 last = court.judge.position();
  FalconAnswer far = court.answer();
  far.encoders = {32767, -32768, 32767};
  const DeviceReading reading = court.tell(far);
  EXPECT_EQ(reading.fault, DeviceFault::kOutOfReach);
  EXPECT_EQ(reading.position_m, last);
  EXPECT_FALSE(reading.fresh);
}

TEST(FalconJudge, FindsThatNothingMovesWhileTheForceChanges) {
  Court court;
  court.trust();
  court.goods(10 * AnswerJudge::kStill);
  EXPECT_EQ(court.judge.fault(), DeviceFault::kNone) << "a grip may rest under the same force";
  court.force_n = {0.0, 0.0, 0.9 * AnswerJudge::kStillForce};
  court.goods(10 * AnswerJudge::kStill);
  EXPECT_EQ(court.judge.fault(), DeviceFault::kNone) << "too small a force to conclude this";
  court.force_n = {0.0, 0.0, 1.1 * AnswerJudge::kStillForce};
  EXPECT_EQ(court.goods(AnswerJudge::kStill - 1).fault, DeviceFault::kNone);
  EXPECT_EQ(court.good().fault, DeviceFault::kStuck);
}

TEST(FalconJudge, LetsArmsRestAgainstTheirStops) {
  Court court;
  court.place = kWorkspaceCentre + glm::dvec3(0.0, 0.0, 0.95 * kWorkspaceRadius);
  court.trust();
  court.force_n = {0.0, 0.0, 4.0};
  EXPECT_EQ(court.goods(10 * AnswerJudge::kStill).fault, DeviceFault::kNone);
}

TEST(FalconJudge, FindsOneArmThatStandsWhileTheOthersMove) {
  for (size_t arm = 0; arm < 3; ++arm) {
    Court court;
    court.trust();
    const int16_t stands = court.answer().encoders[arm];
    int exchanges = 0;
    DeviceReading reading = court.good();
    while (reading.fault == DeviceFault::kNone && exchanges < 1000) {
      court.place =
          glm::dvec3(0.002 * std::sin(0.1 * exchanges), 0.002 * std::cos(0.07 * exchanges),
                     0.130 + 0.004 * std::sin(0.13 * exchanges));
      FalconAnswer answer = court.answer();
      answer.encoders[arm] = stands;
      reading = court.tell(answer);
      ++exchanges;
    }
    EXPECT_EQ(reading.fault, DeviceFault::kStuck) << "arm " << arm;
    EXPECT_LT(exchanges, 1000);
  }
}

TEST(FalconJudge, HoldsTheLastPositionForFaultsFromOutside) {
  Court court;
  court.trust();
  const DeviceReading held = court.judge.frozen(DeviceFault::kUnplugged);
  EXPECT_EQ(held.fault, DeviceFault::kUnplugged);
  EXPECT_FALSE(held.fresh);
  EXPECT_EQ(held.position_m, court.judge.position());
  EXPECT_EQ(court.judge.fault(), DeviceFault::kNone) << "reading must not change the state";
}

TEST(FalconJudge, KnowsNothingAfterARestartButWhereItWas) {
  Court court;
  court.trust();
  const glm::dvec3 last = court.judge.position();
  court.judge.restart();
  EXPECT_EQ(court.judge.position(), last);
  EXPECT_FALSE(court.judge.homed());
  // It was moved in the meantime.
  court.place.x += 0.03;
  EXPECT_EQ(court.good().fault, DeviceFault::kStarting);
  EXPECT_EQ(court.goods(AnswerJudge::kRecover - 1).fault, DeviceFault::kNone);
}

TEST(FalconJudge, GivesFinitePositionsForAnyAnswers) {
  std::mt19937 random(99);
  Court court;
  for (int n = 0; n < 100'000; ++n) {
    std::optional<FalconAnswer> answer;
    if (random() % 4) {
      answer.emplace();
      for (int16_t& count : answer->encoders)
        count = int16_t(random() % 8 ? int(random() % 3000) - 1500 : int(random()));
      answer->homed = random() % 16 ? kAllHomed : uint8_t(random() % 8);
    }
    court.force_n = glm::dvec3(double(random() % 100) * 0.1);
    const DeviceReading reading = court.tell(answer, random() % 2);
    const glm::dvec3 p = reading.position_m;
    ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) << n;
    // Longer than any arm.
    ASSERT_LT(glm::length(p), 0.3) << n;
    ASSERT_TRUE(answer || !reading.fresh) << n;
  }
}

}  // namespace
}  // namespace palpate::devices::falcon
