#include "integration/app/choice/motion_front.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lab/tests/studies/made_measures.h"
#include "tests/support/random.h"

namespace palpate::studies {
namespace {

using test::ours;
using test::peer;
using testing::HasSubstr;

app::MotionFront small_front() {
  return front_of(
      test::measures({ours("fast", 0.5, 0.4, true), ours("balanced", 1.0, 0.2, true),
                      ours("best", 3.0, 0.1, true), ours("balanced, half the window", 2.0, 0.3)}),
      "a device", "palpate 1");
}

TEST(MotionFront, HoldsWhatNothingOfPalpateBeats) {
  const app::MotionFront front = small_front();
  ASSERT_EQ(front.points.size(), 3U);
  EXPECT_EQ(front.points[0].setting, "fast");
  EXPECT_EQ(front.points[2].setting, "best");
  // 0.2 mm of 2 mm.
  EXPECT_DOUBLE_EQ(front.points[1].error_voxels, 0.1);
}

TEST(MotionFront, LeavesOutPeersFoldsAndWhatIsNotCareful) {
  auto rows = test::measures({peer("Demons", 0.1, 0.01), ours("fast", 0.5, 0.4, true),
                              ours("folding", 0.1, 0.1), ours("risky", 0.1, 0.1)});
  rows.rows[2].folded = 1;
  rows.rows[3].careful = false;
  const app::MotionFront front = front_of(rows, "d", "v");
  ASSERT_EQ(front.points.size(), 1U);
  EXPECT_EQ(front.points[0].setting, "fast");
}

TEST(MotionFront, IsReadBackAsWritten) {
  const app::MotionFront front = small_front();
  const auto read = app::parse_front(app::front_text(front));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(app::front_text(*read), app::front_text(front));
}

TEST(MotionFront, ThatIsBrokenSaysWhatToRun) {
  std::vector<std::string> texts = {"", "[]", "{", "{\"device\": 3}"};
  app::MotionFront front = small_front();
  front.points.clear();
  texts.push_back(app::front_text(front));
  front = small_front();
  front.voxels = 0;
  texts.push_back(app::front_text(front));
  front = small_front();
  front.points[0].seconds = -1.0;
  texts.push_back(app::front_text(front));
  for (const std::string& text : texts) {
    const auto read = app::parse_front(text);
    ASSERT_FALSE(read) << text;
    EXPECT_THAT(read.error().message, HasSubstr("palpate chart motion"));
  }
}

TEST(ChoosingByTime, TakesTheMostAccurateThatFits) {
  const app::MotionFront front = small_front();
  EXPECT_EQ(app::choose_within(front, 1.5, 1000000, 2.0)->setting.name, "balanced");
  EXPECT_EQ(app::choose_within(front, 100.0, 1000000, 2.0)->setting.name, "best");
  // Twice the voxels take twice the time.
  EXPECT_EQ(app::choose_within(front, 1.5, 2000000, 2.0)->setting.name, "fast");
  const auto choice = app::choose_within(front, 1.5, 1000000, 1.0);
  EXPECT_DOUBLE_EQ(choice->expected_error_mm, 0.1);
  EXPECT_THAT(choice->why, HasSubstr("balanced for at most 1.5 s: about 1 s a pair and 0.1 mm"));
}

TEST(ChoosingByTime, SaysHowLongTheFastestTakesWhereNothingFits) {
  const auto choice = app::choose_within(small_front(), 0.1, 1000000, 2.0);
  ASSERT_FALSE(choice);
  EXPECT_EQ(choice.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(choice.error().message, HasSubstr("the fastest, fast, takes about 0.5 s"));
}

TEST(ChoosingByError, TakesTheFastestThatIsGoodEnough) {
  const app::MotionFront front = small_front();
  EXPECT_EQ(app::choose_by_error(front, 0.25, 1000000, 2.0)->front().setting.name, "balanced");
  EXPECT_EQ(app::choose_by_error(front, 1.0, 1000000, 2.0)->front().setting.name, "fast");
  // Finer voxels, smaller errors in mm.
  EXPECT_EQ(app::choose_by_error(front, 0.25, 1000000, 1.0)->front().setting.name, "fast");
  const auto none = app::choose_by_error(front, 0.05, 1000000, 2.0);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("best, is wrong by about 0.1 mm"));
}

TEST(ChoosingByError, NamesTheBetterOnesToo) {
  const auto choices = app::choose_by_error(small_front(), 0.25, 1000000, 2.0);
  ASSERT_TRUE(choices);
  ASSERT_EQ(choices->size(), 2U);
  EXPECT_EQ((*choices)[1].setting.name, "best");
  EXPECT_LT((*choices)[1].expected_error_mm, (*choices)[0].expected_error_mm);
}

TEST(ChoosingByError, NamesASettingThatThisVersionLacks) {
  app::MotionFront front = small_front();
  front.points[0].setting = "of another time";
  const auto choice = app::choose_by_error(front, 10.0, 1000000, 2.0);
  ASSERT_FALSE(choice);
  EXPECT_THAT(choice.error().message, HasSubstr("'of another time'"));
}

TEST(Choosing, NeverTakesWhatAnotherSettingBeatsInBoth) {
  const auto settings = app::motion_settings(false);
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    test::Random random(seed);
    std::vector<MotionMeasure> rows;
    for (size_t n = 0; n < 12; ++n)
      rows.push_back(ours(settings[n].name, random.draw(0.1, 5.0), random.draw(0.1, 2.0)));
    const app::MotionFront front = front_of(test::measures(rows), "d", "v");
    const double limit_s = random.draw(0.1, 5.0), limit_mm = random.draw(0.1, 2.0);
    const auto soon = app::choose_within(front, limit_s, 1000000, 2.0);
    const auto good = app::choose_by_error(front, limit_mm, 1000000, 2.0);
    double least_mm = 1e9, least_s = 1e9;
    for (const MotionMeasure& row : rows) {
      if (row.seconds <= limit_s) least_mm = std::min(least_mm, row.error_mm);
      if (row.error_mm <= limit_mm) least_s = std::min(least_s, row.seconds);
    }
    EXPECT_EQ(bool(soon), least_mm < 1e9) << "seed " << seed;
    EXPECT_EQ(bool(good), least_s < 1e9) << "seed " << seed;
    if (soon) {
      EXPECT_NEAR(soon->expected_error_mm, least_mm, 1e-9) << "seed " << seed;
    }
    if (good) {
      EXPECT_NEAR(good->front().expected_s, least_s, 1e-9) << "seed " << seed;
    }
  }
}

TEST(MotionSettings, HaveNamesOfTheirOwnAndAreFoundByThem) {
  const auto all = app::motion_settings(false);
  for (size_t n = 0; n < all.size(); ++n) {
    const auto found = app::motion_setting(all[n].name);
    ASSERT_TRUE(found) << all[n].name;
    EXPECT_EQ(found->sweep, all[n].sweep);
    for (size_t m = 0; m < n; ++m) EXPECT_NE(all[n].name, all[m].name);
  }
  EXPECT_FALSE(app::motion_setting("none of these"));
  for (const app::MotionSetting& setting : app::motion_settings(true))
    EXPECT_TRUE(app::motion_setting(setting.name));
}

TEST(MotionSettings, AreCarefulOnlyWithNormalisationAndTheStartForLargeMotion) {
  EXPECT_TRUE(app::motion_setting("balanced")->careful);
  EXPECT_TRUE(app::motion_setting("fast, half the iterations")->careful);
  for (const char* name :
       {"classic", "balanced, raw intensities", "balanced, no discrete start", "balanced, 1 level"})
    EXPECT_FALSE(app::motion_setting(name)->careful) << name;
}

}  // namespace
}  // namespace palpate::studies
