#include "tests/lab/stability/paper_loop.h"

#include <stdexcept>

#include "module/haptics/proxy/balance.h"
#include "module/scene/drive.h"

namespace palpate::stability {
namespace {

std::shared_ptr<const Scene> assembled(const SceneSpec& spec,
                                       std::vector<std::shared_ptr<const MovingVolume>> data) {
  auto scene = plan(spec, std::move(data));
  if (!scene) throw std::runtime_error(scene.error().message);
  return *scene;
}

}  // namespace

TickOutput PaperLoop::tick(const TickInput& input) noexcept {
  TickOutput out;
  const glm::dvec3 probe = input.reading.position_m;
  if (!started_) run_.points[0].place_proxy(probe);
  started_ = true;
  run_.time_s += input.dt_s;
  for (int p = 0; p < input.pose_count; ++p)
    run_.volumes[size_t(input.poses[size_t(p)].volume)].pose.add(input.poses[size_t(p)].transform,
                                                                 input.poses[size_t(p)].time_ns);
  for (const int v : run_.posed) {
    VolumeRun& volume = run_.volumes[size_t(v)];
    const VolumeSpec& spec = volume.plan->spec;
    volume.set(spec.path == PosePath::kExact && spec.drive.kind != DriveSpec::Kind::kSecondHand
                   ? driven(spec.drive, spec.transform, run_.time_s)
                   : volume.pose.at(input.now_ns));
  }
  for (const int v : run_.playing) {
    VolumeRun& volume = run_.volumes[size_t(v)];
    volume.pointer = volume.playback.step(input.dt_s);
    volume.crossed = volume.playback.crossed();
  }
  placed_.set.clear();
  for (CarrierRun& carrier : run_.points[0].carriers) carrier.carrier->carry();
  for (const SceneMode& mode : run_.scene->modes)
    run_.points[0].carriers[size_t(mode.carrier)].carrier->place(mode, probe, input.dt_s, 1.0, 1e9,
                                                                 placed_);
  out.proxy_m = balance(placed_.set, probe, run_.stiffness_n_per_m).proxy;
  // If the fixed point does not converge, the paper continues with the better guess.
  for (CarrierRun& carrier : run_.points[0].carriers) carrier.carrier->go_to(out.proxy_m);
  out.primitives = uint8_t(placed_.set.count());
  out.probe_m = probe;
  out.wanted_n = run_.stiffness_n_per_m * (out.proxy_m - probe);
  if (!run_.playing.empty()) out.first = run_.volumes[size_t(run_.playing.front())].pointer;
  return out;
}

PaperHand::PaperHand(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data)
    : loop(assembled(spec, std::move(data))) {}

TickOutput PaperHand::to(glm::dvec3 probe_m) {
  input.now_ns += 1'000'000;
  input.dt_s = 1e-3;
  input.reading.position_m = probe_m;
  input.reading.time_ns = input.now_ns;
  input.reading.fresh = true;
  const TickOutput out = loop.tick(input);
  input.pose_count = 0;
  return out;
}

}  // namespace palpate::stability
