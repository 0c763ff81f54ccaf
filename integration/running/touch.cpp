#include "integration/running/touch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "module/scene/segment_modes.h"

namespace palpate::running {
namespace {

constexpr double kStep_m = 0.25e-3;
constexpr double kRoom_m = 0.003;      // free space in front of the surface, at least
constexpr double kFarthest_m = 0.030;  // search distance for surfaces
constexpr double kGrid_m = 0.004;      // spacing of the start positions inside
constexpr double kCoarse_m = 0.001;
constexpr double kAside_m = 0.003;  // that a pressing hand may creep
constexpr double kPress_n = 2.0, kTouch_n = 0.05;
constexpr int kAround = 8;
constexpr double kSquarely = 0.8;  // cosine between the direction of a press and a wall's normal

/// A place without data.
constexpr double kOutside = -1.0;

/// What a surface mode reads in the first frame, and its place.
struct TouchedSurface {
  const FrameData* frame;  ///< whose box is that of the data
  const FrameData* read;   ///< the values, or the distance to a segment
  const VolumeSpec* volume;
  TransferFunction strength;
};

class Surfaces {
 public:
  explicit Surfaces(const LoadedScene& scene)
      : world_from_device_(scene.spec.world_from_device),
        spring_n_per_m_(scene.spec.stiffness_n_per_m) {
    for (const ModeSpec& mode : modes_of(scene.spec)) {
      if (mode.kind != "surface" || mode.leaving || mode.scalar != ScalarProperty::kValue) continue;
      if (!(mode.strength.highest() > 0.0)) continue;
      for (size_t v = 0; v < scene.data.size(); ++v) {
        if (scene.spec.volumes[v].name != mode.volume) continue;
        const FrameData* frame = scene.data[v]->frames.front().get();
        const FrameData* read = mode.segment.empty() ? frame : nullptr;
        for (const Segment& segment : scene.data[v]->segments)
          if (segment.name == mode.segment) read = segment.distance_mm.front().get();
        if (read) all_.push_back({frame, read, &scene.spec.volumes[v], mode.strength});
      }
    }
  }

  /// The share of the strongest surface's strength at a place of the device, 0 to 1; the surface of
  /// a segment is its border. kOutside if no volume with a surface has data there.
  double hold_at(glm::dvec3 device_m) const {
    const glm::dvec3 world = world_from_device_.world_from_volume(device_m);
    double hold = kOutside;
    for (const TouchedSurface& surface : all_) {
      const glm::dvec3 x = surface.volume->transform.volume_from_world(world);
      // Outside the data the value is clamped to the edge: nothing to press there.
      if (glm::any(glm::lessThan(x, surface.frame->low_m())) ||
          glm::any(glm::greaterThan(x, surface.frame->high_m())))
        continue;
      const double value = surface.read->scalar(x);
      hold = std::max(hold, surface.read != surface.frame
                                ? double(value > 0.0)
                                : surface.strength(value) / surface.strength.highest());
    }
    return hold;
  }

  /// The strongest wall at a place of the device, N; 0 where there are no data.
  double newtons_at(glm::dvec3 device_m) const {
    const glm::dvec3 world = world_from_device_.world_from_volume(device_m);
    double most_n = 0.0;
    for (const TouchedSurface& surface : all_) {
      const glm::dvec3 x = surface.volume->transform.volume_from_world(world);
      if (glm::all(glm::greaterThanEqual(x, surface.frame->low_m())) &&
          glm::all(glm::lessThanEqual(x, surface.frame->high_m())))
        most_n = std::max(most_n, surface.strength(surface.read->scalar(x)));
    }
    return most_n;
  }

  /// Whether the wall holds a press, also a little aside of the place (the hand falls through where
  /// there is a notch beside it), and there is nothing in front of it.
  bool holds_around(const devices::PathPlace& place) const {
    const glm::dvec3 out = place.outward;
    const glm::dvec3 along = glm::normalize(
        glm::cross(out, std::abs(out.z) < 0.8 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
    const glm::dvec3 across = glm::cross(out, along);
    // From somewhere near the surface on it must be strong for as long as the spring is.
    const auto holds = [&](glm::dvec3 at) {
      const double spring_m = kPress_n / spring_n_per_m_;
      double strong_m = 0.0;
      for (double deep_m = -kAside_m; deep_m < kAside_m + spring_m; deep_m += kStep_m) {
        strong_m = newtons_at(at - deep_m * out) >= kPress_n ? strong_m + kStep_m : 0.0;
        if (strong_m >= spring_m) return true;
      }
      return false;
    };
    // Before it there must be room for the hand, also along the normal.
    for (double way_m = kRoom_m; way_m <= place.clearance_m + kRoom_m; way_m += kStep_m)
      if (newtons_at(place.surface_m + way_m * out) > kTouch_n) return false;
    if (!holds(place.surface_m)) return false;
    for (int d = 0; d < kAround; ++d) {
      const double angle = 2.0 * std::numbers::pi * d / kAround;
      if (!holds(place.surface_m + kAside_m * (std::cos(angle) * along + std::sin(angle) * across)))
        return false;
    }
    return true;
  }

  /// The outward normal of the nearest segment's wall at a place of the device. Empty without
  /// segments: noise tilts the gradient of values.
  std::optional<glm::dvec3> way_out(glm::dvec3 device_m) const {
    const glm::dvec3 world = world_from_device_.world_from_volume(device_m);
    std::optional<glm::dvec3> out;
    double nearest_mm = std::numeric_limits<double>::infinity();
    for (const TouchedSurface& surface : all_) {
      if (surface.read == surface.frame) continue;
      const Transform& place = surface.volume->transform;
      const ScalarSample here = surface.read->scalar_and_gradient(place.volume_from_world(world));
      const glm::dvec3 inward = place.rotation * (here.gradient / place.scale);
      if (std::abs(here.value) >= nearest_mm || !(glm::length(inward) > 0.0)) continue;
      nearest_mm = std::abs(here.value);
      out = glm::conjugate(world_from_device_.rotation) * -glm::normalize(inward);
    }
    return out;
  }

 private:
  std::vector<TouchedSurface> all_;
  Transform world_from_device_;
  double spring_n_per_m_;
};

const std::vector<glm::dvec3>& directions() {
  // From the front first, then from above and from the sides: as a person would reach in.
  static const std::vector<glm::dvec3> all = [] {
    std::vector<glm::dvec3> list = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}};
    for (int n = 0; n < 27; ++n) {
      const glm::dvec3 d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (glm::length(d) > 0.0) list.push_back(glm::normalize(d));
    }
    return list;
  }();
  return all;
}

devices::PathPlace place_at(glm::dvec3 surface_m, glm::dvec3 outward, double clearance_m) {
  devices::PathPlace place;
  place.surface_m = surface_m;
  place.outward = outward;
  place.clearance_m = clearance_m;
  place.depth_m = 0.014;
  place.reach_m = 0.008;
  place.hold_s = 2.5;
  return place;
}

/// From outside: the first surface on the way from the edge of the reach to the centre, with free
/// space before it. A face at which the data were cut off is no surface.
std::optional<devices::PathPlace> from_outside(const Surfaces& surfaces, const DeviceInfo& device,
                                               glm::dvec3 out) {
  double free_m = 0.0;
  const double edge = 0.9 * device.workspace_radius_m;
  for (double r = edge; r > 0.1 * device.workspace_radius_m; r -= kStep_m) {
    const glm::dvec3 at = device.workspace_centre_m + r * out;
    const double hold = surfaces.hold_at(at);
    if (hold < 0.0) continue;
    if (hold < 0.5) {
      free_m += kStep_m;
      continue;
    }
    if (free_m < kRoom_m) return std::nullopt;
    return place_at(at, out, std::min(0.010, edge - r));
  }
  return std::nullopt;
}

/// The distance from a free place to a surface; 0 if the data end before.
double way_to_surface(const Surfaces& surfaces, glm::dvec3 from, glm::dvec3 direction,
                      double step) {
  for (double way = 0.0; way < kFarthest_m; way += step) {
    const double hold = surfaces.hold_at(from + way * direction);
    if (hold < 0.0) return 0.0;
    if (hold >= 0.5) return way;
  }
  return kFarthest_m;
}

/// From inside: the widest free space within reach, and the surface next to it.
std::optional<devices::PathPlace> from_inside(const Surfaces& surfaces, const DeviceInfo& device) {
  const double reach = 0.7 * device.workspace_radius_m;
  const int n = int(reach / kGrid_m);
  double widest = kRoom_m;
  std::optional<glm::dvec3> best;
  for (int z = -n; z <= n; ++z)
    for (int y = -n; y <= n; ++y)
      for (int x = -n; x <= n; ++x) {
        const glm::dvec3 offset = kGrid_m * glm::dvec3(x, y, z);
        if (glm::length(offset) > reach) continue;
        const glm::dvec3 at = device.workspace_centre_m + offset;
        double room = kFarthest_m;
        for (size_t d = 0; d < directions().size() && room > widest; ++d)
          room = std::min(room, way_to_surface(surfaces, at, directions()[d], kCoarse_m));
        if (room > widest && room < kFarthest_m) {
          widest = room;
          best = at;
        }
      }
  if (!best) return std::nullopt;
  std::optional<devices::PathPlace> place;
  double nearest = kFarthest_m;
  for (const glm::dvec3 direction : directions()) {
    const double way = way_to_surface(surfaces, *best, direction, kStep_m);
    if (way <= 0.0 || way >= nearest) continue;
    nearest = way;
    place = place_at(*best + way * direction, -direction, std::min(0.010, way));
  }
  return place;
}

}  // namespace

std::optional<devices::PathPlace> place_to_touch(const LoadedScene& scene,
                                                 const DeviceInfo& device) {
  const Surfaces surfaces(scene);
  // A segment's wall that is met at an angle is slid along instead of pressed: walls met squarely
  // come first, and are pressed along their normal. Of these, one that holds all around.
  std::optional<devices::PathPlace> square, any;
  for (const glm::dvec3 out : directions()) {
    auto place = from_outside(surfaces, device, out);
    if (!place) continue;
    if (!any) any = place;
    if (const auto normal = surfaces.way_out(place->surface_m)) {
      if (glm::dot(*normal, out) < kSquarely) continue;
      place->outward = *normal;
    }
    if (surfaces.holds_around(*place)) return place;
    if (!square) square = place;
  }
  if (square) return square;
  if (any) return any;
  return from_inside(surfaces, device);
}

}  // namespace palpate::running
