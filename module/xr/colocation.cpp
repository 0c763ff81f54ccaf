#include "module/xr/colocation.h"

#include <algorithm>

namespace palpate::xr {

void Colocation::keep(const Pose& room_from_device, const Pose& world_from_device) {
  keeps_ = true;
  world_from_device_ = world_from_device;
  for (RoomPlace& place : places_) place.known = false;
  places_[size_t(base_)] = {world_from_device * inverse(room_from_device), true};
}

void Colocation::follow(const Pose& world_from_base) {
  keeps_ = false;
  for (RoomPlace& place : places_) place = {world_from_base, true};
}

void Colocation::change(Room room, int64_t change_time_ns, std::optional<Pose> previous_from_new) {
  // Sorted by time; those of the same time stay in the order in which they were announced.
  const auto later = std::upper_bound(
      pending_.begin(), pending_.end(), change_time_ns,
      [](int64_t time, const RoomChange& pending) { return time < pending.time_ns; });
  pending_.insert(later, {room, change_time_ns, previous_from_new});
}

void Colocation::advance(int64_t time_ns) {
  while (!pending_.empty() && pending_.front().time_ns <= time_ns) {
    const RoomChange change = pending_.front();
    pending_.erase(pending_.begin());
    if (!keeps_) continue;
    RoomPlace& place = places_[size_t(change.room)];
    if (change.previous_from_new)
      place.world_from_space = place.world_from_space * *change.previous_from_new;
    else
      place.known = false;
  }
}

void Colocation::place_by(const Pose& stage_from_local) {
  if (!keeps_) return;
  RoomPlace& stage = places_[size_t(Room::kStage)];
  RoomPlace& local = places_[size_t(Room::kLocal)];
  if (stage.known)
    local = {stage.world_from_space * stage_from_local, true};
  else if (local.known)
    stage = {local.world_from_space * inverse(stage_from_local), true};
}

void Colocation::begin_session(bool runtime_restarted) {
  // The new session finds the spaces with all changes that were announced to the session before.
  if (!pending_.empty()) advance(pending_.back().time_ns);
  places_[size_t(Room::kLocal)].known = false;
  if (runtime_restarted) places_[size_t(Room::kStage)].known = false;
}

Pose Colocation::room_from_device() const {
  return inverse(world_from_base()) * world_from_device_;
}

}  // namespace palpate::xr
