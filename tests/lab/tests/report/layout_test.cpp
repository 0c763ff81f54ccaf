#include <gtest/gtest.h>

#include <cmath>

#include "tests/lab/report/axes.h"
#include "tests/lab/report/labels.h"
#include "tests/lab/report/style.h"
#include "tests/support/random.h"

namespace palpate::report {
namespace {

TEST(Span, HoldsAllThatCanBeShown) {
  for (uint32_t seed = 1; seed <= 300; ++seed) {
    test::Random random(seed);
    const bool logarithmic = seed % 2;
    std::vector<double> values;
    for (int n = 0; n < 1 + int(seed % 7); ++n) {
      const double value = random.draw(-5.0, 5.0);
      values.push_back(logarithmic ? std::pow(10.0, value) : value);
    }
    const Span span = span_of({"", logarithmic, {}, {}}, values);
    for (const double value : values) {
      EXPECT_GE(span.place(value), 0.0) << "seed " << seed << ", value " << value;
      EXPECT_LE(span.place(value), 1.0) << "seed " << seed << ", value " << value;
    }
  }
}

TEST(Span, OfNothingOrOfOneValueIsNotEmpty) {
  for (const bool logarithmic : {false, true}) {
    for (const std::vector<double>& values :
         {std::vector<double>{}, {0.0}, {3.0}, {std::nan("")}}) {
      const Span span = span_of({"", logarithmic, {}, {}}, values);
      EXPECT_GT(span.high, span.low);
      EXPECT_TRUE(!logarithmic || span.low > 0.0);
    }
  }
}

TEST(Span, ShowsZeroWhereItIsNear) {
  EXPECT_EQ(span_of({"", false, {}, {}}, {0.11, 0.25}).low, 0.0);
  EXPECT_GT(span_of({"", false, {}, {}}, {100.0, 101.0}).low, 90.0);
}

TEST(Labels, CoverNoMarkAndNoOtherLabel) {
  for (uint32_t seed = 1; seed <= 100; ++seed) {
    test::Random random(seed);
    std::vector<Tag> tags;
    for (int n = 0; n < 30; ++n)
      tags.push_back({random.draw(50, 450), random.draw(50, 350), n % 2 ? "" : "a name"});
    const double wide = text_width_px("a name");
    const auto placed = placed_labels(tags, 40, 460, 40, 360);
    for (size_t a = 0; a < placed.size(); ++a) {
      for (const Tag& tag : tags) {
        EXPECT_FALSE(tag.x > placed[a].x && tag.x < placed[a].x + wide && tag.y > placed[a].y &&
                     tag.y < placed[a].y + kFontPx)
            << "seed " << seed;
      }
      for (size_t b = 0; b < a; ++b) {
        EXPECT_TRUE(std::abs(placed[a].x - placed[b].x) >= wide ||
                    std::abs(placed[a].y - placed[b].y) >= kFontPx)
            << "seed " << seed;
      }
    }
  }
}

TEST(Labels, AreLeftOutRatherThanCrowded) {
  const std::vector<Tag> tags(40, {100, 100, "the same place"});
  EXPECT_LE(placed_labels(tags, 0, 200, 0, 200).size(), 8U);
  EXPECT_GE(placed_labels(tags, 0, 200, 0, 200).size(), 1U);
}

}  // namespace
}  // namespace palpate::report
