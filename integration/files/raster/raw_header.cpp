#include "integration/files/raster/raw_header.h"

namespace palpate::files {

Result<Raster> raw_header(const std::filesystem::path& file, const RawSamples& samples) {
  Placement placement;
  placement.size = glm::dvec3(samples.size);
  placement.spacing_mm = 1e3 * samples.spacing_m;
  // Columns. Right-handed as the scene is: x is L, y is S, and z points to the front.
  placement.axes = glm::dmat3(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
  const auto grid = make_grid(file, placement);
  if (!grid) return grid.error();
  Raster raster;
  raster.file = file;
  raster.data = {file};
  raster.type = samples.type;
  raster.grid = *grid;
  if (samples.components > 1) {
    raster.lane_kind = LaneKind::kComponents;
    raster.lanes = size_t(samples.components);
  }
  return raster;
}

}  // namespace palpate::files
