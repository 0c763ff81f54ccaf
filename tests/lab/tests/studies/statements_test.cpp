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

/// A table's rows as text.
std::vector<std::string> rows_of(const report::Table& table) {
  std::vector<std::string> rows;
  for (const auto& row : table.rows) {
    rows.emplace_back();
    for (const report::Cell& cell : row)
      rows.back() += (rows.back().empty() ? "" : "; ") + cell.text;
  }
  return rows;
}

TEST(Statements, NameTheMostAccurateSettingForEachDeadline) {
  const auto rows = measures({ours("fast", 0.4, 0.4, true), ours("balanced", 0.9, 0.2, true),
                              ours("bad", 0.95, 0.9), ours("best", 3.0, 0.1, true)});
  EXPECT_THAT(deadline_sentences(rows),
              ElementsAre("With 0.5 s for a pair, take \"fast\": 0.4 mm (0.2 voxels) in 0.4 s.",
                          "With 1 s for a pair, take \"balanced\": 0.2 mm (0.1 voxels) in 0.9 s.",
                          "With 5 s for a pair, take \"best\": 0.1 mm (0.05 voxels) in 3 s."));
}

TEST(Statements, NameTheSettingForEachDeadlineAndEachError) {
  const auto rows = measures({ours("fast", 0.4, 0.45, true), ours("balanced", 0.9, 0.18, true),
                              ours("best", 3.0, 0.11, true)});
  EXPECT_THAT(rows_of(choice_table(rows)),
              ElementsAre("0.5 s; fast; 0.400; 0.450; 0.225", "1 s; balanced; 0.900; 0.180; 0.090",
                          "5 s; best; 3.000; 0.110; 0.055", "0.2 mm; balanced; 0.900; 0.180; 0.090",
                          "the smallest error; best; 3.000; 0.110; 0.055"));
}

TEST(Statements, SayWhichPresetIsBeatenAndByWhat) {
  const auto rows = measures({ours("fast", 0.4, 0.4, true), ours("balanced", 1.0, 0.2, true),
                              ours("balanced, half the window", 0.5, 0.1)});
  EXPECT_THAT(rows_of(preset_table(rows)),
              ElementsAre("fast; none; ; ", "balanced; balanced, half the window; -50; -50"));
}

TEST(Statements, CallNothingBeatenWithinTheMargins) {
  const auto rows = measures({ours("fast", 1.0, 0.4, true), ours("fast, as good", 0.95, 0.2),
                              ours("fast, as fast", 0.5, 0.399)});
  EXPECT_THAT(rows_of(preset_table(rows)), ElementsAre("fast; none; ; "));
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
                              ours("fast, b", 1.05, 0.4), ours("fast, c", 0.5, 0.4)});
  EXPECT_THAT(rows_of(sweep_table(rows)),
              ElementsAre("fast; a; 100; -50", "fast; b; 5; 0", "fast; c; -50; 0"));
}

TEST(Statements, AboutNothingAreEmpty) {
  EXPECT_TRUE(deadline_sentences(measures({})).empty());
  EXPECT_TRUE(choice_table(measures({peer("Demons", 1, 1)})).rows.empty());
  EXPECT_TRUE(preset_table(measures({})).rows.empty());
}

}  // namespace
}  // namespace palpate::studies
