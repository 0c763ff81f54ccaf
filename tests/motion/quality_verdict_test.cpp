#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "compute/motion/verdict.h"
#include "compute/volume/phantom.h"
#include "tests/motion/quality_fields.h"

namespace palpate {
namespace {

using test::field_of;
using test::grid_at_origin;
using test::volume_of;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// Two frames of a heart with their true fields; each test damages one thing.
class VerdictOnTheHeart : public ::testing::Test {
 protected:
  static constexpr int kSize = 64;
  const Grid grid_ = heart_grid(kSize);
  const Sequence beat_ = shell_phantom(kSize);
  const Volume& fixed_ = beat_.frames[0];
  const Volume& moving_ = beat_.frames[1];
  const Field u_ = shell_truth(grid_, 0, 1);
  const Field w_ = shell_truth(grid_, 1, 0);

  static Verdict verdict(const Volume& fixed, const Volume& moving, const Field& u,
                         const Field* w = nullptr) {
    const auto evidence = examined(fixed, moving, u, w);
    EXPECT_TRUE(evidence);
    return judged(*evidence);
  }
};

std::string told(const Verdict& verdict) {
  std::string text = word(verdict.trust);
  for (const std::string& reason : verdict.reasons) text += "\n  " + reason;
  return text;
}

TEST_F(VerdictOnTheHeart, TheTruthIsOk) {
  const Verdict found = verdict(fixed_, moving_, u_, &w_);
  EXPECT_EQ(found.trust, Trust::kOk) << told(found);
  EXPECT_THAT(found.reasons, IsEmpty());
  EXPECT_THAT(found.passed, Contains(HasSubstr("local correlation")));
}

TEST_F(VerdictOnTheHeart, TheTruthStaysOkUnderGainAndBias) {
  Volume brighter = moving_;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        float& value = brighter.values[grid_.offset(i, j, k)];
        value = (0.7F + 0.7F * float(i) / kSize) * value - 100.0F;
      }
  const Verdict found = verdict(fixed_, brighter, u_, &w_);
  EXPECT_EQ(found.trust, Trust::kOk) << told(found);
}

TEST_F(VerdictOnTheHeart, NoMotionAtAllIsNotOkWhereThereIsMotion) {
  const Verdict found = verdict(beat_.frames[0], beat_.frames[2], still_field(grid_));
  EXPECT_NE(found.trust, Trust::kOk) << told(found);
}

TEST_F(VerdictOnTheHeart, AnEmptyFrameFails) {
  const Volume empty = volume_of(grid_, [](glm::dvec3) { return 0.0; });
  const Verdict moving_empty = verdict(fixed_, empty, u_, &w_);
  EXPECT_EQ(moving_empty.trust, Trust::kFailed);
  EXPECT_THAT(moving_empty.reasons,
              Contains(HasSubstr("moving frame that shows structure is 0.0000")));
  EXPECT_EQ(verdict(empty, moving_, u_, &w_).trust, Trust::kFailed);
  EXPECT_EQ(verdict(empty, empty, still_field(grid_)).trust, Trust::kFailed);
}

TEST_F(VerdictOnTheHeart, AFrameOfNoiseFails) {
  Volume noise = volume_of(grid_, [](glm::dvec3) { return 400.0; });
  for (size_t n = 0; n < noise.values.size(); ++n)
    noise.values[n] += float(90.0 * texture::gaussian_like(3, n));
  EXPECT_EQ(verdict(fixed_, noise, u_, &w_).trust, Trust::kFailed);
}

TEST_F(VerdictOnTheHeart, AFieldThatLeadsOutOfTheFrameFails) {
  const Field away = field_of(grid_, [](glm::dvec3) { return glm::dvec3(200.0, 0.0, 0.0); });
  const Field back = field_of(grid_, [](glm::dvec3) { return glm::dvec3(-200.0, 0.0, 0.0); });
  const Verdict found = verdict(fixed_, moving_, away, &back);
  EXPECT_EQ(found.trust, Trust::kFailed);
  EXPECT_THAT(found.reasons, Contains(HasSubstr("carried out of the moving frame is 1.000")));
}

TEST_F(VerdictOnTheHeart, AnotherSubjectFails) {
  // The other subject's heart is 20 mm aside and has its own texture.
  Grid aside = grid_;
  aside.origin_mm.y += 20.0;
  Volume other = shell_phantom(aside, 4, 99).frames[1];
  other.grid = grid_;
  const Verdict found = verdict(fixed_, other, u_, &w_);
  EXPECT_EQ(found.trust, Trust::kFailed) << told(found);
}

TEST_F(VerdictOnTheHeart, NotANumberFails) {
  Field broken = u_;
  broken.u_mm[1000].x = std::numeric_limits<float>::quiet_NaN();
  const Verdict found = verdict(fixed_, moving_, broken);
  EXPECT_EQ(found.trust, Trust::kFailed);
  EXPECT_THAT(found.reasons, Contains(HasSubstr("At 1 voxels the field is not finite")));
}

TEST_F(VerdictOnTheHeart, OneFoldIsSuspectAndManyFail) {
  Field one = u_;
  one.u_mm[grid_.offset(20, 20, 20)].x += 4.0F;
  const Verdict suspect = verdict(fixed_, moving_, one);
  EXPECT_EQ(suspect.trust, Trust::kSuspect) << told(suspect);
  EXPECT_THAT(suspect.reasons, Contains(HasSubstr("voxels fold, smallest determinant")));
  Field many = u_;
  for (int k = 10; k < 50; k += 2)
    for (int j = 10; j < 50; j += 2) many.u_mm[grid_.offset(30, j, k)].x += 4.0F;
  EXPECT_EQ(verdict(fixed_, moving_, many).trust, Trust::kFailed);
}

TEST_F(VerdictOnTheHeart, AWrongBackwardFieldIsNotOk) {
  const Field none = still_field(grid_);
  const Verdict found = verdict(fixed_, moving_, u_, &none);
  EXPECT_NE(found.trust, Trust::kOk);
  EXPECT_THAT(found.reasons, Contains(HasSubstr("The inverse consistency error is")));
}

/// Evidence that passes all checks; tests change single measures.
Evidence good_evidence() {
  Evidence evidence;
  evidence.folds = Folds{1000, 0, 0.6, 0.1, 0};
  Match match;
  match.blocks = 1000;
  match.textured = match.textured_moving = match.compared = match.clear = 300;
  match.mismatched = 0.0;
  match.correlation_before = 0.6;
  match.correlation_after = 0.95;
  evidence.match = match;
  evidence.inverse = Distances{};
  evidence.drift = Distances{};
  evidence.low_confidence = 0.1;
  return evidence;
}

struct Harm {
  const char* name;
  void (*harm)(Evidence&);
  Trust expected;
  const char* says;
};

class VerdictOnOneMeasure : public ::testing::TestWithParam<Harm> {};

TEST_P(VerdictOnOneMeasure, HasItsOwnLimitAndSaysIt) {
  Evidence evidence = good_evidence();
  ASSERT_EQ(judged(evidence).trust, Trust::kOk) << told(judged(evidence));
  GetParam().harm(evidence);
  const Verdict found = judged(evidence);
  EXPECT_EQ(found.trust, GetParam().expected) << told(found);
  EXPECT_THAT(found.reasons, Contains(HasSubstr(GetParam().says)));
  EXPECT_THAT(found.passed, Not(Contains(HasSubstr(GetParam().says))));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Harm kHarms[] = {
    {"Folds", [](Evidence& e) { e.folds->folded = 1; }, Trust::kSuspect, "1 of 1000 voxels fold"},
    {"ManyFolds", [](Evidence& e) { e.folds->folded = 5; }, Trust::kFailed, "(at most 0.001 or"},
    {"WildVolumes", [](Evidence& e) { e.folds->sd_log_det = 0.7; }, Trust::kSuspect,
     "0.700 (at most 0.5)"},
    {"NoImages", [](Evidence& e) { e.match.reset(); }, Trust::kSuspect,
     "not compared with its frames"},
    {"FlatFixed", [](Evidence& e) { e.match->textured = 1; }, Trust::kFailed,
     "fixed frame that shows"},
    {"FlatMoving", [](Evidence& e) { e.match->textured_moving = 0; }, Trust::kFailed,
     "moving frame that"},
    {"OtherContent", [](Evidence& e) { e.match->textured_moving = 60; }, Trust::kSuspect,
     "5 times"},
    {"PoorMatch", [](Evidence& e) { e.match->correlation_after = 0.7; }, Trust::kSuspect,
     "0.700 (0.600 before)"},
    {"NoMatch", [](Evidence& e) { e.match->correlation_after = kNan; }, Trust::kFailed,
     "correlation of nan"},
    {"Made worse", [](Evidence& e) { e.match->correlation_before = 0.99; }, Trust::kSuspect,
     "-0.040"},
    {"Mismatch", [](Evidence& e) { e.match->mismatched = 0.5; }, Trust::kFailed,
     "no match is 0.500"},
    {"MotionLeft", [](Evidence& e) { e.match->motion_left_voxels = 0.4; }, Trust::kSuspect,
     "still show a motion of 0.400 voxels on average (at most 0.3)"},
    {"StillMoving", [](Evidence& e) { e.match->moving_share = 0.2; }, Trust::kSuspect,
     "after motion correction is 0.200 (at most 0.15)"},
    {"Leaving", [](Evidence& e) { e.match->leaving = 0.4; }, Trust::kSuspect,
     "0.400 (at most 0.25)"},
    {"InverseMean", [](Evidence& e) { e.inverse->own_voxels.mean = 5.0; }, Trust::kFailed,
     "5.000 voxels on average"},
    {"InverseTail", [](Evidence& e) { e.inverse->own_voxels.p99 = 8.0; }, Trust::kSuspect,
     "99th percentile"},
    {"Drift", [](Evidence& e) { e.drift->own_voxels.mean = 1.5; }, Trust::kSuspect,
     "After one cycle"},
    {"Unsure", [](Evidence& e) { e.low_confidence = 0.95; }, Trust::kFailed,
     "low confidence is 0.950"},
};

INSTANTIATE_TEST_SUITE_P(, VerdictOnOneMeasure, ::testing::ValuesIn(kHarms), [](const auto& harm) {
  std::string name = harm.param.name;
  std::erase(name, ' ');
  return name;
});

TEST(Verdict, PutsTheWorstReasonFirst) {
  Evidence evidence = good_evidence();
  evidence.folds->folded = 1;
  evidence.low_confidence = 0.95;
  const Verdict found = judged(evidence);
  ASSERT_EQ(found.reasons.size(), 2u);
  EXPECT_THAT(found.reasons[0], HasSubstr("low confidence"));
}

TEST(Verdict, OfASequenceIsThatOfItsWorstPair) {
  Evidence evidence = good_evidence();
  Verdict whole = judged(evidence);
  evidence.match->leaving = 0.4;
  add(whole, judged(good_evidence()), "Frames 0 to 1");
  EXPECT_EQ(whole.trust, Trust::kOk);
  add(whole, judged(evidence), "Frames 1 to 2");
  EXPECT_EQ(whole.trust, Trust::kSuspect);
  EXPECT_THAT(whole.reasons, ::testing::ElementsAre(StartsWith("Frames 1 to 2: The share")));
}

TEST(Verdict, OfWrongMaskIsAnError) {
  const Grid grid = grid_at_origin(8);
  const Volume frame = volume_of(grid, [](glm::dvec3 p) { return p.x; });
  const Mask other = test::whole(grid_at_origin(9));
  EXPECT_FALSE(examined(frame, frame, still_field(grid), nullptr, nullptr, &other));
}

/// Good evidence about a frame.
FrameEvidence good_frame() {
  FrameEvidence frame;
  frame.evidence.folds = Folds{100, 0, 0.8, 0.05, 0};
  Match match;
  match.blocks = 100;
  match.textured = match.textured_moving = match.clear = 50;
  match.correlation_before = 0.5;
  match.correlation_after = 0.95;
  match.mismatched = 0.0;
  match.motion_left_voxels = 0.05;
  frame.evidence.match = match;
  frame.between = Folds{100, 0, 0.8, 0.05, 0};
  return frame;
}

TEST(VerdictOnASequence, IsThatOfItsWorstFrameWhichIsNamedFirst) {
  SequenceEvidence evidence;
  evidence.reference = 1;
  evidence.frames.assign(4, good_frame());
  // The reference frame is not compared with itself.
  evidence.frames[1].evidence.match.reset();
  evidence.drift = Distances{};
  ASSERT_EQ(judged(evidence).trust, Trust::kOk) << told(judged(evidence));
  evidence.frames[0].evidence.match->motion_left_voxels = 0.4;
  evidence.frames[3].evidence.match->motion_left_voxels = 0.6;
  Verdict found = judged(evidence);
  EXPECT_EQ(found.trust, Trust::kFailed);
  ASSERT_EQ(found.reasons.size(), 2U);
  EXPECT_THAT(found.reasons[0], StartsWith("Frame 3: "));
  EXPECT_THAT(found.reasons[1], StartsWith("Frame 0: "));
  evidence.frames.assign(4, good_frame());
  evidence.frames[2].between = Folds{100'000, 1, -0.1, 0.05, 0};
  found = judged(evidence);
  EXPECT_EQ(found.trust, Trust::kSuspect);
  EXPECT_THAT(found.reasons, Contains(StartsWith("After frame 2: ")));
  evidence.frames[2].between.folded = 0;
  evidence.drift->own_voxels.mean = 2.0;
  EXPECT_THAT(judged(evidence).reasons, Contains(StartsWith("Cycle: ")));
}

}  // namespace
}  // namespace palpate
