#include "module/scene/segment_modes.h"

#include <algorithm>
#include <cmath>

namespace palpate {

TransferFunction segment_strength(const SegmentSpec& segment, double scale) {
  const double full_mm = 1e3 * segment.strength_n / (segment.stiffness_n_per_m * scale);
  const auto strength = TransferFunction::linear({0.0, full_mm}, {0.0, segment.strength_n});
  return strength ? *strength : TransferFunction();
}

std::vector<ModeSpec> modes_of(const SceneSpec& spec) {
  std::vector<ModeSpec> modes = spec.modes;
  for (const VolumeSpec& volume : spec.volumes) {
    const glm::dvec3 s = volume.transform.scale;
    for (const SegmentSpec& segment : volume.segments.parts) {
      const bool read =
          std::any_of(spec.modes.begin(), spec.modes.end(), [&](const ModeSpec& mode) {
            return mode.volume == volume.name && mode.segment == segment.name;
          });
      if (!segment.felt || read) continue;
      const bool taken = std::any_of(modes.begin(), modes.end(), [&](const ModeSpec& mode) {
        return mode.name == segment.name;
      });
      ModeSpec wall;
      wall.name = taken ? volume.name + ": " + segment.name : segment.name;
      wall.volume = volume.name;
      wall.segment = segment.name;
      wall.strength = segment_strength(segment, std::cbrt(s.x * s.y * s.z));
      wall.friction = TransferFunction::constant(segment.friction);
      modes.push_back(std::move(wall));
    }
  }
  return modes;
}

}  // namespace palpate
