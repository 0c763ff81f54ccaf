#include "integration/app/measures.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "integration/files/landmarks.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::app {
namespace {

/// The line of names with those of one frame as "x", "y", "z", which read_landmarks() knows, and
/// all others as "-"; empty if the frame has no columns.
std::string names_of_frame(std::string_view names, int frame) {
  std::string renamed;
  int found = 0;
  for (const std::string_view name : files::cells(names, ',')) {
    std::string as = "-";
    for (const char axis : {'x', 'y', 'z'}) {
      if (files::trimmed(name) == fmt::format("{}{}", axis, frame)) as = axis;
    }
    found += as != "-";
    renamed += (renamed.empty() ? "" : ",") + as;
  }
  return found == 3 ? renamed : "";
}

}  // namespace

Mask mask_on(const Mask& mask, const Grid& onto) {
  if (same_geometry(mask.grid, onto)) return {onto, mask.values};
  Mask result{onto, std::vector<uint8_t>(onto.count())};
  for (int k = 0; k < onto.size.z; ++k) {
    for (int j = 0; j < onto.size.y; ++j) {
      for (int i = 0; i < onto.size.x; ++i) {
        const glm::dvec3 at = mask.grid.index_from_lps(onto.lps_from_index({i, j, k}));
        const glm::ivec3 nearest(glm::round(at));
        if (glm::any(glm::lessThan(nearest, glm::ivec3(0))) ||
            glm::any(glm::greaterThanEqual(nearest, mask.grid.size)))
          continue;
        result.values[onto.offset(i, j, k)] =
            mask.values[mask.grid.offset(nearest.x, nearest.y, nearest.z)];
      }
    }
  }
  return result;
}

Result<Spread> endpoint_error_own_voxels(const Field& u, const Field& truth, const Mask* mask) {
  const Field compared = resampled(u, truth.grid);
  const glm::dmat3 index_from_lps = glm::transpose(truth.grid.direction);
  std::vector<float> errors;
  for (size_t n = 0; n < truth.u_mm.size(); ++n) {
    if (mask && !mask->values[n]) continue;
    const glm::dvec3 error_mm = glm::dvec3(compared.u_mm[n]) - glm::dvec3(truth.u_mm[n]);
    errors.push_back(float(glm::length(index_from_lps * error_mm / truth.grid.spacing_mm)));
  }
  if (errors.empty())
    return Error{ErrorKind::kBadInput, "The mask marks no voxel of the truth: name another mask"};
  return spread_of(errors);
}

Result<std::vector<glm::dvec3>> read_followed_points(const std::filesystem::path& file, int frame) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return files::bad_input(file, "can not be opened: {}", std::strerror(errno));
  std::string text, line;
  bool named = false;
  while (std::getline(stream, line)) {
    if (!named && !line.empty() && line[0] != '#') {
      line = names_of_frame(line, frame);
      if (line.empty()) {
        return files::bad_input(file, "has no columns x{0}, y{0}, z{0}: name another frame", frame);
      }
      named = true;
    }
    text += line + "\n";
  }
  auto landmarks = files::parse_landmarks(file, text);
  if (!landmarks) return landmarks.error();
  return std::move(landmarks->points_lps_mm);
}

}  // namespace palpate::app
