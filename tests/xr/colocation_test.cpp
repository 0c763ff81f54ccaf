// Co-location on values: whatever changes of origin the runtime makes, the world stays on the
// device.

#include "module/xr/colocation.h"

#include <gtest/gtest.h>

#include "tests/xr/random_pose.h"

namespace palpate::test {
namespace {

using xr::Colocation;
using xr::Pose;
using xr::Room;

/// 0.01 mm is the guarantee; here the only error is rounding in double.
constexpr double kPlace = 1e-9;

double apart(const Pose& a, const Pose& b, double reach_m = 1.0) {
  double worst = 0.0;
  for (const glm::dvec3 x : {glm::dvec3(0), glm::dvec3(reach_m, 0, 0), glm::dvec3(0, reach_m, 0)})
    worst = std::max(worst, glm::distance(a(x), b(x)));
  return worst;
}

/// A room that never moves; spaces in it do.
struct RoomModel {
  Pose room_from_stage, room_from_local, room_from_device, world_from_device;

  /// The distance of the picture from the device: the colocation's world compared with the true
  /// pose.
  double off(const Colocation& colocation, Room base) const {
    const Pose& room_from_base = base == Room::kStage ? room_from_stage : room_from_local;
    const Pose world_from_room = world_from_device * inverse(room_from_device);
    return apart(colocation.world_from(base), world_from_room * room_from_base);
  }
};

RoomModel model(Random& random) {
  return {random_pose(random, 2), random_pose(random, 2), random_pose(random, 1),
          random_pose(random, 0.3)};
}

void keep(Colocation& colocation, const RoomModel& room) {
  const Pose& base =
      colocation.base() == Room::kStage ? room.room_from_stage : room.room_from_local;
  colocation.keep(inverse(base) * room.room_from_device, room.world_from_device);
}

TEST(Colocation, StaysOnTheDeviceThroughRandomRecentring) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    RoomModel room = model(random);
    Colocation colocation;
    colocation.set_base(random.chance(0.5) ? Room::kStage : Room::kLocal);
    keep(colocation, room);
    int64_t time = 0;
    for (int i = 0; i < 100; ++i) {
      time += 11'111'111;
      const bool stage = random.chance(0.5);
      const Pose previous_from_new = random_pose(random, 1);
      const int64_t at = time + int64_t(random.draw(0, 5e7));
      colocation.change(stage ? Room::kStage : Room::kLocal, at, previous_from_new);
      Pose& moved = stage ? room.room_from_stage : room.room_from_local;
      // Before the time of the change the old origin is valid.
      colocation.advance(at - 1);
      ASSERT_LT(room.off(colocation, colocation.base()), kPlace) << "seed " << seed;
      moved = moved * previous_from_new;
      colocation.advance(at);
      colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
      ASSERT_LT(room.off(colocation, colocation.base()), kPlace) << "seed " << seed;
      time = at;
    }
    EXPECT_FALSE(colocation.doubtful());
    const Pose& base =
        colocation.base() == Room::kStage ? room.room_from_stage : room.room_from_local;
    EXPECT_LT(apart(colocation.room_from_device(), inverse(base) * room.room_from_device), kPlace)
        << "the pose that would be stored, seed " << seed;
  }
}

TEST(Colocation, TakesChangesOfOneTimeInTheOrderInWhichTheyWereSaid) {
  Random random(1);
  RoomModel room = model(random);
  Colocation colocation;
  keep(colocation, room);
  const Pose first = random_pose(random, 1), second = random_pose(random, 1);
  colocation.change(Room::kStage, 20, first);
  colocation.change(Room::kStage, 20, second);
  colocation.advance(20);
  room.room_from_stage = room.room_from_stage * first * second;
  EXPECT_LT(room.off(colocation, Room::kStage), kPlace);
}

TEST(Colocation, FindsTheStageAgainByTheLocalSpaceWhenTheRuntimeDoesNotSayHowItMoved) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    RoomModel room = model(random);
    Colocation colocation;
    keep(colocation, room);
    colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
    colocation.change(Room::kStage, 10, std::nullopt);
    room.room_from_stage = room.room_from_stage * random_pose(random, 1);
    colocation.advance(10);
    EXPECT_TRUE(colocation.doubtful()) << "doubtful until the place is found";
    colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
    EXPECT_FALSE(colocation.doubtful());
    EXPECT_LT(room.off(colocation, Room::kStage), kPlace) << "seed " << seed;
  }
}

TEST(Colocation, SaysThatItIsDoubtfulWhenNothingTellsWhereTheStageWent) {
  Random random(1);
  RoomModel room = model(random);
  Colocation colocation;
  keep(colocation, room);
  colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
  colocation.change(Room::kStage, 10, std::nullopt);
  colocation.change(Room::kLocal, 10, std::nullopt);
  colocation.advance(10);
  colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
  EXPECT_TRUE(colocation.doubtful());
  colocation.trust();
  EXPECT_FALSE(colocation.doubtful());
}

TEST(Colocation, KeepsTheStageFromSessionToSessionAndDoubtsItAfterARestart) {
  Random random(1);
  RoomModel room = model(random);
  Colocation colocation;
  keep(colocation, room);
  // Announced, and valid before the next session begins.
  const Pose moved = random_pose(random, 1);
  colocation.change(Room::kStage, 1000, moved);
  room.room_from_stage = room.room_from_stage * moved;
  colocation.begin_session(false);
  room.room_from_local = random_pose(random, 2);
  colocation.place_by(inverse(room.room_from_stage) * room.room_from_local);
  EXPECT_FALSE(colocation.doubtful());
  EXPECT_LT(room.off(colocation, Room::kStage), kPlace);
  EXPECT_LT(room.off(colocation, Room::kLocal), kPlace);
  colocation.begin_session(true);
  EXPECT_TRUE(colocation.doubtful());
  EXPECT_LT(room.off(colocation, Room::kStage), kPlace) << "the best guess is the last known place";
}

TEST(Colocation, FollowsTheRuntimeWhereThereIsNoDevice) {
  Random random(1);
  Colocation colocation;
  colocation.change(Room::kLocal, 10, random_pose(random, 1));
  colocation.advance(10);
  colocation.place_by(random_pose(random, 1));
  EXPECT_EQ(apart(colocation.world_from(Room::kLocal), {}), 0.0);
  EXPECT_EQ(apart(colocation.world_from(Room::kStage), {}), 0.0);
  EXPECT_FALSE(colocation.doubtful());
}

}  // namespace
}  // namespace palpate::test
