#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "integration/charts/page.h"
#include "tests/charts/picture_file.h"

namespace palpate::charts {
namespace {

// The place on the page, relative to the middle of its panel, of a point that is 10 mm away in a
// direction.
glm::dvec2 page_step(View view, glm::dvec3 mm) {
  Panel panel;
  panel.view = view;
  panel.size_px = {200, 200};
  panel.px_per_mm = 2.0;
  return panel.px_at(mm) - panel.px_at(glm::dvec3(0.0));
}

TEST(Views, PutTheLetterWhereTheDirectionPoints) {
  const auto letter_of = [](glm::dvec3 lps) {
    if (lps.x != 0) return lps.x > 0 ? "L" : "R";
    if (lps.y != 0) return lps.y > 0 ? "P" : "A";
    return lps.z > 0 ? "S" : "I";
  };
  for (const View view : kViews) {
    const ViewAxes& axes = axes_of(view);
    EXPECT_STREQ(axes.right_letter, letter_of(axes.right));
    EXPECT_STREQ(axes.left_letter, letter_of(-axes.right));
    EXPECT_STREQ(axes.bottom_letter, letter_of(axes.down));
    EXPECT_STREQ(axes.top_letter, letter_of(-axes.down));
    EXPECT_GT(page_step(view, 10.0 * axes.right).x, 0.0);
    EXPECT_GT(page_step(view, 10.0 * axes.down).y, 0.0);
  }
}

TEST(Panel, ReturnsToThePixelItCameFrom) {
  Panel panel;
  panel.corner_px = {31, 47};
  panel.size_px = {211, 97};
  panel.px_per_mm = 1.7;
  panel.middle_lps_mm = {-80.0, 12.5, -1400.0};
  for (const View view : kViews) {
    panel.view = view;
    const glm::dvec2 px(57.25, 99.5);
    EXPECT_LT(glm::length(panel.px_at(panel.lps_at(px)) - px), 1e-9);
  }
}

TEST(Views, KeepMillimetresSquareForUnevenVoxels) {
  const Grid grid = centred_grid({10, 40, 20}, {3.0, 1.0, 2.5});
  Content content;
  Page page;
  page.box = box_of(grid);
  for (const View view : views_of(page.box)) {
    page.cells.push_back({{view, &content}});
  }
  page.columns.resize(1);
  page.wanted_width_px = 400.0;
  const Layout layout = laid_out(page);
  const glm::dvec2 expected_mm[] = {{30, 40}, {30, 50}, {40, 50}};
  ASSERT_EQ(layout.panels.size(), 3u);
  for (size_t row = 0; row < 3; ++row) {
    const glm::dvec2 mm = layout.panels[row][0].size_px / layout.px_per_mm;
    // Panels have whole pixels.
    EXPECT_NEAR(mm.x, expected_mm[row].x, 1.0 / layout.px_per_mm);
    EXPECT_NEAR(mm.y, expected_mm[row].y, 1.0 / layout.px_per_mm);
  }
}

TEST(Views, OfOneSliceAreOnlyTheOneInWhichItLies) {
  EXPECT_EQ(views_of(box_of(centred_grid({64, 64, 1}, glm::dvec3(1)))),
            std::vector<View>{View::kAxial});
  EXPECT_EQ(views_of(box_of(centred_grid({64, 1, 64}, glm::dvec3(1)))),
            std::vector<View>{View::kCoronal});
  EXPECT_EQ(views_of(box_of(centred_grid({1, 64, 64}, glm::dvec3(1)))),
            std::vector<View>{View::kSagittal});
  EXPECT_EQ(views_of(box_of(centred_grid({1, 1, 1}, glm::dvec3(1)))).size(), 3u);
}

TEST(BoundingBox, HoldsTheWholeVoxelsOfAnObliqueGrid) {
  const double c = std::cos(0.5);
  const double s = std::sin(0.5);
  const glm::dmat3 oblique(glm::dvec3(c, s, 0), glm::dvec3(-s, c, 0), glm::dvec3(0, 0, 1));
  const BoundingBox box = box_of(centred_grid({10, 10, 4}, {2.0, 2.0, 5.0}, oblique));
  EXPECT_NEAR(box.extent_mm().x, 20.0 * (c + s), 1e-9);
  EXPECT_NEAR(box.extent_mm().z, 20.0, 1e-9);
}

TEST(Layout, KeepsPanelsApartAndOnThePage) {
  const Grid grid = centred_grid({30, 40, 50}, glm::dvec3(2.0));
  Content content;
  Page page;
  page.box = box_of(grid);
  page.columns.resize(4);
  for (const View view : kViews) page.cells.push_back(std::vector<Cell>(4, {view, &content}));
  const Layout layout = laid_out(page);
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 4; ++column) {
      const Panel& panel = layout.panels[row][column];
      EXPECT_GE(panel.corner_px.x, 0.0);
      EXPECT_LE(panel.corner_px.x + panel.size_px.x, layout.width_px);
      EXPECT_LE(panel.corner_px.y + panel.size_px.y, layout.height_px);
      if (column > 0) {
        const Panel& left = layout.panels[row][column - 1];
        EXPECT_GE(panel.corner_px.x, left.corner_px.x + left.size_px.x);
      }
      if (row > 0) {
        const Panel& above = layout.panels[row - 1][column];
        EXPECT_GE(panel.corner_px.y, above.corner_px.y + above.size_px.y);
      }
    }
  }
}

TEST(PlaceOf, SaysWhichPlaneWasCut) {
  EXPECT_EQ(place_of(View::kAxial, {1, 2, -1434.5}), "z = \u22121434.5 mm");
  EXPECT_EQ(place_of(View::kCoronal, {1, 2, 3}), "y = 2.0 mm");
  EXPECT_EQ(place_of(View::kSagittal, {1, 2, 3}), "x = 1.0 mm");
}

}  // namespace
}  // namespace palpate::charts
