#pragma once

#include <optional>
#include <string>
#include <vector>

namespace palpate::report {

/// One value of a table: its text, and its number if it is one.
struct Cell {
  std::string text;
  std::optional<double> number;
};

/// A number with this many decimals.
Cell number(double value, int digits);
Cell words(std::string text);
/// A value that was not measured: empty text, null in JSON.
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

/// The conditions that every measurement needs.
struct Conditions {
  std::string device, driver, commit, date;
  unsigned threads = 0;  ///< of the host
};

/// Whether a column has numbers: it is right-aligned, so that their decimal points are aligned.
bool is_numeric(const Table& table, size_t column);
/// Aligned columns for a terminal.
std::string plain_text(const Table& table);
/// A heading, the note and a table.
std::string markdown(const Table& table);
/// All tables as long rows: table, row, column, value; the conditions come first as a table of
/// their own.
std::string csv(const Conditions& conditions, const std::vector<Table>& tables);
/// {"conditions": {...}, "tables": [{"title", "note", "rows": [{key: value}]}]}.
std::string json(const Conditions& conditions, const std::vector<Table>& tables);

}  // namespace palpate::report
