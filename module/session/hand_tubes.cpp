#include "module/session/hand_tubes.h"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {

std::string HandTubes::take(const HandCommand& command, const Scene& scene) {
  switch (command.kind) {
    case HandCommand::Kind::kReleaseTube:
      return release(scene, command.snapshot);
    case HandCommand::Kind::kKeepTubes: {
      auto kept = std::make_shared<ReleasedTubes>(*tubes_);
      for (ReleasedTube& tube : *kept) tube.kept = true;
      tubes_ = std::move(kept);
      return {};
    }
    case HandCommand::Kind::kClearTubes:
      clear();
      return {};
  }
  return {};
}

std::string HandTubes::release(const Scene& scene, const SceneSnapshot& snapshot) {
  std::string why = "nothing here has a direction: neither vectors nor motion";
  for (size_t v = 0; v < scene.volumes.size() && int(v) < snapshot.volume_count; ++v) {
    const SceneVolume& volume = scene.volumes[v];
    const auto field = tube_field(scene, v);
    if (!field) continue;
    const VolumeSnapshot& now = snapshot.volumes[v];
    auto tube = StreamTube::release(volume.data, volume.blends, *field,
                                    pointer_at(volume.data->times, now.time_s),
                                    now.world_from_volume.volume_from_world(snapshot.proxy_m));
    if (!tube) {
      why = tube.error().message;
      continue;
    }
    auto all = std::make_shared<ReleasedTubes>(*tubes_);
    if (all->size() >= kMost) {
      const auto oldest =
          std::find_if(all->begin(), all->end(), [](const ReleasedTube& one) { return !one.kept; });
      if (oldest == all->end())
        return fmt::format("No stream tube: {} are kept already. Clear them first.", kMost);
      all->erase(oldest);
    }
    all->push_back({v, false, std::make_shared<const StreamTube>(std::move(*tube))});
    tubes_ = std::move(all);
    return {};
  }
  return "No stream tube: " + why + ".";
}

void HandTubes::clear() {
  auto left = std::make_shared<ReleasedTubes>();
  for (const ReleasedTube& tube : *tubes_)
    if (tube.kept) left->push_back(tube);
  if (left->size() == tubes_->size()) left->clear();
  tubes_ = std::move(left);
}

std::string HandTubes::follow(const Scene& scene, const SceneSnapshot& now) {
  const auto is_at_home = [&](const ReleasedTube& tube) {
    return tube.volume < scene.volumes.size() &&
           scene.volumes[tube.volume].data == tube.tube->data();
  };
  if (std::all_of(tubes_->begin(), tubes_->end(), is_at_home)) return {};
  auto all = std::make_shared<ReleasedTubes>();
  size_t lost = 0;
  for (ReleasedTube tube : *tubes_) {
    if (!is_at_home(tube)) {
      std::optional<StreamTube> moved;
      if (tube.volume < scene.volumes.size() && int(tube.volume) < now.volume_count) {
        const auto& data = scene.volumes[tube.volume].data;
        moved = tube.tube->moved_to(data, pointer_at(data->times, now.volumes[tube.volume].time_s));
      }
      if (!moved) {
        ++lost;
        continue;
      }
      tube.tube = std::make_shared<const StreamTube>(std::move(*moved));
    }
    all->push_back(std::move(tube));
  }
  tubes_ = std::move(all);
  if (lost == 0) return {};
  return fmt::format("{} stream tube{} could not be taken along to the new motion.", lost,
                     lost == 1 ? "" : "s");
}

}  // namespace palpate
