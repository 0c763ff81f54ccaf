#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "compute/volume/phantom.h"
#include "module/haptics/proxy/haptics.h"
#include "module/scene/moving_volume.h"

namespace palpate::stability {

/// The beating shell without texture, so that its surface is known exactly: a ball of value 1000 in
/// 0, of radius kOuterMm in the smallest state, moved as the heart phantom moves. Edges are 1.5
/// voxels soft. Its surface, the value 500, is a sphere at all times.
constexpr double kOuterMm = 25.0;

/// The sphere's radius in frame k of n, mm.
inline double shell_radius_mm(int k, int n) {
  return shell_point({kOuterMm, 0.0, 0.0}, 0, k, n).x;
}

inline Volume shell_frame(const Grid& grid, int k, int n) {
  Volume frame{grid, std::vector<float>(grid.count())};
  const double soft = 1.06 * grid.finest_mm();
  const double radius = shell_radius_mm(k, n);
  for (int z = 0; z < grid.size.z; ++z)
    for (int y = 0; y < grid.size.y; ++y)
      for (int x = 0; x < grid.size.x; ++x) {
        const double r = glm::length(grid.lps_from_index({x, y, z}));
        frame.values[grid.offset(x, y, z)] = float(500.0 * std::erfc((r - radius) / soft));
      }
  return frame;
}

/// The same frame as a formula: the remaining error with it is that of the method.
class Ball final : public FrameData {
 public:
  Ball(double radius_m, double soft_m) : radius_m_(radius_m), soft_m_(soft_m) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override {
    return 500.0 * std::erfc((glm::length(x) - radius_m_) / soft_m_);
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    const double r = glm::length(x), t = (r - radius_m_) / soft_m_;
    return r > 0.0
               ? x * (-500.0 * 2.0 / std::sqrt(std::numbers::pi) * std::exp(-t * t) / (soft_m_ * r))
               : glm::dvec3(0.0);
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-0.048); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(0.048); }

 private:
  double radius_m_, soft_m_;
};

inline Grid shell_grid(double spacing_mm) {
  Grid grid;
  const int n = int(std::lround(96.0 / spacing_mm));
  grid.size = glm::ivec3(n);
  grid.spacing_mm = glm::dvec3(spacing_mm);
  grid.origin_mm = glm::dvec3(-0.5 * spacing_mm * (n - 1));
  return grid;
}

/// The form of the shell's frames. Their motion is sampled at the same spacing in both cases.
enum class Made { kSampled, kAnalytic };

/// n frames (1: still, in its smallest state), cyclic, at this many frames per second.
inline std::shared_ptr<const MovingVolume> shell(int n, double frames_per_second,
                                                 Made made = Made::kAnalytic,
                                                 double spacing_mm = 1.0) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  const Grid grid = shell_grid(spacing_mm);
  Motion motion{"data", {}};
  for (int k = 0; k < n; ++k) {
    if (made == Made::kSampled)
      volume->frames.push_back(sampled_scalar(shell_frame(grid, k, n)));
    else
      volume->frames.push_back(
          std::make_shared<Ball>(1e-3 * shell_radius_mm(k, n), 1.06e-3 * spacing_mm));
    volume->times.times_s.push_back(k / frames_per_second);
    if (n > 1) motion.steps.push_back(MotionMap::of(shell_truth(grid, k, (k + 1) % n, n)));
  }
  if (n > 1) {
    volume->times.cycle_s = n / frames_per_second;
    volume->motions.push_back(motion);
  }
  return volume;
}

/// The exact radius at a frame pointer, m: between frames the material moves along a straight line.
inline double shell_radius_m(FramePointer at, int n) {
  return 1e-3 * (shell_radius_mm(at.frame, n) + at.phase * (shell_radius_mm((at.frame + 1) % n, n) -
                                                            shell_radius_mm(at.frame, n)));
}

/// A scene of one shell with one surface: a step of `strength_n` at its edge.
inline SceneSpec shell_spec(double strength_n, double friction, double stiffness_n_per_m) {
  SceneSpec spec;
  spec.stiffness_n_per_m = stiffness_n_per_m;
  VolumeSpec volume;
  volume.name = "shell";
  spec.volumes = {volume};
  ModeSpec mode;
  mode.name = "wall";
  mode.volume = "shell";
  mode.strength = *TransferFunction::stepped({0.0, 500.0}, {0.0, strength_n});
  mode.friction = TransferFunction::constant(friction);
  spec.modes = {mode};
  return spec;
}

/// Options without active guards: tests see the scene's own force, at the exact place of the hand.
inline HapticsOptions unmetered() {
  HapticsOptions options;
  options.meter_energy = false;
  options.lead = false;
  return options;
}

/// Drives a step with positions, one millisecond after the other.
class Hand {
 public:
  explicit Hand(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data,
                const HapticsOptions& options = unmetered())
      : haptics(options, device()) {
    auto scene = plan(spec, std::move(data));
    if (!scene) throw std::runtime_error(scene.error().message);
    haptics.adopt(Haptics::prepare(*scene));
  }
  TickOutput to(glm::dvec3 probe_m) {
    input.now_ns += 1'000'000;
    input.dt_s = 1e-3;
    input.reading.position_m = probe_m;
    input.reading.time_ns = input.now_ns;
    input.reading.fresh = true;
    const TickOutput out = haptics.tick(input);
    input.event_count = input.pose_count = 0;
    return out;
  }
  static DeviceInfo device() {
    DeviceInfo info;
    info.kind = "test";
    info.max_force_n = 10.0;
    info.workspace_radius_m = 1.0;
    return info;
  }
  Haptics haptics;
  TickInput input;
};

}  // namespace palpate::stability
