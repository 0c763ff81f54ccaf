#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// Points that a person or a program marked, in the order of the file.
struct Landmarks {
  std::vector<glm::dvec3> points_lps_mm;
};

/// Reads a table of points, mm. Plain tables ("x,y,z", with or without a line of names, comma,
/// semicolon, tab or blank between) are LPS; with names the columns x, y, z count, in any place. 3D
/// Slicer's .fcsv says in its comments which columns and which coordinate system (RAS, 0: turned to
/// LPS; LPS, 1) it has; older ones that say nothing are RAS. Lines that begin with # are comments.
/// kBadInput with a sentence that names the line otherwise. Any thread.
Result<Landmarks> read_landmarks(const std::filesystem::path& file);

/// The same from text; `file` is only for messages, and its ending says whether it is an .fcsv.
Result<Landmarks> parse_landmarks(const std::filesystem::path& file, std::string_view text);

}  // namespace palpate::files
