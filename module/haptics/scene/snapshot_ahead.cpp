#include "module/haptics/scene/snapshot_ahead.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr int64_t kApart_ns = 4'000'000;     // closer snapshots differ by little but rounding
constexpr int64_t kTooOld_ns = 300'000'000;  // older snapshots say nothing about now
constexpr double kFurthest_s = 0.05;

/// The turn q taken `share` times.
glm::dquat times(glm::dquat q, double share) {
  if (q.w < 0.0) q = -q;
  const double sine = glm::length(glm::dvec3(q.x, q.y, q.z));
  if (sine < 1e-12) return {1.0, 0.0, 0.0, 0.0};
  const double angle = 2.0 * std::atan2(sine, q.w);
  return glm::angleAxis(share * angle, glm::dvec3(q.x, q.y, q.z) / sine);
}

Transform ahead(const Transform& before, const Transform& now, double share) {
  if (before == now) return now;
  Transform then;
  then.translation_m = now.translation_m + share * (now.translation_m - before.translation_m);
  then.rotation =
      glm::normalize(times(now.rotation * glm::conjugate(before.rotation), share) * now.rotation);
  for (int a = 0; a < 3; ++a)
    then.scale[a] = now.scale[a] * std::pow(now.scale[a] / before.scale[a], share);
  return then;
}

}  // namespace

SceneSnapshot SnapshotAhead::at(const SceneSnapshot& snapshot, int64_t display_ns) {
  if (snapshot.now_ns - newest_.now_ns >= kApart_ns) {
    before_ = newest_;
    newest_ = snapshot;
  }
  const int64_t apart_ns = snapshot.now_ns - before_.now_ns;
  const bool known = before_.volume_count == snapshot.volume_count && apart_ns >= kApart_ns &&
                     apart_ns <= kTooOld_ns;
  if (!known) return snapshot;
  const double ahead_s = std::clamp(1e-9 * double(display_ns - snapshot.now_ns), 0.0, kFurthest_s);
  const double share = ahead_s / (1e-9 * double(apart_ns));
  SceneSnapshot then = snapshot;
  for (int v = 0; v < snapshot.volume_count; ++v)
    then.volumes[size_t(v)].world_from_volume =
        ahead(before_.volumes[size_t(v)].world_from_volume,
              snapshot.volumes[size_t(v)].world_from_volume, share);
  return then;
}

}  // namespace palpate
