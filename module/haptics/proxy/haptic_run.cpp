#include "module/haptics/proxy/haptic_run.h"

#include <algorithm>
#include <cmath>

#include "module/haptics/guard/force_rates.h"
#include "module/scene/drive.h"

namespace palpate {
namespace {

constexpr double kSwitchRamp_s = 0.1;     // of a mode switched on or off, or the gain changed by 1
constexpr double kFade_s = 0.020;         // of a carrier whose point is lost
constexpr double kStiffness_per_s = 5.0;  // a change of stiffness, as a share of itself

double towards(double from, double to, double by) {
  return from < to ? std::min(to, from + by) : std::max(to, from - by);
}

/// A factor on a strength of `unit_n` on its way to what is wanted, by at most `most_n`. What lies
/// above `felt_n` can not be felt, and is left out at once.
double ramped(double from, double to, double unit_n, double felt_n, double dt_s, double most_n) {
  if (from == to) return to;
  if (to < from) from = std::max(to, std::min(from, felt_n / unit_n));
  return towards(from, to, std::min(dt_s / kSwitchRamp_s, most_n / unit_n));
}

/// Whether a surface is still where it was, in data and in space.
bool unmoved(const VolumeRun& a, const VolumeRun& b) {
  const MovingVolume &data = *a.plan->data, &other = *b.plan->data;
  const bool same_motion =
      data.whole == other.whole || (data.whole_before && data.whole_before == other.whole &&
                                    a.blended == 0.0 && b.blended == 1.0);
  return data.frames == other.frames && same_motion && a.transform == b.transform;
}

}  // namespace

void CarrierRun::follow_to(glm::dvec3 proxy, double felt_n, double dt_s) noexcept {
  if (frozen || carrier->at() != proxy) frozen = !carrier->go_to(proxy);
  if (frozen && !std::isfinite(cap_n)) cap_n = felt_n;
  const double whole_s = std::isfinite(cap_n) ? std::max(kFade_s, cap_n / kFade_n_per_s) : kFade_s;
  if (frozen) {
    fade = std::max(0.0, fade - dt_s / whole_s);
  } else if (fade < 1.0) {
    fade = std::min(1.0, fade + dt_s / whole_s);
    if (fade == 1.0) cap_n = std::numeric_limits<double>::infinity();
  }
}

HapticRun::HapticRun(std::shared_ptr<const Scene> of) : scene(std::move(of)) {
  stiffness_n_per_m = wanted_stiffness_n_per_m = scene->stiffness_n_per_m;
  volumes.reserve(scene->volumes.size());
  for (const SceneVolume& volume : scene->volumes) {
    if (volume.is_posed()) posed.push_back(int(volumes.size()));
    if (!volume.is_still()) playing.push_back(int(volumes.size()));
    volumes.emplace_back(volume);
  }
  for (size_t i = 0; i < scene->points_m.size(); ++i) {
    PointRun point;
    for (const SceneCarrier& plan : scene->carriers) {
      CarrierRun run;
      run.carrier = make_carrier(plan, volumes[plan.volume], scene->tool_radius_m);
      run.carrier->carry();
      point.carriers.push_back(std::move(run));
    }
    point.modes.resize(scene->modes.size());
    point.material_steps.resize(scene->carriers.size());
    points.push_back(std::move(point));
  }
  for (const SceneMode& mode : scene->modes) {
    ModeRun run;
    run.on = mode.spec.on;
    run.weight = run.on ? 1.0 : 0.0;
    modes.push_back(run);
  }
}

void HapticRun::take_over(const HapticRun& before) noexcept {
  time_s = before.time_s;
  stiffness_n_per_m = before.stiffness_n_per_m;
  for (VolumeRun& volume : volumes)
    for (const VolumeRun& old : before.volumes) {
      if (old.plan->spec.name != volume.plan->spec.name) continue;
      const VolumeSpec& spec = volume.plan->spec;
      if (old.plan->is_posed() || volume.plan->is_posed()) volume.set(old.transform);
      volume.pose =
          old.plan->spec.path == spec.path ? old.pose : MovingPose(spec.path, volume.transform);
      if (volume.plan->pose == PoseStage::kDrive)
        volume.set(driven(spec.drive, spec.transform, time_s));
      volume.playback = old.playback;
      volume.playback.set_times(&volume.plan->data->times);
      volume.pointer = volume.playback.now();
      if (volume.plan->data == old.plan->data) volume.blended = old.blended;
    }
  for (size_t m = 0; m < modes.size(); ++m) {
    modes[m].weight = 0.0;
    for (size_t o = 0; o < before.modes.size(); ++o) {
      const SceneMode &mode = scene->modes[m], &old = before.scene->modes[o];
      if (old.spec.name != mode.spec.name) continue;
      modes[m] = before.modes[o];
      const VolumeRun& volume = volumes[scene->carriers[mode.carrier].volume];
      const bool rests =
          unmoved(volume, before.volumes[before.scene->carriers[old.carrier].volume]);
      for (size_t i = 0; i < std::min(points.size(), before.points.size()); ++i) {
        points[i].modes[m] = before.points[i].modes[o];
        points[i].modes[m].on_surface &= rests;
      }
    }
  }
  for (PointRun& point : points)
    for (CarrierRun& run : point.carriers) run.carrier->carry();
}

void PointRun::place_proxy(glm::dvec3 world) noexcept {
  for (CarrierRun& run : carriers) {
    run.frozen = !run.carrier->put(world);
    run.fade = run.frozen ? 0.0 : 1.0;
    run.material_m = world;
  }
}

void HapticRun::ramp(double dt_s, double felt_n) noexcept {
  double placed_n = 0.0;
  int ramping = stiffness_n_per_m != wanted_stiffness_n_per_m;
  // Of the points of a tool the one at which most is placed counts.
  const auto placed_by = [this](size_t m) {
    double most_n = 0.0;
    for (const PointRun& point : points) most_n = std::max(most_n, point.modes[m].placed_n);
    return most_n;
  };
  for (size_t m = 0; m < modes.size(); ++m) {
    const ModeRun& mode = modes[m];
    placed_n += placed_by(m) * mode.weight * mode.gain;
    ramping += (mode.weight != mode.wanted_weight()) + (mode.gain != mode.wanted_gain);
  }
  const double share_n_per_s = kRamp_n_per_s / std::max(ramping, 1);
  const double share_n = share_n_per_s * dt_s;
  for (size_t m = 0; m < modes.size(); ++m) {
    ModeRun& mode = modes[m];
    if (!mode.ramps()) continue;
    // In balance with hand and other modes: it gives no more than they.
    const double own_n = placed_by(m);
    const double most_n = felt_n + placed_n - own_n * mode.weight * mode.gain;
    const double unit_n =
        std::max(own_n > 0.0 ? own_n : scene->modes[m].spec.strength.highest(), 1e-3);
    mode.weight = ramped(mode.weight, mode.wanted_weight(), unit_n * std::max(mode.gain, 1e-3),
                         most_n, dt_s, share_n);
    mode.gain = ramped(mode.gain, mode.wanted_gain, unit_n * std::max(mode.weight, 1e-3), most_n,
                       dt_s, share_n);
  }
  const double share_per_s = std::min(kStiffness_per_s, share_n_per_s / std::max(felt_n, 1e-3));
  stiffness_n_per_m =
      towards(stiffness_n_per_m, wanted_stiffness_n_per_m, share_per_s * dt_s * stiffness_n_per_m);
}

}  // namespace palpate
