#include "integration/headset/scene_hands.h"

#include <algorithm>
#include <cmath>

namespace palpate::headset {
namespace {

constexpr double kScrubPerSecond = 0.25;  // of the sequence, with the stick pushed all the way
constexpr double kDeadZone = 0.15;        // of the stick
constexpr double kTap_s = 0.3;            // a shorter press removes the cut

/// The transform that moves a thing from `before` to `after`; both are similarities.
Transform moved_between(const Transform& before, const Transform& after) {
  Transform moved;
  moved.scale = after.scale / before.scale;
  moved.rotation = glm::normalize(after.rotation * glm::conjugate(before.rotation));
  moved.translation_m = after.translation_m - moved.rotation * (moved.scale * before.translation_m);
  return moved;
}

}  // namespace

void SceneHands::step(const xr::Hands& hands, const SceneSnapshot& snapshot, double dt_s) {
  const Transform dragged = grab_.drag(world_from_start_, hands);
  if (grab_.holds()) move_to(dragged);
  hold_cut(hands, dt_s);
  if (hands.play_pause) session_.toggle_play();
  if (std::abs(hands.scrub) > kDeadZone)
    session_.scrub(snapshot, hands.scrub * kScrubPerSecond * dt_s);
  if (hands.preset_steps != 0) next_look(hands.preset_steps);
}

void SceneHands::bring(glm::dvec3 centre_m, glm::dvec3 target_m, glm::dvec3 viewer_m) {
  const glm::dvec3 at_start = world_from_start_.volume_from_world(centre_m);
  move_to(xr::brought_to(world_from_start_, at_start, target_m, viewer_m));
}

void SceneHands::move_to(const Transform& world_from_start) {
  const Transform moved = moved_between(world_from_start_, world_from_start);
  world_from_start_ = world_from_start;
  session_.drag(moved);
}

void SceneHands::hold_cut(const xr::Hands& hands, double dt_s) {
  held_cut_.reset();
  for (int side = 0; side < 2; ++side)
    if (const xr::Controller& hand = hands.hand[size_t(side)]; hand.active && hand.clip)
      held_cut_ = xr::clip_plane(hand.world_from_grip, side);
  if (held_cut_) {
    cut_held_s_ += dt_s;
  } else {
    if (cut_held_s_ > 0.0 && cut_held_s_ < kTap_s) cut_.reset();
    cut_held_s_ = 0.0;
  }
}

/// The place where the volumes are drawn, which is not where the hands put them: volumes follow on
/// a smooth path, and a cut ahead of them would show too much or too little. A space mouse may have
/// moved them, too.
Transform SceneHands::drawn_from_start(const SceneSnapshot& drawn) const {
  const auto scene = session_.scene();
  for (size_t v = 0; v < scene->volumes.size() && int(v) < drawn.volume_count; ++v) {
    const VolumeSpec& spec = scene->volumes[v].spec;
    if (spec.drive.kind == DriveSpec::Kind::kSecondHand)
      return moved_between(spec.transform, drawn.volumes[v].world_from_volume);
  }
  return {};
}

std::optional<ClipPlane> SceneHands::clip(const SceneSnapshot& drawn) {
  const Transform from_start = drawn_from_start(drawn);
  if (held_cut_)
    cut_ = xr::CutPlane{from_start.volume_from_world(held_cut_->point_m),
                        glm::conjugate(from_start.rotation) * held_cut_->normal};
  if (!cut_) return std::nullopt;
  const glm::dvec3 normal = from_start.rotation * cut_->normal;
  return ClipPlane{normal, glm::dot(normal, from_start.world_from_volume(cut_->point_m))};
}

void SceneHands::next_look(int steps) {
  const std::vector<std::string> names = preset_names();
  const auto at = std::find(names.begin(), names.end(), view_.look);
  // The look chosen automatically counts as the one before the first.
  const int now = at == names.end() ? (steps > 0 ? -1 : 0) : int(at - names.begin());
  const int count = int(names.size());
  view_.look = names[size_t(((now + steps) % count + count) % count)];
}

}  // namespace palpate::headset
