#include "tests/lab/report/table.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <fmt/format.h>

namespace palpate::report {
namespace {

/// Width on a terminal: continuation bytes of a UTF-8 character do not count.
size_t width(const std::string& text) {
  return size_t(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string padded(const std::string& text, size_t to, bool right) {
  const std::string space(to - std::min(to, width(text)), ' ');
  return right ? space + text : text + space;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string exact(const Cell& cell) {
  return cell.number ? fmt::format("{}", *cell.number) : quoted(cell.text);
}

}  // namespace

Cell number(double value, int digits) {
  return {fmt::format("{:.{}f}", value, digits), value};
}
Cell words(std::string text) {
  return {std::move(text), std::nullopt};
}
Cell nothing() {
  return {};
}

bool is_numeric(const Table& table, size_t column) {
  return std::any_of(table.rows.begin(), table.rows.end(),
                     [&](const auto& row) { return row[column].number.has_value(); });
}

std::string plain_text(const Table& table) {
  std::vector<size_t> widths;
  for (size_t c = 0; c < table.columns.size(); ++c) {
    size_t widest = width(table.columns[c].heading);
    for (const auto& row : table.rows) widest = std::max(widest, width(row[c].text));
    widths.push_back(widest);
  }
  std::string result = "\n" + table.title + "\n";
  if (!table.note.empty()) result += table.note + "\n";
  const auto line = [&](const auto& text_of) {
    std::string out;
    for (size_t c = 0; c < widths.size(); ++c) {
      out += (c ? "  " : "") + padded(text_of(c), widths[c], is_numeric(table, c));
    }
    out.erase(out.find_last_not_of(' ') + 1);
    result += out + "\n";
  };
  line([&](size_t c) { return table.columns[c].heading; });
  for (const auto& row : table.rows) line([&](size_t c) { return row[c].text; });
  return result;
}

std::string markdown(const Table& table) {
  std::string result = "\n## " + table.title + "\n\n";
  if (!table.note.empty()) result += table.note + "\n\n";
  for (const Column& column : table.columns) result += "| " + column.heading + " ";
  result += "|\n";
  for (size_t c = 0; c < table.columns.size(); ++c)
    result += is_numeric(table, c) ? "|---:" : "|---";
  result += "|\n";
  for (const auto& row : table.rows) {
    for (const Cell& cell : row) result += "| " + cell.text + " ";
    result += "|\n";
  }
  return result;
}

std::string csv(const Conditions& conditions, const std::vector<Table>& tables) {
  std::string result = "table,row,column,value\n";
  const std::pair<const char*, std::string> about[] = {
      {"device", conditions.device},
      {"driver", conditions.driver},
      {"commit", conditions.commit},
      {"date", conditions.date},
      {"host_threads", std::to_string(conditions.threads)}};
  for (const auto& [name, value] : about)
    result += fmt::format("\"conditions\",0,\"{}\",{}\n", name, quoted(value));
  for (const Table& table : tables) {
    for (size_t r = 0; r < table.rows.size(); ++r) {
      for (size_t c = 0; c < table.columns.size(); ++c) {
        result += fmt::format("{},{},{},{}\n", quoted(table.title), r, quoted(table.columns[c].key),
                              exact(table.rows[r][c]));
      }
    }
  }
  return result;
}

std::string json(const Conditions& conditions, const std::vector<Table>& tables) {
  nlohmann::ordered_json all;
  all["conditions"] = {{"device", conditions.device},
                       {"driver", conditions.driver},
                       {"commit", conditions.commit},
                       {"date", conditions.date},
                       {"host_threads", conditions.threads}};
  all["tables"] = nlohmann::ordered_json::array();
  for (const Table& table : tables) {
    auto rows = nlohmann::ordered_json::array();
    for (const auto& row : table.rows) {
      nlohmann::ordered_json values;
      for (size_t c = 0; c < table.columns.size(); ++c) {
        nlohmann::ordered_json value;
        if (row[c].number) {
          value = *row[c].number;
        } else if (!row[c].text.empty()) {
          value = row[c].text;
        }
        values[table.columns[c].key] = value;
      }
      rows.push_back(values);
    }
    all["tables"].push_back({{"title", table.title}, {"note", table.note}, {"rows", rows}});
  }
  return all.dump(2) + "\n";
}

}  // namespace palpate::report
