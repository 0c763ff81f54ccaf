#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::app {

/// The columns of a CSV of ticks by name.
class Table {
 public:
  explicit Table(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    names_ = cells_of(line);
    while (std::getline(in, line)) rows_.push_back(cells_of(line));
  }
  size_t size() const { return rows_.size(); }
  const std::string& text(size_t row, const std::string& name) const {
    for (size_t c = 0; c < names_.size(); ++c)
      if (names_[c] == name) return rows_[row].at(c);
    throw std::runtime_error("no column " + name);
  }
  double number(size_t row, const std::string& name) const { return std::stod(text(row, name)); }
  double force(size_t row) const {
    return std::hypot(number(row, "force_x_n"), number(row, "force_y_n"), number(row, "force_z_n"));
  }

 private:
  static std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  }
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace palpate::app
