// Oracle: motions whose place at any time is given by a formula.
#include "module/haptics/scene/snapshot_ahead.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::test {
namespace {

SceneSnapshot snapshot_at(int64_t ns, const Transform& place) {
  SceneSnapshot snapshot;
  snapshot.now_ns = ns;
  snapshot.volume_count = 1;
  snapshot.volumes[0].world_from_volume = place;
  return snapshot;
}

/// Translates, rotates and grows at constant rates.
Transform moving(double t) {
  Transform place;
  place.translation_m = glm::dvec3(0.1, -0.2, 0.3) + t * glm::dvec3(0.2, 0.1, -0.3);
  place.rotation = glm::angleAxis(1.5 * t, glm::normalize(glm::dvec3(1.0, 2.0, -1.0)));
  place.scale = glm::dvec3(0.5 * std::exp(0.4 * t));
  return place;
}

TEST(SnapshotAhead, MeetsAnEvenMotionAtTheTimeOfDisplay) {
  SnapshotAhead ahead;
  for (int k = 0; k < 200; ++k) {
    const int64_t now_ns = 1'000'000'000 + int64_t(11'000'000) * k;
    const SceneSnapshot then =
        ahead.at(snapshot_at(now_ns, moving(1e-9 * double(now_ns))), now_ns + 25'000'000);
    if (k < 1) continue;
    const Transform expected = moving(1e-9 * double(now_ns + 25'000'000));
    const Transform& found = then.volumes[0].world_from_volume;
    // Rounding of differences over 11 ms, multiplied by 2.3.
    EXPECT_LE(glm::distance(found.translation_m, expected.translation_m), 1e-12) << k;
    EXPECT_LE(1.0 - std::abs(glm::dot(found.rotation, expected.rotation)), 1e-12) << k;
    EXPECT_LE(std::abs(found.scale.x - expected.scale.x), 1e-12) << k;
    EXPECT_EQ(then.now_ns, now_ns);
  }
}

TEST(SnapshotAhead, LeavesWhatStandsStillToTheBit) {
  SnapshotAhead ahead;
  const Transform place = moving(0.7);
  for (int k = 0; k < 20; ++k) {
    const int64_t now_ns = 1'000'000'000 + int64_t(7'000'000) * k;
    EXPECT_EQ(
        ahead.at(snapshot_at(now_ns, place), now_ns + 20'000'000).volumes[0].world_from_volume,
        place);
  }
}

TEST(SnapshotAhead, DoesNotGuessFarOrFromLongAgo) {
  SnapshotAhead ahead;
  ahead.at(snapshot_at(1'000'000'000, moving(1.0)), 1'000'000'000);
  // After two seconds without a snapshot the speed is unknown.
  EXPECT_EQ(
      ahead.at(snapshot_at(3'000'000'000, moving(3.0)), 3'020'000'000).volumes[0].world_from_volume,
      moving(3.0));
  // With the next one it is known. A display time one second ahead is limited to 50 ms ahead.
  const Transform found = ahead.at(snapshot_at(3'010'000'000, moving(3.01)), 4'000'000'000)
                              .volumes[0]
                              .world_from_volume;
  EXPECT_LE(glm::distance(found.translation_m, moving(3.06).translation_m), 1e-12);
}

}  // namespace
}  // namespace palpate::test
