#include "tests/lab/report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

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
                  {"theirs \"x\" $a_b$", {{10.0, 0.23, "Demons", false}}, {}, {}, {}}};
  return chart;
}

HeatMap small_map() {
  HeatMap map;
  map.title = "A map";
  map.x = {"Shift (mm)", true, {}, {}};
  map.y = {"Noise (%)", false, {}, {}};
  map.x_values = {1, 2, 4};
  map.y_values = {0, 10};
  map.bar = {"Error (voxels)", false, {}, {}};
  map.borders = {{"theory", {{1.0, 0.0}, {3.0, 10.0}}}};
  map.panels = {
      {"ours <1>",
       {0.1, 0.2, 0.3, 0.4, std::nan(""), 0.6},
       {{"flagged", CellMark::kHatch, {{2, 1}}}, {"folds", CellMark::kDot, {{0, 0}}}}},
      {"theirs", {0.1, 0.2, 0.3, 0.4, 0.5, 0.7}, {{"flagged", CellMark::kCross, {{1, 1}}}}}};
  return map;
}

std::string svg_of(const auto& plot, const std::string& id = "figure") {
  const auto svg = drawn(plot, id);
  EXPECT_TRUE(svg) << svg.error().message;
  return svg ? *svg : "";
}

/// All ids in a picture.
std::vector<std::string> ids_in(const std::string& svg) {
  std::vector<std::string> ids;
  for (size_t at = svg.find(" id=\""); at != std::string::npos; at = svg.find(" id=\"", at + 1))
    ids.push_back(svg.substr(at + 5, svg.find('"', at + 5) - at - 5));
  return ids;
}

TEST(Charts, AreWellFormedAndHoldEveryNameOnce) {
  const std::string svg = svg_of(small_chart());
  EXPECT_EQ(test::xml_trouble(svg), "");
  EXPECT_TRUE(svg.starts_with("<svg"));
  // The tool tip, and the label beside the mark.
  EXPECT_EQ(test::count_of("fast &lt;1", svg), 2U);
  EXPECT_EQ(test::count_of("Demons", svg), 1U);
  EXPECT_THAT(svg, HasSubstr("<title>Error &amp; time</title>"));
  EXPECT_THAT(svg, HasSubstr(">theirs \"x\" $a_b$</text>"));
  EXPECT_THAT(svg, HasSubstr("Error (voxels)"));
  // Nothing from outside, and nothing that runs or styles the page around it.
  for (const char* piece : {"<script", "onmouse", "href=\"http", "<style", "<metadata"})
    EXPECT_THAT(svg, Not(HasSubstr(piece)));
}

TEST(Charts, ShareNoIdWithAnotherFigureOfThePage) {
  std::vector<std::string> ids = ids_in(svg_of(small_chart(), "one"));
  const std::vector<std::string> others = ids_in(svg_of(small_chart(), "two"));
  EXPECT_FALSE(ids.empty());
  ids.insert(ids.end(), others.begin(), others.end());
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), ids.size());
}

TEST(Charts, LeaveOutWhatALogarithmCanNotShow) {
  Chart chart = small_chart();
  chart.series[0].points.push_back({0.0, 0.1, "at zero", true});
  chart.series[0].points.push_back({std::nan(""), 0.1, "nowhere", true});
  const std::string svg = svg_of(chart);
  EXPECT_THAT(svg, Not(HasSubstr("at zero")));
  EXPECT_THAT(svg, Not(HasSubstr("nowhere")));
}

TEST(Charts, WithNothingToShowAreRefused) {
  Chart chart = small_chart();
  chart.series = {{"empty", {{-1.0, 1.0, "", false}}, {}, {}, {}}};
  const auto svg = drawn(chart);
  ASSERT_FALSE(svg);
  EXPECT_THAT(svg.error().message, HasSubstr("'Error & time' has no value that can be shown"));
}

TEST(Charts, HaveAPictureBehindInOneScale) {
  Chart chart = small_chart();
  chart.x = {"Left (mm)", false, 0.0, 40.0};
  chart.y = {"Up (mm)", false, 0.0, 20.0};
  EXPECT_THAT(svg_of(chart), Not(HasSubstr("<image")));
  // Twice as wide as high, in a frame of another form.
  chart.behind =
      Backdrop{0.0, 40.0, 0.0, 20.0, 4, {0.0, 0.3, 0.6, 1.0, 0.2, std::nan(""), 0.4, 0.5}};
  const std::string svg = svg_of(chart);
  EXPECT_EQ(test::xml_trouble(svg), "");
  const size_t image = svg.find("<image");
  ASSERT_NE(image, std::string::npos);
  const auto length = [&](const std::string& name) {
    return std::stod(svg.substr(svg.find(" " + name + "=\"", image) + name.size() + 3));
  };
  // In whole pixels.
  EXPECT_NEAR(length("width"), 2.0 * length("height"), 3.0);
  chart.behind->values.pop_back();
  const auto refused = drawn(chart);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("a picture of 7 values in rows of 4"));
}

TEST(Charts, OfMapsAreWellFormedAndSayEveryCell) {
  HeatMap map = small_map();
  map.x.ticks = {{1, "none"}, {2, "loose <grip"}, {4, "firm"}};
  const std::string svg = svg_of(map);
  EXPECT_EQ(test::xml_trouble(svg), "");
  EXPECT_THAT(svg, HasSubstr("Shift (mm): firm\nNoise (%): 10\nError (voxels): 0.6<"));
  EXPECT_THAT(svg, HasSubstr("Shift (mm): firm\nNoise (%): 10\nError (voxels): 0.7<"));
  EXPECT_EQ(test::count_of("Error (voxels): not measured", svg), 1U);
  // Each key entry stands there once for all panels; words at the cells stand under each.
  for (const char* name : {"theory", "flagged", "folds", "not measured", "ours &lt;1&gt;"})
    EXPECT_EQ(test::count_of(std::string(">") + name + "</text>", svg), 1U) << name;
  for (const char* word : {"none", "loose &lt;grip", "firm"})
    EXPECT_EQ(test::count_of(std::string(">") + word + "</text>", svg), 2U) << word;
  // The other axis has its numbers.
  EXPECT_THAT(svg, HasSubstr(">5</text>"));
}

TEST(Charts, OfMapsThatDoNotFitTogetherAreRefused) {
  HeatMap map = small_map();
  map.panels[0].values.pop_back();
  EXPECT_THAT(drawn(map).error().message, HasSubstr("5 values for 3 x 2 cells"));
  map = small_map();
  map.x_values[0] = 0.0;
  EXPECT_THAT(drawn(map).error().message, HasSubstr("not above zero"));
  map = small_map();
  map.y_values = {10, 10};
  EXPECT_THAT(drawn(map).error().message, HasSubstr("do not rise"));
  map = small_map();
  map.panels[0].marks[0].cells = {{3, 0}};
  EXPECT_THAT(drawn(map).error().message, HasSubstr("marked cell (3, 0)"));
}

}  // namespace
}  // namespace palpate::report
