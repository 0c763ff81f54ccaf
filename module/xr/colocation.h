#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "module/xr/pose.h"

namespace palpate::xr {

/// Spaces of a runtime that stay in the room. kLocal: the one whose origin is where the person is,
/// at the head or on the floor.
enum class Room : uint8_t { kStage, kLocal };

/// Where the runtime's spaces lie in the world of the scene, so that the picture stays on the force
/// device. A value without a clock or a runtime.
///
/// The device stands still in the room. When the person recentres, the runtime moves the origin of
/// a space: x_previous = previous_from_new(x_new) from a change time on. With a device in the world
/// the world must not follow: world_from_new = world_from_previous * previous_from_new, which
/// leaves the world where it was in the room. Without a device the person wants to be followed, and
/// world_from_space stays as it is.
class Colocation {
 public:
  /// The device is at room_from_device in the base space and at world_from_device in the scene:
  /// from now on the world stays with the device.
  void keep(const Pose& room_from_device, const Pose& world_from_device);
  /// No device in the room: the world follows the runtime's origin, with the given offset, until
  /// the next keep() or follow().
  void follow(const Pose& world_from_base = {});
  bool keeps() const { return keeps_; }

  /// The origin of `room` moves at change_time_ns (any clock, the same in every call). Without
  /// previous_from_new the runtime does not know by how much: the next place_by() repairs it.
  void change(Room room, int64_t change_time_ns, std::optional<Pose> previous_from_new);

  /// The space that frames are located in: the stage where there is one.
  void set_base(Room base) { base_ = base; }
  Room base() const { return base_; }

  /// A frame shown at time_ns begins: changes up to then take place.
  void advance(int64_t time_ns);

  /// The runtime says that stage_from_local at this time. Keeps the two consistent: the one whose
  /// place in the world is known determines the other's.
  void place_by(const Pose& stage_from_local);

  /// A new session begins: the stage is taken to be where it was (runtimes keep it with the room),
  /// the local space is wherever the person is now. `runtime_restarted`: the stage too may have
  /// moved, and doubtful() then says so.
  void begin_session(bool runtime_restarted);

  Pose world_from_base() const { return places_[size_t(base_)].world_from_space; }
  Pose world_from(Room room) const { return places_[size_t(room)].world_from_space; }
  /// The calibration as it is now, to be stored together with the name of the base space.
  Pose room_from_device() const;
  /// The device may not be where the picture is: have one point touched (Calibration's check), then
  /// call keep() again or trust().
  bool doubtful() const { return keeps_ && !places_[size_t(base_)].known; }
  void trust() { places_[size_t(base_)].known = true; }

 private:
  struct RoomPlace {
    Pose world_from_space;
    bool known = true;
  };
  struct RoomChange {
    Room room;
    int64_t time_ns;
    std::optional<Pose> previous_from_new;
  };

  bool keeps_ = false;
  Room base_ = Room::kStage;
  Pose world_from_device_;
  RoomPlace places_[2];
  std::vector<RoomChange> pending_;
};

}  // namespace palpate::xr
