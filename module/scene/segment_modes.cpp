#include "module/scene/segment_modes.h"

#include <algorithm>
#include <cmath>

#include "compute/volume/portable.h"

namespace palpate {

TransferFunction segment_strength(const SegmentSpec& segment, double scale) {
  const double full_mm = 1e3 * segment.strength_n / (segment.stiffness_n_per_m * scale);
  const auto strength = TransferFunction::linear({0.0, full_mm}, {0.0, segment.strength_n});
  return strength ? *strength : TransferFunction();
}

double half_thickness_mm(double force_n, double spring_n_per_m, double wall_n_per_m, double scale) {
  return 0.5e3 * (force_n / spring_n_per_m + force_n / wall_n_per_m) / scale;
}

double sure_strength(double strength_n, double slope) {
  constexpr double kSteep = 0.5;
  const double t = std::clamp(slope / kSteep, 0.0, 1.0);
  return strength_n * t * t * (3.0 - 2.0 * t);
}

WallHold wall_hold(const FrameData& distance, const SegmentSpec& segment, double scale) {
  constexpr size_t kPlaces = 800;
  constexpr double kStepsOfDetail = 2.0, kWalkOfDetail = 0.2, kWalkOfEnough = 0.2;
  const glm::dvec3 low = distance.low_m(), extent = distance.high_m() - low;
  const double step_m = kStepsOfDetail * distance.detail_m();
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

  // How deep and how strong it is behind them.
  const TransferFunction strength = segment_strength(segment, scale);
  const double enough_m = segment.strength_n / (segment.stiffness_n_per_m * scale);
  const double walk_m = std::min(kWalkOfDetail * distance.detail_m(), kWalkOfEnough * enough_m);
  std::vector<double> thick_m, forces_n;
  for (size_t p = 0; p < places.size(); p += 1 + places.size() / kPlaces) {
    glm::dvec3 x = places[p];
    double depth_m = 0.0, most_n = 0.0;
    for (double way_m = 0.0; way_m < 2.0 * enough_m + distance.detail_m(); way_m += walk_m) {
      const ScalarSample here = distance.scalar_and_gradient(x);
      if (1e-3 * here.value < depth_m - 0.25 * step_m) break;  // behind the middle
      depth_m = std::max(depth_m, 1e-3 * here.value);
      const double steep = glm::length(here.gradient);
      most_n = std::max(most_n, sure_strength(strength(here.value), 1e-3 * steep));
      if (most_n >= segment.strength_n || !(steep > 0.0)) break;
      x += walk_m * here.gradient / steep;
    }
    forces_n.push_back(most_n);
    // Straight on to the other side, at most four times as far as the strength grows: enough for
    // any wall that holds.
    const double most_m = 4.0 * enough_m + 2.0 * distance.detail_m();
    const glm::dvec3 slope = distance.scalar_gradient(places[p]);
    const glm::dvec3 inwards = slope / std::max(glm::length(slope), 1e-9);
    double through_m = depth_m;
    while (through_m < most_m && distance.scalar(places[p] + through_m * inwards) > 0.0)
      through_m += walk_m;
    thick_m.push_back(through_m);
  }
  if (thick_m.empty()) return {};
  const auto at_thin_places = [](std::vector<double>& of) {
    const auto thin = of.begin() + ptrdiff_t(of.size() / 10);
    std::nth_element(of.begin(), thin, of.end());
    return *thin;
  };
  return {at_thin_places(forces_n), scale * at_thin_places(thick_m)};
}

double holding_stiffness(const FrameData& distance, const SegmentSpec& segment, double scale) {
  constexpr int kDoublings = 4;
  SegmentSpec stiffer = segment;
  for (int n = 0; n < kDoublings; ++n) {
    if (wall_hold(distance, stiffer, scale).force_n >= 0.95 * segment.strength_n) break;
    stiffer.stiffness_n_per_m *= 2.0;
  }
  return stiffer.stiffness_n_per_m;
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
      wall.strength = segment_strength(segment, portable::cube_root(s.x * s.y * s.z));
      wall.friction = TransferFunction::constant(segment.friction);
      modes.push_back(std::move(wall));
    }
  }
  return modes;
}

}  // namespace palpate
