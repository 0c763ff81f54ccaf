#pragma once

#include <optional>
#include <string>
#include <vector>

namespace palpate::report {

/// One value of a table: as people read it, and as programs do where it is a number.
struct Cell {
  std::string text;
  std::optional<double> number;
};

/// A number with so many digits after the point.
Cell number(double value, int digits);
Cell words(std::string text);
/// What was not measured: empty for people, null for programs.
Cell nothing();

/// A column: its name for programs (snake_case, with the unit) and its heading for people.
struct Column {
  std::string key;
  std::string heading;
};

/// Rows of measurements under one heading.
struct Table {
  std::string title;
  std::string note;  ///< conditions, in sentences; may be empty
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;  ///< each as long as columns
};

/// What every measurement needs beside it to mean anything.
struct Conditions {
  std::string device, driver, commit, date;
  unsigned threads = 0;  ///< of the host
};

/// Aligned columns for a terminal.
std::string plain_text(const Table& table);
/// A heading, the note and a table.
std::string markdown(const Table& table);
/// All tables as long rows: table, row, column, value; the conditions lead as a table of their own.
std::string csv(const Conditions& conditions, const std::vector<Table>& tables);
/// {"conditions": {...}, "tables": [{"title", "note", "rows": [{key: value}]}]}.
std::string json(const Conditions& conditions, const std::vector<Table>& tables);

}  // namespace palpate::report
