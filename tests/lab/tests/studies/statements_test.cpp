// The sentences of the report, for given measurements: they must follow from the numbers.
#include "tests/lab/studies/motion_statements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lab/tests/studies/made_measures.h"

namespace palpate::studies {
namespace {

using test::measures;
using test::ours;
using test::peer;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Statements, NameTheMostAccurateSettingForEachDeadline) {
  const auto rows = measures({ours("fast", 0.4, 0.4, true), ours("balanced", 0.9, 0.2, true),
                              ours("bad", 0.95, 0.9), ours("best", 3.0, 0.1, true)});
  EXPECT_THAT(deadline_sentences(rows),
              ElementsAre("With 0.5 s for a pair, take \"fast\": 0.4 mm (0.2 voxels) in 0.4 s.",
                          "With 1 s for a pair, take \"balanced\": 0.2 mm (0.1 voxels) in 0.9 s.",
                          "With 5 s for a pair, take \"best\": 0.1 mm (0.05 voxels) in 3 s."));
}

TEST(Statements, NameTheFastestSettingForEachError) {
  const auto rows = measures({ours("fast", 0.4, 0.45, true), ours("balanced", 0.9, 0.18, true),
                              ours("best", 3.0, 0.11, true)});
  EXPECT_THAT(
      error_sentences(rows),
      ElementsAre("For an error of at most 0.2 mm, take \"balanced\": 0.18 mm (0.09 voxels) "
                  "in 0.9 s.",
                  "The smallest error of all is 0.11 mm (0.055 voxels), by \"best\"."));
}

TEST(Statements, SayWhichPresetIsBeatenAndByWhat) {
  const auto rows = measures({ours("fast", 0.4, 0.4, true), ours("balanced", 1.0, 0.2, true),
                              ours("balanced, half the window", 0.5, 0.1)});
  EXPECT_THAT(preset_sentences(rows),
              ElementsAre("No other setting of palpate is both faster (by 10 %) and more accurate "
                          "(by 2 %) than \"fast\".",
                          "\"balanced\" is beaten by \"balanced, half the window\": 0.5 s instead "
                          "of 1 s, and 50 % less error."));
}

TEST(Statements, CallNothingBeatenWithinTheMargins) {
  const auto rows = measures({ours("fast", 1.0, 0.4, true), ours("fast, as good", 0.95, 0.2),
                              ours("fast, as fast", 0.5, 0.399)});
  EXPECT_THAT(preset_sentences(rows), ElementsAre(HasSubstr("than \"fast\"")));
}

TEST(Statements, HoldTheBestPeerAgainstTheFirstPresetThatIsAsGood) {
  const auto rows = measures({ours("fast", 0.4, 0.4, true), ours("balanced", 1.0, 0.2, true),
                              peer("Demons", 5.0, 0.9), peer("Diffeomorphic", 10.0, 0.3)});
  EXPECT_EQ(peer_sentence(rows),
            "The most accurate peer is Diffeomorphic (ITK): 0.3 mm (0.15 voxels) in 10 s. "
            "\"balanced\" is at least as accurate (0.2 mm (0.1 voxels)) in 1 s, 10 times sooner.");
}

TEST(Statements, AdmitWhenAPeerIsBetter) {
  const auto better = measures({ours("best", 1.0, 0.4, true), peer("Other", 0.5, 0.3)});
  EXPECT_THAT(peer_sentence(better), HasSubstr("No preset of palpate is as accurate here."));
  const auto sooner = measures({ours("best", 1.0, 0.2, true), peer("Other", 0.5, 0.3)});
  EXPECT_THAT(peer_sentence(sooner), HasSubstr("in 1 s, 2 times later."));
  EXPECT_EQ(peer_sentence(measures({ours("best", 1.0, 0.2, true)})), "");
}

TEST(Statements, SayWhatEachChangeDoes) {
  const auto rows = measures({ours("fast", 1.0, 0.4, true), ours("fast, a", 2.0, 0.2),
                              ours("fast, b", 1.05, 0.401), ours("fast, c", 0.5, 0.4)});
  EXPECT_THAT(sweep_sentences(rows), ElementsAre("fast, with a: 100 % slower, 50 % less error.",
                                                 "fast, with b: no difference.",
                                                 "fast, with c: 50 % faster, as accurate."));
}

TEST(Statements, AboutNothingAreEmpty) {
  EXPECT_TRUE(deadline_sentences(measures({})).empty());
  EXPECT_TRUE(error_sentences(measures({peer("Demons", 1, 1)})).empty());
  EXPECT_TRUE(preset_sentences(measures({})).empty());
}

}  // namespace
}  // namespace palpate::studies
