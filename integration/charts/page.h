#pragma once

#include <string>
#include <vector>

#include "integration/charts/contents.h"

namespace palpate::charts {

/// A line that is read first and one that explains it.
struct Heading {
  std::string title;
  std::string subtitle;
};

/// The key to a map of colours. Ticks are at the ends and at even steps between.
struct ColorKey {
  ColorMap map = ColorMap::kMotion;
  Range range;
  std::string label;  ///< what and in which unit
};

struct Cell {
  View view = View::kAxial;
  const Content* content = nullptr;
};

struct Column {
  Heading heading;
  std::vector<ColorKey> keys;  ///< under the column; none or one
};

/// A table of panels, all on one scale, with headings around it. Rows have the same number of cells
/// as there are columns. All panels pass through one point of the patient.
struct Page {
  Heading heading;
  std::vector<Column> columns;
  /// one per row; printed vertically beside it, or horizontally if `wide_row_headings`
  std::vector<Heading> rows;
  bool wide_row_headings = false;
  std::vector<std::vector<Cell>> cells;
  std::string footnote;
  BoundingBox box;  ///< what every panel shows
  glm::dvec3 focus_lps_mm{0.0};
  double wanted_width_px = 1800;  ///< of all panels together
};

/// The panels of a page, row by row, and the size of the page. Pure arithmetic.
struct Layout {
  std::vector<std::vector<Panel>> panels;
  std::vector<double> column_x;
  std::vector<double> column_width;
  std::vector<double> row_y;
  std::vector<double> row_height;
  double px_per_mm = 1.0;
  double below_panels_y = 0;
  int width_px = 0;
  int height_px = 0;
};

Layout laid_out(const Page& page);

/// Draws the page and writes it as PNG. Errors: as Canvas::save().
Status write_page(const std::string& path, const Page& page, const Layout& layout);

}  // namespace palpate::charts
