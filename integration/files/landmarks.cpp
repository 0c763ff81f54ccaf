#include "integration/files/landmarks.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Ten million points; a larger file is no table of landmarks.
constexpr uintmax_t kMaxBytes = 1u << 30;

struct LandmarkTable {
  std::array<size_t, 3> columns = {0, 1, 2};  ///< where x, y, z stand
  bool columns_known = false;
  bool is_ras = false;
  std::optional<int> frame;  ///< whose columns are wanted, of points followed through many
};

std::vector<std::string_view> split(std::string_view line) {
  for (const char separator : {',', ';', '\t'}) {
    if (line.find(separator) != std::string_view::npos) return cells(line, separator);
  }
  return words(line);
}

/// Takes x, y, z from names like "x", "X (mm)", "l", "x_mm"; false if one is missing.
bool take_columns(const std::vector<std::string_view>& names, LandmarkTable& table) {
  std::array<size_t, 3> found{};
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto is_axis = [&](std::string_view name) {
      const std::string lower = lowered(name);
      const char letter = char('x' + axis), lps = "lps"[axis], ras = "ras"[axis];
      const auto parts = words(lower, " _([\"");
      return !parts.empty() && parts[0].size() == 1 &&
             (parts[0][0] == letter || parts[0][0] == lps || (table.is_ras && parts[0][0] == ras));
    };
    const auto at = std::find_if(names.begin(), names.end(), is_axis);
    if (at == names.end()) return false;
    found[axis] = size_t(at - names.begin());
  }
  table.columns = found;
  table.columns_known = true;
  return true;
}

/// Takes those of one frame from names like "x0".
bool take_columns_of_frame(const std::vector<std::string_view>& names, LandmarkTable& table) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const std::string wanted = fmt::format("{}{}", "xyz"[axis], *table.frame);
    const auto at = std::find_if(names.begin(), names.end(), [&](std::string_view name) {
      return lowered(trimmed(name)) == wanted;
    });
    if (at == names.end()) return false;
    table.columns[axis] = size_t(at - names.begin());
  }
  table.columns_known = true;
  return true;
}

/// "# CoordinateSystem = LPS" and "# columns = id,x,y,z,..."; other comments are ignored.
Status take_comment(const std::filesystem::path& file, std::string_view comment,
                    LandmarkTable& table) {
  const size_t equals = comment.find('=');
  if (equals == std::string_view::npos) return Nothing{};
  const std::string name = lowered(trimmed(comment.substr(0, equals)));
  const std::string value = lowered(trimmed(comment.substr(equals + 1)));
  if (name == "coordinatesystem") {
    if (value != "ras" && value != "0" && value != "lps" && value != "1") {
      return bad_input(file, "has points in the coordinate system '{}': export them as RAS or LPS",
                       value);
    }
    table.is_ras = value == "ras" || value == "0";
  }
  if (name == "columns" && !table.frame && !take_columns(cells(value, ','), table)) {
    return bad_input(file, "names no columns x, y, z: export the points again");
  }
  return Nothing{};
}

std::optional<glm::dvec3> point_of(const std::vector<std::string_view>& parts,
                                   const LandmarkTable& table) {
  glm::dvec3 point{};
  for (size_t axis = 0; axis < 3; ++axis) {
    if (table.columns[axis] >= parts.size()) return std::nullopt;
    const auto number = to_number(parts[table.columns[axis]]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    point[int(axis)] = *number;
  }
  return point;
}

Result<Landmarks> parse_table(const std::filesystem::path& file, std::string_view text,
                              LandmarkTable table) {
  Landmarks landmarks;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark of spreadsheets
  for (size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty()) continue;
    if (line.front() == '#') {
      if (const Status good = take_comment(file, line.substr(1), table); !good) return good.error();
      continue;
    }
    const auto parts = split(line);
    if (table.frame && !table.columns_known) {
      if (take_columns_of_frame(parts, table)) continue;
      return bad_input(file, "has no columns x{0}, y{0}, z{0}: name another frame", *table.frame);
    }
    const auto point = point_of(parts, table);
    if (point) {
      const glm::dvec3 signs = table.is_ras ? glm::dvec3(-1, -1, 1) : glm::dvec3(1);
      landmarks.points_lps_mm.push_back(signs * *point);
      continue;
    }
    const bool names =
        landmarks.points_lps_mm.empty() && !table.columns_known && take_columns(parts, table);
    if (names) continue;
    return bad_input(file, "has no point in line {} ('{}'): write one 'x,y,z' in mm per line",
                     number, line.substr(0, 40));
  }
  if (landmarks.points_lps_mm.empty())
    return bad_input(file, "holds no points: write one 'x,y,z' in mm per line");
  return landmarks;
}

Result<std::string> text_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return bad_input(file, "does not exist or is no file: check the name");
  if (std::filesystem::file_size(file, error) > kMaxBytes) {
    return bad_input(file, "is too large for a table of landmarks: name the right file");
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    return bad_input(file, "can not be opened ({}): check the permissions", std::strerror(errno));
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace

Result<Landmarks> parse_landmarks(const std::filesystem::path& file, std::string_view text) {
  LandmarkTable table;
  if (lowered(file.string()).ends_with(".fcsv")) {
    // Slicer's own table: id, x, y, z, ... in RAS unless its comments say otherwise.
    table.is_ras = true;
    table.columns = {1, 2, 3};
    table.columns_known = true;
  }
  return parse_table(file, text, table);
}

Result<Landmarks> parse_followed_points(const std::filesystem::path& file, std::string_view text,
                                        int frame) {
  LandmarkTable table;
  table.frame = frame;
  return parse_table(file, text, table);
}

Result<Landmarks> read_landmarks(const std::filesystem::path& file) {
  const auto text = text_of(file);
  if (!text) return text.error();
  return parse_landmarks(file, *text);
}

Result<Landmarks> read_followed_points(const std::filesystem::path& file, int frame) {
  const auto text = text_of(file);
  if (!text) return text.error();
  return parse_followed_points(file, *text, frame);
}

}  // namespace palpate::files
