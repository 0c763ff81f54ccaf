#include "integration/devices/simulated_paths.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace palpate::devices {
namespace {

/// Points of a path one after the other, timed by the speed.
class PathSteps {
 public:
  explicit PathSteps(const PathPlace& place)
      : place_(place),
        out_(glm::normalize(place.outward)),
        along_(place.along - out_ * glm::dot(place.along, out_)) {
    assert(place.speed_m_per_s > 0.0);
    // Any direction in the surface will do where `along` points straight out of it.
    if (glm::length(along_) < 1e-9)
      along_ = glm::cross(out_, std::abs(out_.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0));
    along_ = glm::normalize(along_);
    across_ = glm::cross(out_, along_);
    points_.push_back({0.0, at(place.clearance_m), 0});
  }

  /// `height_m` over the surface, `along_m` and `across_m` on it.
  glm::dvec3 at(double height_m, double along_m = 0.0, double across_m = 0.0) const {
    return place_.surface_m + out_ * height_m + along_ * along_m + across_ * across_m;
  }
  void go(glm::dvec3 to) {
    const double way = glm::distance(to, points_.back().position_m);
    if (way > 0.0) points_.push_back({points_.back().time_s + way / place_.speed_m_per_s, to, 0});
  }
  void hold(double seconds) {
    if (seconds > 0.0)
      points_.push_back({points_.back().time_s + seconds, points_.back().position_m, 0});
  }
  ScriptedPath done(ScriptedPath::Between between) && {
    return ScriptedPath(std::move(points_), between);
  }

 private:
  const PathPlace& place_;
  glm::dvec3 out_, along_, across_{0.0};
  std::vector<ScriptedPath::PathPoint> points_;
};

constexpr int kCorners = 72;  ///< of a circle; the cubics between bend

}  // namespace

ScriptedPath press_path(const PathPlace& place) {
  PathSteps steps(place);
  for (int n = 0; n < place.times; ++n) {
    steps.hold(place.hold_s);
    steps.go(steps.at(-place.depth_m));
    steps.hold(place.hold_s);
    steps.go(steps.at(place.clearance_m));
  }
  return std::move(steps).done(ScriptedPath::Between::kSmooth);
}

ScriptedPath tap_path(const PathPlace& place) {
  PathPlace quick = place;
  quick.hold_s = 0.0;
  PathSteps steps(quick);
  for (int n = 0; n < place.times; ++n) {
    steps.go(steps.at(-place.depth_m));
    steps.go(steps.at(place.clearance_m));
  }
  return std::move(steps).done(ScriptedPath::Between::kSmooth);
}

ScriptedPath stroke_path(const PathPlace& place) {
  PathSteps steps(place);
  const double in = -place.depth_m;
  steps.hold(place.hold_s);
  steps.go(steps.at(in));
  for (int n = 0; n < place.times; ++n) {
    steps.go(steps.at(in, place.reach_m));
    steps.go(steps.at(in, -place.reach_m));
    steps.go(steps.at(in));
  }
  steps.go(steps.at(place.clearance_m));
  return std::move(steps).done(ScriptedPath::Between::kSmooth);
}

ScriptedPath circle_path(const PathPlace& place) {
  PathSteps steps(place);
  const double in = -place.depth_m, radius = place.reach_m;
  steps.hold(place.hold_s);
  steps.go(steps.at(in));
  steps.go(steps.at(in, radius));
  for (int n = 1; n <= kCorners * place.times; ++n) {
    const double angle = 2.0 * std::numbers::pi * n / kCorners;
    steps.go(steps.at(in, radius * std::cos(angle), radius * std::sin(angle)));
  }
  steps.go(steps.at(in));
  steps.go(steps.at(place.clearance_m));
  return std::move(steps).done(ScriptedPath::Between::kSmooth);
}

ScriptedPath sweep_path(const PathPlace& place) {
  PathSteps steps(place);
  steps.hold(place.hold_s);
  for (int n = 0; n < place.times; ++n) {
    steps.go(steps.at(-place.depth_m));
    steps.go(steps.at(place.clearance_m));
  }
  return std::move(steps).done(ScriptedPath::Between::kLinear);
}

Result<ScriptedPath> path_named(std::string_view name_or_file, const PathPlace& place) {
  if (name_or_file == "press") return press_path(place);
  if (name_or_file == "tap") return tap_path(place);
  if (name_or_file == "stroke") return stroke_path(place);
  if (name_or_file == "circle") return circle_path(place);
  if (name_or_file == "sweep") return sweep_path(place);
  const std::filesystem::path file(name_or_file);
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return Error{ErrorKind::kBadInput,
                 "'" + file.string() +
                     "' is no file and no path of ours: name a file, or one of press, tap, stroke, "
                     "circle, sweep"};
  }
  return read_path(file);
}

}  // namespace palpate::devices
