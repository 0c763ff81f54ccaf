#include "tests/lab/report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/lab/tests/report/xml_check.h"

namespace palpate::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Chart small_chart() {
  Chart chart;
  chart.title = "Error & time";
  chart.x = {"Time (s)", true, {}, {}};
  chart.y = {"Error (voxels)", false, {}, {}};
  chart.series = {{"ours", {{0.5, 0.16, "fast <1>", true}, {2.0, 0.11, "best", true}}, {}, {}, {}},
                  {"theirs \"x\" \\n", {{10.0, 0.23, "Demons", false}}, {}, {}, {}}};
  return chart;
}

HeatMap small_map() {
  HeatMap map;
  map.title = "A map";
  map.x = {"Shift (mm)", true, {}, {}};
  map.y = {"Noise (%)", false, {}, {}};
  map.x_values = {1, 2, 4};
  map.y_values = {0, 10};
  map.values = {0.1, 0.2, 0.3, 0.4, std::nan(""), 0.6};
  map.bar = {"Error (voxels)", false, {}, {}};
  map.borders = {{"theory", {{1.0, 0.0}, {3.0, 10.0}}}};
  map.marks = {{"flagged", CellMark::kHatch, {{2, 1}}}, {"folds", CellMark::kDot, {{0, 0}}}};
  return map;
}

class Charts : public testing::Test {
 protected:
  static std::string svg_of(const auto& plot, const std::string& id = "figure") {
    const auto svg = drawn(plot, id);
    EXPECT_TRUE(svg) << svg.error().message;
    return svg ? *svg : "";
  }
};

TEST_F(Charts, AreWellFormedAndHoldEveryNameOnce) {
  const std::string svg = svg_of(small_chart());
  EXPECT_EQ(test::xml_trouble(svg), "");
  EXPECT_TRUE(svg.starts_with("<svg"));
  // The tool tip, and the label beside the mark.
  EXPECT_EQ(test::count_of("fast &lt;1", svg), 2U);
  EXPECT_EQ(test::count_of("Demons", svg), 1U);
  EXPECT_THAT(svg, HasSubstr("<title>Error &amp; time</title>"));
  EXPECT_THAT(svg, HasSubstr("theirs"));
  EXPECT_THAT(svg, HasSubstr("Error (voxels)"));
}

TEST_F(Charts, NeedNoScriptAndNothingFromOutside) {
  const std::string svg = svg_of(small_chart());
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, Not(HasSubstr("onmouse")));
  EXPECT_THAT(svg, Not(HasSubstr("href='http")));
}

TEST_F(Charts, ShareNoIdWithAnotherFigureOfThePage) {
  const std::string page =
      "<page>" + svg_of(small_chart(), "one") + svg_of(small_chart(), "two") + "</page>";
  // xmllint does not report equal ids; gnuplot's first mark is tested for all of them.
  EXPECT_EQ(test::count_of("id='one-gpPt0'", page), 1U);
  EXPECT_EQ(test::count_of("id='two-gpPt0'", page), 1U);
  EXPECT_EQ(test::count_of("id='gpPt", page), 0U);
  EXPECT_EQ(test::count_of("href='#gpPt", page), 0U);
  EXPECT_EQ(test::xml_trouble(page), "");
}

TEST_F(Charts, LeaveOutWhatALogarithmCanNotShow) {
  Chart chart = small_chart();
  chart.series[0].points.push_back({0.0, 0.1, "at zero", true});
  chart.series[0].points.push_back({std::nan(""), 0.1, "nowhere", true});
  const std::string svg = svg_of(chart);
  EXPECT_THAT(svg, Not(HasSubstr("at zero")));
  EXPECT_THAT(svg, Not(HasSubstr("nowhere")));
}

TEST_F(Charts, WithNothingToShowAreRefused) {
  Chart chart = small_chart();
  chart.series = {{"empty", {{-1.0, 1.0, "", false}}, {}, {}, {}}};
  const auto svg = drawn(chart);
  ASSERT_FALSE(svg);
  EXPECT_THAT(svg.error().message, HasSubstr("'Error & time' has no value that can be shown"));
}

TEST_F(Charts, SayWhatToInstallWhereGnuplotIsMissing) {
  const std::string path = std::getenv("PATH") ? std::getenv("PATH") : "";
  ::setenv("PATH", "/nonexistent", 1);
  const auto svg = drawn(small_chart());
  ::setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(svg);
  EXPECT_EQ(svg.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(svg.error().message, HasSubstr("apt-get install gnuplot-nox"));
}

TEST_F(Charts, OfMapsAreWellFormedAndSayEveryCell) {
  const std::string svg = svg_of(small_map());
  EXPECT_EQ(test::xml_trouble(svg), "");
  EXPECT_THAT(svg, HasSubstr("Shift (mm): 4\nNoise (%): 10\nError (voxels): 0.6"));
  EXPECT_THAT(svg, HasSubstr("Shift (mm): 2\nNoise (%): 10\nError (voxels): not measured"));
  for (const char* name : {"theory", "flagged", "folds", "not measured"})
    EXPECT_THAT(svg, HasSubstr(std::string(name) + "</text>"));
}

TEST_F(Charts, OfMapsHaveTheirOwnWordsAtTheirCells) {
  HeatMap map = small_map();
  map.x.ticks = {{1, "none"}, {2, "loose <grip"}, {4, "firm"}};
  const std::string svg = svg_of(map);
  EXPECT_EQ(test::xml_trouble(svg), "");
  for (const char* word : {"none", "loose &lt;grip", "firm"})
    EXPECT_THAT(svg, HasSubstr(std::string(word) + "</text>"));
  EXPECT_THAT(svg, HasSubstr("Shift (mm): firm\nNoise (%): 10\nError (voxels): 0.6"));
  // The other axis has its numbers.
  EXPECT_THAT(svg, HasSubstr("> 5</text>"));
}

TEST_F(Charts, OfMapsThatDoNotFitTogetherAreRefused) {
  HeatMap map = small_map();
  map.values.pop_back();
  EXPECT_THAT(drawn(map).error().message, HasSubstr("5 values for 3 x 2 cells"));
  map = small_map();
  map.x_values[0] = 0.0;
  EXPECT_THAT(drawn(map).error().message, HasSubstr("not above zero"));
  map = small_map();
  map.y_values = {10, 10};
  EXPECT_THAT(drawn(map).error().message, HasSubstr("do not rise"));
  map = small_map();
  map.marks[0].cells = {{3, 0}};
  EXPECT_THAT(drawn(map).error().message, HasSubstr("marked cell (3, 0)"));
}

}  // namespace
}  // namespace palpate::report
