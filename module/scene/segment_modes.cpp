#include "module/scene/segment_modes.h"

#include <algorithm>
#include <cmath>

namespace palpate {

TransferFunction segment_strength(const SegmentSpec& segment, double scale) {
  const double full_mm = 1e3 * segment.strength_n / (segment.stiffness_n_per_m * scale);
  const auto strength = TransferFunction::linear({0.0, full_mm}, {0.0, segment.strength_n});
  return strength ? *strength : TransferFunction();
}

double half_thickness_mm(double force_n, double spring_n_per_m, double wall_n_per_m, double scale) {
  return 0.5e3 * (force_n / spring_n_per_m + force_n / wall_n_per_m) / scale;
}

WallHold wall_hold(const FrameData& distance, const SegmentSpec& segment, double spring_n_per_m,
                   double scale) {
  constexpr size_t kPlaces = 800;
  constexpr double kStepsOfDetail = 2.0, kWalkOfDetail = 0.2;
  const glm::dvec3 low = distance.low_m(), extent = distance.high_m() - low;
  const double step_m = kStepsOfDetail * distance.detail_m();
  const double walk_m = kWalkOfDetail * distance.detail_m();
  const glm::ivec3 n = glm::max(glm::ivec3(extent / step_m), glm::ivec3(1));

  // Places near the border, moved onto it.
  std::vector<glm::dvec3> places;
  for (int k = 0; k <= n.z; ++k)
    for (int j = 0; j <= n.y; ++j)
      for (int i = 0; i <= n.x; ++i) {
        const glm::dvec3 x = low + extent * (glm::dvec3(i, j, k) / glm::dvec3(n));
        const double mm = distance.scalar(x);
        if (std::abs(1e-3 * mm) > 0.5 * step_m) continue;
        const glm::dvec3 slope = 1e-3 * distance.scalar_gradient(x);  // about 1
        const double square = glm::dot(slope, slope);
        if (square > 0.25) places.push_back(x - 1e-3 * mm * slope / square);
      }

  // How deep it is behind them.
  const double full_m = segment.strength_n / (segment.stiffness_n_per_m * scale);
  const double spring_m = 1e-3 * half_thickness_mm(segment.strength_n, spring_n_per_m,
                                                   segment.stiffness_n_per_m, scale);
  const double enough_m = std::max(full_m, spring_m);
  std::vector<double> depths_m;
  for (size_t p = 0; p < places.size(); p += 1 + places.size() / kPlaces) {
    glm::dvec3 x = places[p];
    double depth_m = 0.0;
    for (double way_m = 0.0; way_m < 2.0 * enough_m; way_m += walk_m) {
      const ScalarSample here = distance.scalar_and_gradient(x);
      if (1e-3 * here.value < depth_m - 0.25 * step_m) break;  // behind the middle
      depth_m = std::max(depth_m, 1e-3 * here.value);
      const double steep = glm::length(here.gradient);
      if (depth_m >= enough_m || !(steep > 0.0)) break;
      x += walk_m * here.gradient / steep;
    }
    depths_m.push_back(depth_m);
  }
  if (depths_m.empty()) return {};
  const auto thin = depths_m.begin() + ptrdiff_t(depths_m.size() / 10);
  std::nth_element(depths_m.begin(), thin, depths_m.end());
  const double half_m = *thin * scale, k = spring_n_per_m, wall = segment.stiffness_n_per_m;
  return {std::min({segment.strength_n, wall * half_m, 2.0 * half_m * k * wall / (k + wall)}),
          2.0 * half_m};
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
