#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tests/lab/report/table.h"

/// A report as one self-contained HTML file: style, pictures and data are in it. It is well-formed
/// XML too, so that a test can read it.
///
///   Page page;
///   page.title = "Speed against accuracy";
///   page.conditions = {{"Device", "llvmpipe"}, {"Run", "quick, 61 s"}};
///   Section section{"motion", "Motion", "In 1 s take balanced: 0.12 voxel.", {}};
///   section.parts.push_back(Figure{"Error against time", *drawn(chart, "motion"), "Lower left is
///       better.", table_of_points});
///   page.sections.push_back(section);
///   files::write_text(path, html(page));
namespace palpate::report {

/// A picture with its texts. The numbers behind it can be downloaded as CSV; empty: no link.
struct Figure {
  std::string title;
  /// One <svg> element, as drawn() returns it.
  std::string svg;
  std::string caption;
  Table data;
};

/// A table with a CSV link. folded: shown on request, as long tables should be.
struct TablePart {
  Table table;
  bool folded = false;
};

/// Plain sentences. grave: something is missing or wrong, so the note is highlighted.
struct Note {
  std::string text;
  bool grave = false;
};

using Part = std::variant<Figure, TablePart, Note>;

/// One question of the report. The answer comes first: one or a few sentences computed from the
/// measurements, never written beforehand.
struct Section {
  std::string id;  ///< letters, digits and -, unique in the page: its address
  std::string title;
  std::string answer;
  std::vector<Part> parts;
};

/// A whole report.
struct Page {
  std::string title;
  /// An introduction for readers who do not know the subject.
  std::string lead;
  std::vector<std::pair<std::string, std::string>> conditions;  ///< name, value
  std::vector<Section> sections;
};

/// The page as HTML text. Texts are plain text: & and < are escaped; an empty line begins a new
/// paragraph. Does not write, print, or allocate more than the text.
std::string html(const Page& page);

/// One table as CSV: the columns' keys, then one row of values per row; numbers in full precision.
std::string flat_csv(const Table& table);

/// "error-against-time": a text as the name of a file, in lower case letters, digits and -.
std::string file_stem(const std::string& text);

}  // namespace palpate::report
