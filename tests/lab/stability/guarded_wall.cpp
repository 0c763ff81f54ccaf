#include "tests/lab/stability/guarded_wall.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "module/haptics/proxy/delay_lead.h"

namespace palpate::stability {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kStart_s = 2.2;  // of the start gate and its ramp
// After a gain was lowered once: it rises by 0.2 per second.
constexpr double kSettling_s = 8.0;
// Where the grip waits for the start.
constexpr double kOutside_m = 0.01;
constexpr double kStrength_n = 50.0;

/// Solid at x > 0, with an edge 1.5 mm soft.
class Block final : public FrameData {
 public:
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override { return 500.0 * std::erfc(-x.x / kSoft_m); }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    const double t = x.x / kSoft_m;
    return {1000.0 / (std::sqrt(std::numbers::pi) * kSoft_m) * std::exp(-t * t), 0.0, 0.0};
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3) const noexcept override { return glm::dmat3(0.0); }
  double detail_m() const noexcept override { return 1e-3; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-1.0); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(1.0); }

 private:
  static constexpr double kSoft_m = 1.06e-3;
};

std::shared_ptr<const Scene> wall_scene(double stiffness_n_per_m) {
  auto data = std::make_shared<MovingVolume>();
  data->name = "block";
  data->times.times_s = {0.0};
  data->frames = {std::make_shared<Block>()};
  SceneSpec spec;
  spec.stiffness_n_per_m = stiffness_n_per_m;
  VolumeSpec volume;
  volume.name = "block";
  spec.volumes = {volume};
  ModeSpec mode;
  mode.name = "wall";
  mode.volume = "block";
  mode.strength = *TransferFunction::stepped({0.0, 500.0}, {0.0, kStrength_n});
  spec.modes = {mode};
  auto scene = plan(spec, {data});
  if (!scene) throw std::runtime_error(scene.error().message);
  return *scene;
}

DeviceInfo device_of(const StabilityCase& at, bool knows) {
  DeviceInfo info;
  info.kind = "test";
  info.max_force_n = 8.0;
  info.workspace_radius_m = 10.0;
  info.resolution_m = at.resolution_m;
  info.delay_s = at.delay_s;
  if (knows)
    info.max_stiffness_n_per_m = stable_stiffness(at.body.damping_n_s_per_m, kPeriod_s, at.delay_s);
  return info;
}

}  // namespace

GuardedWall::GuardedWall(const StabilityCase& at, bool knows, const HapticsOptions& options)
    : haptics_(options, device_of(at, knows)) {
  haptics_.adopt(Haptics::prepare(wall_scene(at.stiffness_n_per_m)));
  for (double t = 0.0; t < kStart_s; t += kPeriod_s) push_n(-kOutside_m, kPeriod_s);
  heard_ = false;
}

double GuardedWall::push_n(double x_m, double dt_s) noexcept {
  input_.dt_s = dt_s;
  input_.now_ns += std::llround(1e9 * dt_s);
  input_.reading.time_ns = input_.now_ns;
  input_.reading.position_m = {x_m, 0.0, 0.0};
  input_.reading.fresh = true;
  const TickOutput out = haptics_.tick(input_);
  // The slow rise at a first contact, and what follows from it, is no fault.
  heard_ |=
      out.cause != Cause::kNone && out.cause != Cause::kFirstContact && out.cause != Cause::kReturn;
  return out.command.force_n.x;
}

StabilityResult run_guarded(const StabilityCase& at, bool knows, const HapticsOptions& options) {
  GuardedWall wall(at, knows, options);
  StabilityCase of = at;
  // The place and the speed at rest follow from the present stiffness.
  of.stiffness_n_per_m = wall.stiffness_n_per_m();
  of.settling_s = kSettling_s;
  WallLoop loop;
  loop.lead_share = DelayLead::kShare;
  loop.push_n = [&](double x_m, double dt_s) { return wall.push_n(x_m, dt_s); };
  loop.watch = [&] { wall.forget(); };
  StabilityResult result = run_stability(of, loop);
  result.heard = wall.heard();
  return result;
}

}  // namespace palpate::stability
