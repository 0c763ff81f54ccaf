#include "module/haptics/scene_ticker.h"

#include <algorithm>

namespace palpate {

SceneTicker::~SceneTicker() {
  // The handover owns every run; the haptic step only borrows one.
  haptics_.adopt(nullptr).release();
}

bool SceneTicker::offer(std::shared_ptr<const Scene> scene) {
  auto run = Haptics::prepare(std::move(scene));
  return handover_.offer(run);
}

TickOutput SceneTicker::tick(const TickInput& input) noexcept {
  if (HapticRun* next = handover_.take())
    handover_.retire(haptics_.adopt(std::unique_ptr<HapticRun>(next)).release());
  const TickOutput output = haptics_.tick(input);
  publish(input, output);
  return output;
}

void SceneTicker::publish(const TickInput& input, const TickOutput& output) noexcept {
  const HapticRun* run = haptics_.run();
  if (!run) return;
  SceneSnapshot snapshot;
  snapshot.now_ns = input.now_ns;
  snapshot.volume_count = std::min(int(run->volumes.size()), SceneSnapshot::kMostVolumes);
  for (int v = 0; v < snapshot.volume_count; ++v) {
    const VolumeRun& volume = run->volumes[size_t(v)];
    snapshot.volumes[size_t(v)] = {volume.transform, volume.playback.time_s(),
                                   volume.playback.rate()};
  }
  snapshot.probe_m = output.probe_m;
  snapshot.proxy_m = output.proxy_m;
  snapshot.shaft = run->scene->world_from_device.rotation * shaft_of(input.reading.grip);
  snapshot.force_n = run->scene->world_from_device.rotation * output.command.force_n;
  snapshot.cause = output.cause;
  snapshot.in_contact = output.command.in_contact;
  snapshot.points = haptics_.points();
  for (Newest<SceneSnapshot>& reader : snapshots_) reader.put(snapshot);
  if (const auto kind = button_.step(input.reading, input.now_ns))
    commands_.push({*kind, snapshot});
  for (int e = 0; e < std::min(input.event_count, int(input.events.size())); ++e)
    if (const auto kind = command_of(input.events[size_t(e)])) commands_.push({*kind, snapshot});
}

}  // namespace palpate
