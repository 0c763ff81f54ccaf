#include "module/scene/moving_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/support/fields.h"

namespace palpate {
namespace {

using testing::HasSubstr;

std::shared_ptr<const FrameData> frame() {
  const Grid grid = test::cube_grid(2, 1.0);
  return sampled_scalar({grid, std::vector<float>(grid.count(), 1.0F)});
}

MovingVolume beating() {
  MovingVolume volume;
  volume.name = "heart";
  volume.times = {{0.0, 0.25, 0.6}, 1.0};
  volume.frames = {frame(), frame(), frame()};
  const auto map = MotionMap::of(still_field(test::cube_grid(2, 1.0)));
  volume.motions = {{"data", {map, nullptr, map}}};
  return volume;
}

TEST(MovingVolume, IsAcceptedWhenItsPartsBelongTogether) {
  EXPECT_TRUE(check(beating()));
  MovingVolume once = beating();
  once.times.cycle_s = 0.0;
  once.motions[0].steps.pop_back();
  EXPECT_TRUE(check(once));
  MovingVolume still;
  still.frames = {frame()};
  still.times.times_s = {0.0};
  EXPECT_TRUE(check(still));
}

TEST(MovingVolume, IsRefusedWithTheReasonByName) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Grid grid = test::cube_grid(2, 1.0);
  const auto flow = sampled_vector(grid, std::vector<glm::vec3>(grid.count()));
  struct Case {
    std::function<void(MovingVolume&)> spoil;
    std::string says;
  };
  const std::vector<Case> cases{
      {[](MovingVolume& v) { v.frames.clear(); }, "no frames"},
      {[](MovingVolume& v) { v.times.times_s.pop_back(); }, "3 frames but 2 times"},
      {[](MovingVolume& v) { v.times.times_s[0] = 0.1; }, "first frame must be at 0 s"},
      {[](MovingVolume& v) { v.times.times_s[2] = 0.25; }, "frame 2 is not later"},
      {[=](MovingVolume& v) { v.times.times_s[1] = nan; }, "frame 1 is not later"},
      {[](MovingVolume& v) { v.times.cycle_s = 0.6; }, "cycle ends before"},
      {[=](MovingVolume& v) { v.times.cycle_s = nan; }, "length of its cycle"},
      {[](MovingVolume& v) { v.times.cycle_s = -1.0; }, "length of its cycle"},
      {[](MovingVolume& v) {
         v.frames.resize(1);
         v.times.times_s.resize(1);
       },
       "one frame can not repeat"},
      {[](MovingVolume& v) { v.frames[1] = nullptr; }, "frame 1 has no data"},
      {[=](MovingVolume& v) { v.frames[2] = flow; }, "frame 2 differs"},
      {[](MovingVolume& v) { v.motions[0].steps.pop_back(); }, "\"data\" has 2 fields"},
      {[](MovingVolume& v) { v.motions.push_back(v.motions[0]); }, "two of its motions"}};
  for (const Case& one : cases) {
    MovingVolume volume = beating();
    one.spoil(volume);
    const Status status = check(volume);
    ASSERT_FALSE(status) << one.says;
    EXPECT_EQ(status.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(status.error().message, HasSubstr("\"heart\""));
    EXPECT_THAT(status.error().message, HasSubstr(one.says));
  }
}

}  // namespace
}  // namespace palpate
