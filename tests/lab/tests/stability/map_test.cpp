// The sentences of a map, for cells that are given by hand.
#include "tests/lab/stability/map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "tests/lab/stability/map_report.h"

namespace palpate::stability {
namespace {

using ::testing::HasSubstr;

/// 3 x 2 cells: palpate holds two columns and flags the third; the other method holds one column.
StabilityMap small_map() {
  StabilityMap map;
  map.group = "loop";
  map.name = "made-up";
  map.title = "Made up";
  map.x = {"speed", "m/s", {1.0, 2.0, 3.0}, false, {}};
  map.y = {"size", "", {0.1, 0.2}, false, {}};
  map.colour = "error";
  map.colour_unit = "mm";
  map.borders = {{"speed = 2", {{2.0, 0.0}, {2.0, 1.0}}}};
  map.sides = {{"the old way", "", {}}, {"palpate", "stops with a word", {}}};
  fill(map, {}, [](size_t side, double x, double y) {
    Cell cell{x + y, Outcome::kHeld};
    if (side == 1 && x > 2.5) cell.outcome = Outcome::kFlagged;
    if (side == 0 && x > 1.5) cell.outcome = Outcome::kSilent;
    return cell;
  });
  return map;
}

TEST(StabilityMap, SaysWhatItsCellsSay) {
  EXPECT_EQ(meaning(small_map()),
            "Palpate holds in 4 of 6 cells, in every one up to 2 m/s (speed); in 2 it stops with a "
            "word; in none it fails unseen. The old way holds in 2 of 6 cells, in every one up to "
            "1 m/s (speed); in 4 it fails unseen.");
  StabilityMap map = small_map();
  for (Cell& cell : map.sides[1].cells) cell.outcome = Outcome::kHeld;
  EXPECT_THAT(meaning(map), HasSubstr("Palpate holds in all 6 cells."));
  map.sides[1].cells[0].outcome = Outcome::kSilent;
  EXPECT_THAT(meaning(map), HasSubstr("Palpate holds in 5 of 6 cells; in 1 it fails unseen."));
}

TEST(StabilityMap, NamesItsValuesForPeople) {
  const Axis axis = log_axis("stiffness", "N/m", 200.0, 8000.0, 5);
  EXPECT_EQ(value_text(axis, 1), "503");
  EXPECT_EQ(value_text(axis, 3), "3180");
  EXPECT_EQ(value_text({"hand", "", {0.0, 1.0}, false, {"none", "loose"}}, 1), "loose");
}

TEST(StabilityMap, CountsEveryCellOnce) {
  const StabilityMap map = small_map();
  const Tally ours = tally(map.sides[1]), other = tally(map.sides[0]);
  EXPECT_EQ(ours.held, 4);
  EXPECT_EQ(ours.flagged, 2);
  EXPECT_EQ(ours.silent, 0);
  EXPECT_EQ(other.silent, 4);
  EXPECT_EQ(ours.all(), 6);
  EXPECT_THAT(
      whole_meaning({map, map}),
      HasSubstr("In 2 maps palpate holds in 8 of 12 cells, fails and says so in 4, and fails "
                "unseen in 0."));
}

TEST(StabilityMap, IsTheSameOnAnyNumberOfThreads) {
  StabilityMap one = small_map(), four = small_map();
  const auto cell = [](size_t side, double x, double y) {
    return Cell{double(cell_seed(7, x, y)) + double(side), Outcome::kHeld};
  };
  Making making;
  fill(one, making, cell);
  making.threads = 4;
  std::atomic<int> told{0};
  making.progress = [&](double share) {
    EXPECT_GT(share, 0.0);
    EXPECT_LE(share, 1.0);
    ++told;
  };
  fill(four, making, cell);
  for (size_t s = 0; s < 2; ++s)
    for (size_t c = 0; c < 6; ++c)
      EXPECT_EQ(one.sides[s].cells[c].value, four.sides[s].cells[c].value) << s << " " << c;
  EXPECT_EQ(told, 12);
}

TEST(StabilityMap, PassesOnWhatACellThrows) {
  StabilityMap map = small_map();
  Making making;
  making.threads = 3;
  EXPECT_THROW(fill(map, making,
                    [](size_t, double x, double) -> Cell {
                      if (x > 2.5) throw std::runtime_error("no device");
                      return {};
                    }),
               std::runtime_error);
}

TEST(StabilityMap, StopsWhenItIsAskedTo) {
  StabilityMap map = small_map();
  std::stop_source stop;
  Making making;
  making.stop = stop.get_token();
  int made = 0;
  fill(map, making, [&](size_t, double, double) {
    if (++made == 3) stop.request_stop();
    return Cell{};
  });
  EXPECT_EQ(made, 3);
}

TEST(StabilityMap, IsATableWithARowForEveryCell) {
  const std::string text = csv(small_map());
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 13);
  EXPECT_THAT(text, HasSubstr("method,speed,size,error,outcome\n"));
  EXPECT_THAT(text, HasSubstr("the old way,3,0.2,3.2,failed unseen\n"));
  EXPECT_THAT(text, HasSubstr("palpate,3,0.1,3.1,failed and said so\n"));
}

TEST(StabilityMap, DrawsEveryMethodWithItsMarksAndTheBorder) {
  const auto section = section_of(small_map());
  ASSERT_TRUE(section) << section.error().message;
  EXPECT_EQ(section->answer, meaning(small_map()));
  ASSERT_EQ(section->parts.size(), 1U);
  const auto& figure = std::get<report::Figure>(section->parts[0]);
  EXPECT_THAT(figure.svg, HasSubstr(">the old way</text>"));
  EXPECT_THAT(figure.svg, HasSubstr(">palpate</text>"));
  EXPECT_THAT(figure.svg, HasSubstr("theory: speed = 2"));
  EXPECT_EQ(figure.data.rows.size(), 12U);
}

TEST(Border, GoesAlongTheWholeMapAndBeyond) {
  const Axis even = even_axis("q", "", 1.0, 3.0, 5), log = log_axis("size", "mm", 1.0, 100.0, 3);
  EXPECT_EQ(even.at, (std::vector{1.0, 1.5, 2.0, 2.5, 3.0}));
  EXPECT_FALSE(even.logarithmic);
  EXPECT_TRUE(log.logarithmic);
  ASSERT_EQ(log.at.size(), 3U);
  EXPECT_NEAR(log.at[1], 10.0, 1e-12);  // rounding of a power
  for (const Border& border : {border_at_x("x = 2", 2.0, log), border_at_y("y = 2", 2.0, even)}) {
    const bool at_x = border.name == "x = 2";
    const Axis& along = at_x ? log : even;
    ASSERT_EQ(border.points.size(), 2U);
    for (const glm::dvec2 point : border.points) EXPECT_EQ(at_x ? point.x : point.y, 2.0);
    EXPECT_LT(at_x ? border.points[0].y : border.points[0].x, along.at.front());
    EXPECT_GT(at_x ? border.points[1].y : border.points[1].x, along.at.back());
    // A logarithmic axis has no values below zero.
    if (at_x) {
      EXPECT_GT(border.points[0].y, 0.0);
    }
  }
  const Border curve = border_along_x("y = x^2", {1.0, 3.0}, [](double x) { return x * x; });
  EXPECT_EQ(curve.points, (std::vector<glm::dvec2>{{1.0, 1.0}, {3.0, 9.0}}));
}

TEST(CellSeed, DiffersFromCellToCellAndNotFromRunToRun) {
  EXPECT_EQ(cell_seed(1, 0.5, 2.0), cell_seed(1, 0.5, 2.0));
  EXPECT_NE(cell_seed(1, 0.5, 2.0), cell_seed(2, 0.5, 2.0));
  EXPECT_NE(cell_seed(1, 0.5, 2.0), cell_seed(1, 2.0, 0.5));
  EXPECT_NE(cell_seed(1, 0.5, 2.0), cell_seed(1, 0.5, 2.1));
}

}  // namespace
}  // namespace palpate::stability
