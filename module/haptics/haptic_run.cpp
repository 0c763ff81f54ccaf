#include "module/haptics/haptic_run.h"

#include <algorithm>

namespace palpate {

HapticRun::HapticRun(std::shared_ptr<const HapticScene> of) : scene(std::move(of)) {
  stiffness_n_per_m = wanted_stiffness_n_per_m = scene->stiffness_n_per_m;
  volumes.reserve(scene->volumes.size());
  for (const HapticVolume& volume : scene->volumes) {
    if (volume.posed) posed.push_back(int(volumes.size()));
    if (!volume.data->is_still()) playing.push_back(int(volumes.size()));
    volumes.emplace_back(volume);
  }
  for (const CarrierPlan& plan : scene->carriers) {
    CarrierRun run;
    run.carrier = make_carrier(plan, volumes[plan.volume]);
    run.carrier->carry();
    carriers.push_back(std::move(run));
  }
  for (const HapticMode& mode : scene->modes)
    modes.push_back({mode.spec.on ? 1.0 : 0.0, 1.0, 1.0, mode.spec.on});
}

void HapticRun::take_over(const HapticRun& before) noexcept {
  time_s = before.time_s;
  stiffness_n_per_m = before.stiffness_n_per_m;
  for (VolumeRun& volume : volumes)
    for (const VolumeRun& old : before.volumes) {
      if (old.plan->spec.name != volume.plan->spec.name) continue;
      if (old.plan->spec.path == volume.plan->spec.path) volume.pose = old.pose;
      volume.linear = old.linear;
      volume.inverse = old.inverse;
      volume.offset = old.offset;
      volume.least_scale = old.least_scale;
      volume.playback = old.playback;
      volume.playback.set_times(&volume.plan->data->times);
      volume.pointer = volume.playback.now();
    }
  for (size_t m = 0; m < modes.size(); ++m)
    for (size_t o = 0; o < before.modes.size(); ++o)
      if (before.scene->modes[o].spec.name == scene->modes[m].spec.name) {
        modes[m].weight = before.modes[o].weight;
        modes[m].gain = before.modes[o].gain;
        modes[m].wanted_gain = before.modes[o].wanted_gain;
        modes[m].on = before.modes[o].on;
      }
  for (CarrierRun& run : carriers) run.carrier->carry();
}

void HapticRun::place_proxy(glm::dvec3 world) noexcept {
  for (CarrierRun& run : carriers) {
    run.held = !run.carrier->go_to(world);
    run.fade = run.held ? 0.0 : 1.0;
  }
}

}  // namespace palpate
