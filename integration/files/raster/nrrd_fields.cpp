#include "integration/files/raster/nrrd_fields.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "integration/files/raster/tracked_frames.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// The format allows 16 axes.
constexpr size_t kMaxAxes = 16;

enum class AxisKind { kSpace, kFrames, kComponents, kOpen };

AxisKind kind_of(const std::string& word) {
  constexpr std::array kSpace = {"domain", "space"};
  constexpr std::array kFrames = {"list", "time", "point"};
  constexpr std::array kOpen = {"", "???", "none", "stub", "scalar"};
  const auto is_one_of = [&](const auto& names) {
    return std::find(names.begin(), names.end(), word) != names.end();
  };
  if (is_one_of(kSpace)) return AxisKind::kSpace;
  if (is_one_of(kFrames)) return AxisKind::kFrames;
  if (is_one_of(kOpen)) return AxisKind::kOpen;
  return AxisKind::kComponents;  // all other kinds of the format are vectors, colours, matrices
}

/// `units: "" "mm" "s"` -> the strings between quotes, in lower case.
std::vector<std::string> quoted_words(std::string_view text) {
  std::vector<std::string> found;
  for (size_t open = text.find('"'); open != std::string_view::npos;) {
    const size_t close = text.find('"', open + 1);
    if (close == std::string_view::npos) break;
    found.push_back(lowered(trimmed(text.substr(open + 1, close - open - 1))));
    open = text.find('"', close + 1);
  }
  return found;
}

Error wrong_nrrd_field(const std::filesystem::path& file, const char* field) {
  return bad_input(file, "has a '{}' field that makes no sense: correct its header", field);
}

/// One number per axis; NaN means not given. Nothing for another number of numbers.
std::optional<std::vector<double>> number_per_axis(std::string_view text, size_t axes) {
  if (text.empty()) return std::vector<double>(axes, NAN);
  auto numbers = to_numbers(text);
  if (!numbers || numbers->size() != axes) return std::nullopt;
  return numbers;
}

/// Spacing and first position from what the header says of one axis, as Teem's
/// nrrdOriginCalculate() does: least and most are the ends of the first and last cell, or with
/// centers "node" the positions of the first and last sample. Without centers they are cells.
void set_range(NrrdAxis& axis, double spacing, double least, double most, bool is_node) {
  const double steps = is_node ? axis.size - 1.0 : axis.size;
  if (!std::isfinite(spacing) && steps > 0.0) spacing = (most - least) / steps;
  if (!std::isfinite(spacing)) spacing = 0.0;
  axis.spacing = spacing;
  if (std::isfinite(least)) axis.first = is_node ? least : least + 0.5 * spacing;
}

/// A direction with only a fourth component: ITK writes time like this.
bool is_time_direction(const std::vector<double>& d) {
  return d.size() == 4 && d[0] == 0.0 && d[1] == 0.0 && d[2] == 0.0 && d[3] != 0.0;
}

void decide_roles(const std::vector<AxisKind>& kinds, bool has_directions,
                  std::vector<NrrdAxis>& axes) {
  size_t spaces = 0;
  for (size_t a = 0; a < axes.size(); ++a) {
    NrrdAxis& axis = axes[a];
    bool space = kinds[a] == AxisKind::kSpace || kinds[a] == AxisKind::kOpen;
    if (has_directions && (axis.direction.empty() || is_time_direction(axis.direction)))
      space = false;
    // A fourth axis of space can only be time.
    if (space && ++spaces > 3) space = false;
    axis.role = space                               ? NrrdRole::kSpace
                : kinds[a] == AxisKind::kComponents ? NrrdRole::kComponents
                                                    : NrrdRole::kFrames;
  }
}

}  // namespace

std::string_view NrrdFields::field(const std::string& name) const {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string_view{} : std::string_view(found->second);
}

std::string_view NrrdFields::key(const std::string& name) const {
  const auto found = keys.find(name);
  return found == keys.end() ? std::string_view{} : std::string_view(found->second);
}

std::optional<std::vector<double>> parse_nrrd_vector(std::string_view text) {
  text = trimmed(text);
  if (text == "none") return std::vector<double>{};
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
  std::vector<double> numbers;
  for (const std::string_view cell : cells(text.substr(1, text.size() - 2), ',')) {
    const auto number = to_number(cell);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<std::vector<std::vector<double>>> parse_nrrd_vectors(std::string_view text) {
  std::vector<std::vector<double>> vectors;
  // Vectors may hold blanks inside their brackets, so they are cut at brackets, not at blanks.
  while (!(text = trimmed(text)).empty()) {
    const bool bracket = text.front() == '(';
    const size_t end = text.find_first_of(bracket ? ")" : " \t");
    const std::string_view word =
        text.substr(0, bracket && end != std::string_view::npos ? end + 1 : end);
    const auto vector = parse_nrrd_vector(word);
    if (!vector) return std::nullopt;
    vectors.push_back(*vector);
    text.remove_prefix(word.size());
  }
  return vectors;
}

Result<NrrdFields> split_nrrd_header(const std::filesystem::path& file, std::string_view text) {
  const std::string_view magic = take_line(text);
  if (magic.substr(0, 7) != "NRRD000" || magic.size() < 8) {
    return bad_input(file,
                     "is not a NRRD file (it does not begin with NRRD000): check what wrote it");
  }
  NrrdFields header;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (trimmed(line).empty()) break;
    if (line.front() == '#') continue;
    const size_t colon = line.find(':');
    if (colon == std::string_view::npos) {
      return bad_input(file, "has a header line that is no NRRD field ('{}'): correct its header",
                       line.substr(0, 40));
    }
    if (line.substr(colon, 2) == ":=") {
      header.keys[std::string(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 2));
      continue;
    }
    std::string name = lowered(line.substr(0, colon));
    std::erase(name, ' ');
    const std::string_view value = trimmed(line.substr(colon + 1));
    header.fields[name] = value;
    if (name == "datafile" && value.substr(0, 4) == "LIST") {
      while (!text.empty()) {
        const std::string_view entry = trimmed(take_line(text));
        if (!entry.empty()) header.data_files.emplace_back(entry);
      }
    }
  }
  return header;
}

Result<std::vector<NrrdAxis>> nrrd_axes(const std::filesystem::path& file,
                                        const NrrdFields& header) {
  const auto dimension = to_integer(header.field("dimension"));
  const auto sizes = to_numbers(header.field("sizes"));
  if (!dimension || *dimension < 1 || *dimension > int64_t(kMaxAxes))
    return wrong_nrrd_field(file, "dimension");
  std::vector<NrrdAxis> axes(size_t(*dimension), NrrdAxis{});
  if (!sizes || sizes->size() != axes.size()) return wrong_nrrd_field(file, "sizes");
  for (size_t a = 0; a < axes.size(); ++a) {
    axes[a].size = (*sizes)[a];
    if (!(axes[a].size >= 1.0 && axes[a].size < 9e15) || axes[a].size != std::floor(axes[a].size)) {
      return wrong_nrrd_field(file, "sizes");
    }
  }
  const auto directions = parse_nrrd_vectors(header.field("spacedirections"));
  if (!directions || (!directions->empty() && directions->size() != axes.size())) {
    return wrong_nrrd_field(file, "space directions");
  }
  for (size_t a = 0; a < directions->size(); ++a) axes[a].direction = (*directions)[a];
  const auto spacings = number_per_axis(header.field("spacings"), axes.size());
  if (!spacings) return wrong_nrrd_field(file, "spacings");
  const auto least = number_per_axis(header.field("axismins"), axes.size());
  if (!least) return wrong_nrrd_field(file, "axis mins");
  const auto most = number_per_axis(header.field("axismaxs"), axes.size());
  if (!most) return wrong_nrrd_field(file, "axis maxs");
  const std::string center_text =
      lowered(header.field("centers")) + lowered(header.field("centerings"));
  const auto centers = words(center_text);
  for (size_t a = 0; a < axes.size(); ++a) {
    const bool is_node = a < centers.size() && centers[a] == "node";
    set_range(axes[a], (*spacings)[a], (*least)[a], (*most)[a], is_node);
  }
  const auto units = quoted_words(header.field("units"));
  for (size_t a = 0; a < std::min(units.size(), axes.size()); ++a) axes[a].unit = units[a];

  const std::string kind_text = lowered(header.field("kinds"));
  const auto kind_words = words(kind_text);
  if (!kind_words.empty() && kind_words.size() != axes.size())
    return wrong_nrrd_field(file, "kinds");
  std::vector<AxisKind> kinds(axes.size(), AxisKind::kOpen);
  for (size_t a = 0; a < kind_words.size(); ++a) kinds[a] = kind_of(std::string(kind_words[a]));
  // PLUS says something of each frame, which lie along the last axis.
  if (kind_words.empty() && !frame_fields(header.keys).empty()) kinds.back() = AxisKind::kFrames;
  decide_roles(kinds, !directions->empty(), axes);
  return axes;
}

}  // namespace palpate::files
