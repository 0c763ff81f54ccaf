#include "integration/app/touch.h"

#include <algorithm>

namespace palpate::app {
namespace {

constexpr double kStep_m = 0.25e-3;
constexpr double kRoom_m = 0.004;  // least way in free space before the surface

/// Half of the strength of the strongest surface, in [0, 1] of it: how much of it holds at a place.
double hold_at(const FeltScene& scene, glm::dvec3 world) {
  double hold = 0.0;
  for (const ModeSpec& mode : scene.spec.modes) {
    if (mode.kind != "surface" || mode.leaving || mode.scalar != ScalarProperty::kValue) continue;
    for (size_t v = 0; v < scene.data.size(); ++v) {
      const VolumeSpec& volume = scene.spec.volumes[v];
      if (volume.name != mode.volume || mode.strength.highest() <= 0.0) continue;
      const FrameData& frame = *scene.data[v]->frames.front();
      const glm::dvec3 x = volume.transform.volume_from_world(world);
      // Beyond the data the border's value is held: nothing to press.
      if (glm::any(glm::lessThan(x, frame.low_m())) ||
          glm::any(glm::greaterThan(x, frame.high_m())))
        continue;
      hold = std::max(hold, mode.strength(frame.scalar(x)) / mode.strength.highest());
    }
  }
  return hold;
}

/// The surface on the way from the edge of the reach to the centre, as a distance from the centre.
std::optional<double> first_surface(const FeltScene& scene, const DeviceInfo& device,
                                    glm::dvec3 direction) {
  const Transform& world = scene.spec.world_from_device;
  const double edge = 0.9 * device.workspace_radius_m;
  for (double r = edge; r > 0.1 * device.workspace_radius_m; r -= kStep_m) {
    const glm::dvec3 at = world.world_from_volume(device.workspace_centre_m + r * direction);
    if (hold_at(scene, at) < 0.5) continue;
    if (r > edge - kRoom_m) return std::nullopt;
    return r;
  }
  return std::nullopt;
}

}  // namespace

std::optional<devices::PathPlace> place_to_touch(const FeltScene& scene, const DeviceInfo& device) {
  const glm::dvec3 from[] = {{0, 0, 1},  {0, 1, 0},  {1, 0, 0},  {-1, 0, 0}, {0, 1, 1},
                             {1, 0, 1},  {-1, 0, 1}, {1, 1, 0},  {-1, 1, 0}, {1, 1, 1},
                             {-1, 1, 1}, {0, -1, 0}, {0, 0, -1}, {0, -1, 1}, {0, 1, -1}};
  for (const glm::dvec3 direction : from) {
    const glm::dvec3 out = glm::normalize(direction);
    const auto surface = first_surface(scene, device, out);
    if (!surface) continue;
    devices::PathPlace place;
    place.surface_m = device.workspace_centre_m + *surface * out;
    place.outward = out;
    place.clearance_m = std::min(0.010, 0.95 * device.workspace_radius_m - *surface);
    place.depth_m = 0.014;
    place.reach_m = 0.008;
    place.hold_s = 2.5;
    return place;
  }
  return std::nullopt;
}

}  // namespace palpate::app
