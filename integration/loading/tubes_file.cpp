#include "integration/loading/tubes_file.h"

#include "integration/files/vtk_lines.h"

namespace palpate::loading {

Status write_tubes(const std::filesystem::path& path, const ReleasedTubes& tubes) {
  files::VtkLines lines;
  lines.title = kTubesTitle;
  files::VtkNumbers length{"length", 1, {}}, to_first{"to_first_frame", 3, {}};
  files::VtkNumbers volume{"volume", 1, {}}, field{"field", 1, {}}, frame{"frame", 1, {}},
      kept{"kept", 1, {}};
  for (const ReleasedTube& one : tubes) {
    const StreamTube& tube = *one.tube;
    const std::vector<glm::dvec3> first = tube.places({0, 0.0});
    std::vector<size_t> line;
    for (size_t k = 0; k < tube.released_m().size(); ++k) {
      line.push_back(lines.points_mm.size());
      lines.points_mm.push_back(lps_from_volume(tube.released_m()[k]));
      length.values.push_back(tube.lengths()[k]);
      const glm::dvec3 moved_mm = lps_from_volume(first[k] - tube.released_m()[k]);
      for (int a = 0; a < 3; ++a) to_first.values.push_back(moved_mm[a]);
    }
    lines.lines.push_back(std::move(line));
    volume.values.push_back(double(one.volume));
    field.values.push_back(double(tube.field()));
    frame.values.push_back(tube.released().frame + tube.released().phase);
    kept.values.push_back(one.kept ? 1.0 : 0.0);
  }
  lines.of_points = {std::move(length), std::move(to_first)};
  lines.of_lines = {std::move(volume), std::move(field), std::move(frame), std::move(kept)};
  return files::write_vtk_lines(path, lines);
}

}  // namespace palpate::loading
