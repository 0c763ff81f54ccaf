#include "integration/files/vtk_lines.h"

#include <fmt/format.h>

#include <cassert>
#include <iterator>

#include "integration/files/atomic_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

void add_numbers(std::string& text, const std::vector<VtkNumbers>& all, const char* of,
                 size_t count) {
  if (all.empty()) return;
  fmt::format_to(std::back_inserter(text), "{} {}\nFIELD numbers {}\n", of, count, all.size());
  for (const VtkNumbers& numbers : all) {
    assert(numbers.values.size() == count * size_t(numbers.components));
    fmt::format_to(std::back_inserter(text), "{} {} {} double\n", numbers.name, numbers.components,
                   count);
    for (size_t k = 0; k < numbers.values.size(); ++k)
      fmt::format_to(std::back_inserter(text), "{:.9g}{}", numbers.values[k],
                     (k + 1) % size_t(numbers.components) == 0 ? '\n' : ' ');
  }
}

}  // namespace

Status check_can_write_vtk(const std::filesystem::path& path) {
  if (lowered(path.extension().string()) != ".vtk")
    return bad_output(path, "is no name for lines: let it end in .vtk");
  return check_can_write_file(path);
}

Status write_vtk_lines(const std::filesystem::path& path, const VtkLines& lines) {
  if (const Status can = check_can_write_vtk(path); !can) return can;
  std::string text = fmt::format(
      "# vtk DataFile Version 3.0\n{}; SPACE=LPS\nASCII\nDATASET POLYDATA\n", lines.title);
  fmt::format_to(std::back_inserter(text), "POINTS {} double\n", lines.points_mm.size());
  for (const glm::dvec3 p : lines.points_mm)
    fmt::format_to(std::back_inserter(text), "{:.9g} {:.9g} {:.9g}\n", p.x, p.y, p.z);
  size_t words = 0;
  for (const auto& line : lines.lines) words += 1 + line.size();
  fmt::format_to(std::back_inserter(text), "LINES {} {}\n", lines.lines.size(), words);
  for (const auto& line : lines.lines) {
    fmt::format_to(std::back_inserter(text), "{}", line.size());
    for (const size_t point : line) fmt::format_to(std::back_inserter(text), " {}", point);
    text += '\n';
  }
  add_numbers(text, lines.of_lines, "CELL_DATA", lines.lines.size());
  add_numbers(text, lines.of_points, "POINT_DATA", lines.points_mm.size());
  return write_text(path, text);
}

}  // namespace palpate::files
