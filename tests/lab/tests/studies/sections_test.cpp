// The parts of the report for given measurements: well-formed, with sentences that follow from the
// numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lab/studies/feel_section.h"
#include "tests/lab/studies/fit.h"
#include "tests/lab/studies/motion_section.h"
#include "tests/lab/studies/scene_study.h"
#include "tests/lab/studies/view_study.h"
#include "tests/lab/tests/report/xml_check.h"
#include "tests/lab/tests/studies/made_measures.h"
#include "tests/support/random.h"

namespace palpate::studies {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

std::string page_with(const Result<report::Section>& section) {
  EXPECT_TRUE(section) << section.error().message;
  if (!section) return "";
  report::Page page;
  page.title = "test";
  page.sections.push_back(*section);
  return report::html(page);
}

FeelMeasures made_feel() {
  FeelMeasures all;
  const auto add = [&](const char* name, const char* family, bool paper, Moves moves, double us,
                       double n, double field_mm = 1.0) {
    FeelMeasure m;
    m.setting = {name, family, paper, moves, BackTracking::kNewton, 1.0, field_mm};
    m.median_us = us;
    m.p99_us = 2.0 * us;
    m.rms_n = n;
    m.most_n = 3.0 * n;
    m.field_megabytes = 80.0 / field_mm;
    all.settings.push_back(m);
  };
  add("static", "palpate", false, Moves::kNothing, 1.0, 0.004);
  add("transforms", "palpate", false, Moves::kTransform, 1.5, 0.004);
  add("transforms and moving data", "palpate", false, Moves::kBoth, 5.0, 0.006);
  add("transforms and moving data", "the paper's loop", true, Moves::kBoth, 2.0, 0.03);
  add("field of 2 mm", "palpate, other settings", false, Moves::kBoth, 2.0, 0.0061, 2.0);
  add("field of 4 mm", "palpate, other settings", false, Moves::kBoth, 2.0, 0.02, 4.0);
  all.picard = {{1, 100.0, 0.5}, {8, 0.1, 1.0}};
  all.newton = {3, 0.0001, 0.9};
  all.loads = {{1, 1, 2.0}, {1, 2, 3.0}, {1, 4, 5.0}};
  return all;
}

TEST(FeelSection, SaysWhatTheNumbersSay) {
  const auto sentences = feel_sentences(made_feel());
  EXPECT_THAT(sentences, Contains(AllOf(HasSubstr("1 us for still data"), HasSubstr("0.5 % of"))));
  EXPECT_THAT(sentences, Contains(HasSubstr("palpate has 5 times less error")));
  EXPECT_THAT(sentences, Contains(HasSubstr("A field of 2 mm does as well as one of 1 mm")));
  EXPECT_THAT(sentences, Contains(HasSubstr("8 steps of the fixed point leave 0.1 um")));
  EXPECT_THAT(sentences, Contains("Each further mode on a moving volume adds 1 us."));
}

TEST(FeelSection, AdmitsWhenThePaperIsBetterAndWhenCoarseFieldsAreNot) {
  FeelMeasures all = made_feel();
  all.settings[3].rms_n = 0.003;
  all.settings[4].rms_n = 0.02;
  const auto sentences = feel_sentences(all);
  EXPECT_THAT(sentences, Contains(HasSubstr("palpate has 2 times more error")));
  EXPECT_THAT(sentences, Contains("No field coarser than 1 mm gives as exact a force."));
}

TEST(FeelSection, IsWellFormed) {
  EXPECT_EQ(test::xml_trouble(page_with(feel_section(made_feel()))), "");
}

std::vector<ViewMeasure> made_view() {
  return {{"sparse", "palpate, by samples per voxel", 0.5, 256, 50.0, 38.0},
          {"sparse", "palpate, by samples per voxel", 1.0, 256, 80.0, 45.0},
          {"sparse", "palpate, nothing skipped", 1.0, 256, 400.0, 45.0},
          {"sparse", "palpate, moving", 1.0, 256, 120.0, 45.0},
          {"sparse", "palpate, fewer pixels", 1.0, 128, 20.0, 45.0},
          {"sparse", "VTK", 2.0, 256, 160.0, 41.0}};
}

TEST(ViewSection, SaysWhatTheNumbersSay) {
  const auto sentences = view_sentences(made_view());
  EXPECT_THAT(sentences, Contains("The only sparse stereo picture of 256 x 256 pixels that can not "
                                  "be told from the best one (it has 45 dB) takes 80 ms."));
  EXPECT_THAT(sentences, Contains("VTK takes 0.16 s for its only one that is good enough too (41 "
                                  "dB), 2 times as long."));
  EXPECT_THAT(sentences,
              Contains("Without skipping what is empty a sparse one takes 5 times as long."));
  EXPECT_THAT(sentences, Contains("While it moves a sparse one takes 1.5 times as long."));
}

TEST(ViewSection, NamesTheFastestWhereThereAreSeveral) {
  auto measures = made_view();
  measures.push_back({"sparse", "palpate, by samples per voxel", 2.0, 256, 150.0, 49.0});
  measures.push_back({"sparse", "VTK", 1.0, 256, 240.0, 43.0});
  const auto sentences = view_sentences(measures);
  EXPECT_THAT(sentences, Contains(HasSubstr("The fastest sparse stereo picture")));
  EXPECT_THAT(sentences, Contains(HasSubstr("VTK takes 0.16 s for its fastest")));
}

TEST(ViewSection, SaysNothingOfPicturesThatAreNotGoodEnough) {
  auto measures = made_view();
  measures.erase(measures.begin() + 1, measures.end());
  EXPECT_TRUE(view_sentences(measures).empty());
}

TEST(ViewSection, IsWellFormedAndNamesWhatIsMissing) {
  auto measures = made_view();
  for (ViewMeasure m : made_view()) {
    m.look = "dense";
    measures.push_back(m);
  }
  const std::string page = page_with(view_section(measures, {"VTK was not measured: <no>."}));
  EXPECT_EQ(test::xml_trouble(page), "");
  EXPECT_THAT(page, HasSubstr("VTK was not measured: &lt;no&gt;."));
}

SceneMeasures made_scene() {
  SceneMeasures all;
  for (int volumes = 1; volumes <= 4; ++volumes) {
    all.felt.push_back({volumes, Moves::kNothing, 1.0 + 0.5 * (volumes - 1)});
    all.felt.push_back({volumes, Moves::kTransform, 1.2 + 0.5 * (volumes - 1)});
    all.felt.push_back({volumes, Moves::kBoth, 2.0 + 1.5 * (volumes - 1)});
  }
  all.regions = {{1.0, 2.0, 0.3, 1000.0}, {0.1, 0.6, 0.3, 200.0}, {0.01, 0.2, 0.3, 50.0}};
  all.moving_s = 2.0;
  all.still_s = 0.5;
  return all;
}

TEST(SceneSection, SaysWhatTheNumbersSay) {
  const auto sentences = scene_sentences(made_scene());
  EXPECT_THAT(
      sentences,
      Contains(
          "On the wall of a heart a still volume costs the hand 1 us; a moving transform adds 0.2 "
          "us, and moving data another 0.8 us."));
  EXPECT_THAT(sentences, Contains("Each further volume (still) adds 0.5 us."));
  EXPECT_THAT(sentences, Contains(HasSubstr("Where only 1 % of the volume counts, the iterations "
                                            "take 10 % of the time of the whole")));
  EXPECT_THAT(sentences, Contains(HasSubstr("for 5 % of its bricks")));
  EXPECT_THAT(sentences, Contains("A pair in which nothing moves is solved in 25 % of the time of "
                                  "one that does."));
}

TEST(SceneSection, IsWellFormed) {
  EXPECT_EQ(test::xml_trouble(page_with(scene_section(made_scene()))), "");
}

TEST(MotionSection, IsWellFormedAndMarksWhatFolds) {
  auto rows =
      test::measures({test::ours("fast", 0.4, 0.4, true), test::ours("best", 3.0, 0.1, true),
                      test::ours("best, a", 2.0, 0.3), test::peer("Demons", 5.0, 0.9)});
  const std::string without = page_with(motion_section({rows}));
  EXPECT_EQ(test::xml_trouble(without), "");
  EXPECT_THAT(without, Not(HasSubstr("has folds")));
  EXPECT_THAT(without, HasSubstr("s front"));
  rows.rows[3].folded = 5;
  rows.rows[2].there_and_back_mm = 5.0;
  const std::string with = page_with(motion_section({rows}));
  EXPECT_THAT(with, HasSubstr("has folds"));
  EXPECT_THAT(with, HasSubstr("inverse consistency over 0.5 voxel"));
}

TEST(MotionSection, DrawsWhatConfidenceIsWorthWhereItIsKnown) {
  auto rows = test::measures({test::ours("fast", 0.4, 0.4, true), test::peer("Demons", 5.0, 0.9)});
  EXPECT_THAT(page_with(motion_section({rows})), Not(HasSubstr("Calibration of confidence")));
  Reliability reliability;
  for (int n = 0; n < 1000; ++n) reliability.add(0.05 + 0.1 * (n % 10), n % 10 >= 5);
  rows.rows[0].reliability = reliability;
  const std::string with = page_with(motion_section({rows}));
  EXPECT_EQ(test::xml_trouble(with), "");
  EXPECT_THAT(with, HasSubstr("Calibration of confidence: a synthetic pair"));
  // |0.05 to 0.45 - 0| and |0.55 to 0.95 - 1| are 0.25 on average.
  EXPECT_THAT(with, HasSubstr("fast (off by 0.250)"));
}

TEST(LineThrough, FindsTheLineThatMadeThePoints) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    test::Random random(seed);
    const double base = random.draw(-5, 5), slope = random.draw(-5, 5);
    std::vector<std::pair<double, double>> points;
    for (int n = 0; n < 5; ++n) points.emplace_back(n, base + slope * n);
    const Line line = line_through(points);
    // Rounding of a few sums of numbers below 100.
    EXPECT_NEAR(line.slope, slope, 1e-12) << "seed " << seed;
    EXPECT_NEAR(line.base, base, 1e-12) << "seed " << seed;
  }
  EXPECT_EQ(line_through({}).slope, 0.0);
  EXPECT_EQ(line_through({{2.0, 3.0}, {2.0, 5.0}}).base, 4.0);
}

}  // namespace
}  // namespace palpate::studies
