#include "module/haptics/scene_ticker.h"

#include <algorithm>

namespace palpate {

SceneTicker::~SceneTicker() {
  // The handover owns every run, the step only borrows one.
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
  SceneMoment moment;
  moment.now_ns = input.now_ns;
  moment.volume_count = std::min(int(run->volumes.size()), SceneMoment::kMostVolumes);
  for (int v = 0; v < moment.volume_count; ++v) {
    const VolumeRun& volume = run->volumes[size_t(v)];
    moment.volumes[size_t(v)] = {volume.transform, volume.playback.time_s(),
                                 volume.playback.rate()};
  }
  moment.probe_m = output.probe_m;
  moment.proxy_m = output.proxy_m;
  moment.force_n = run->scene->world_from_device.rotation * output.command.force_n;
  moment.cause = output.cause;
  moment.in_contact = output.command.in_contact;
  for (Newest<SceneMoment>& reader : moments_) reader.put(moment);
  if (const auto kind = button_.step(input.reading, input.now_ns)) commands_.push({*kind, moment});
  for (int e = 0; e < std::min(input.event_count, int(input.events.size())); ++e)
    if (const auto kind = command_of(input.events[size_t(e)])) commands_.push({*kind, moment});
}

}  // namespace palpate
