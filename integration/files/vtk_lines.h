#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// Numbers that belong to points or to lines, one row of `components` for each.
struct VtkNumbers {
  std::string name;  ///< without blanks
  int components = 1;
  std::vector<double> values;
};

/// Lines through points, for ParaView, 3D Slicer and whatever else reads VTK.
struct VtkLines {
  std::string title;                       ///< one line, at most 200 characters
  std::vector<glm::dvec3> points_mm;       ///< LPS
  std::vector<std::vector<size_t>> lines;  ///< of indices of points, in order
  std::vector<VtkNumbers> of_points, of_lines;
};

/// Writes a legacy VTK file (version 3.0, ASCII, POLYDATA), whole or not at all. Its title says
/// SPACE=LPS, which 3D Slicer goes by. kBadOutput, in a sentence, if the name does not end in .vtk
/// or it can not be written. Any thread.
Status write_vtk_lines(const std::filesystem::path& path, const VtkLines& lines);

/// To be asked before long work.
Status check_can_write_vtk(const std::filesystem::path& path);

}  // namespace palpate::files
