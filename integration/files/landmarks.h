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
/// LPS; LPS, 1) it has; older ones without such a comment are RAS. Lines that begin with # are
/// comments. kBadInput with a sentence that names the line otherwise. Any thread.
Result<Landmarks> read_landmarks(const std::filesystem::path& file);

/// Reads where points that were followed through a sequence are in one frame: a table whose columns
/// are named x0, y0, z0, x1, ..., one row per material point; all else as in plain tables of
/// read_landmarks(). kBadInput if there is no such frame.
Result<Landmarks> read_followed_points(const std::filesystem::path& file, int frame);

/// The same from text; `file` is only for messages, and its ending says whether it is an .fcsv.
Result<Landmarks> parse_landmarks(const std::filesystem::path& file, std::string_view text);
Result<Landmarks> parse_followed_points(const std::filesystem::path& file, std::string_view text,
                                        int frame);

}  // namespace palpate::files
