#include "integration/app/headset/scene_hands.h"

#include <algorithm>
#include <cmath>

namespace palpate::app {
namespace {

constexpr double kScrubPerSecond = 0.25;  // of the sequence, stick pushed all the way
constexpr double kDeadZone = 0.15;        // of the stick
constexpr double kTap_s = 0.3;            // a shorter press takes the cut away

}  // namespace

void SceneHands::step(const xr::Hands& hands, const SceneMoment& moment, double dt_s) {
  const Transform dragged = grab_.drag(world_from_start_, hands);
  if (grab_.holds()) move_to(dragged);
  cut(hands, dt_s);
  if (hands.play_pause) transport_.toggle();
  if (std::abs(hands.scrub) > kDeadZone)
    transport_.scrub(moment, hands.scrub * kScrubPerSecond * dt_s);
  if (hands.preset_steps != 0) next_look(hands.preset_steps);
}

void SceneHands::bring(glm::dvec3 centre_m, glm::dvec3 target_m, glm::dvec3 viewer_m) {
  const glm::dvec3 at_start = world_from_start_.volume_from_world(centre_m);
  move_to(xr::brought_to(world_from_start_, at_start, target_m, viewer_m));
}

void SceneHands::move_to(const Transform& world_from_start) {
  const Transform& before = world_from_start_;
  Transform moved;
  moved.scale = world_from_start.scale / before.scale;
  moved.rotation = glm::normalize(world_from_start.rotation * glm::conjugate(before.rotation));
  moved.translation_m =
      world_from_start.translation_m - moved.rotation * (moved.scale * before.translation_m);
  world_from_start_ = world_from_start;
  palpation_.drag(moved);
}

void SceneHands::cut(const xr::Hands& hands, double dt_s) {
  std::optional<int> holds;
  for (int side = 0; side < 2; ++side)
    if (hands.hand[size_t(side)].active && hands.hand[size_t(side)].clip) holds = side;
  if (!holds) {
    if (cut_held_s_ > 0.0 && cut_held_s_ < kTap_s) cut_.reset();
    cut_held_s_ = 0.0;
    return;
  }
  cut_held_s_ += dt_s;
  xr::Plane plane = xr::clip_plane(hands.hand[size_t(*holds)].world_from_grip, *holds);
  plane.point_m = world_from_start_.volume_from_world(plane.point_m);
  plane.normal = glm::conjugate(world_from_start_.rotation) * plane.normal;
  cut_ = plane;
}

std::optional<ClipPlane> SceneHands::clip() const {
  if (!cut_) return std::nullopt;
  const glm::dvec3 normal = world_from_start_.rotation * cut_->normal;
  return ClipPlane{normal, glm::dot(normal, world_from_start_.world_from_volume(cut_->point_m))};
}

void SceneHands::next_look(int steps) {
  const std::vector<std::string> names = preset_names();
  const auto at = std::find(names.begin(), names.end(), view_.look);
  // What was found to fit the data counts as the one before the first.
  const int now = at == names.end() ? (steps > 0 ? -1 : 0) : int(at - names.begin());
  const int count = int(names.size());
  view_.look = names[size_t(((now + steps) % count + count) % count)];
}

std::optional<int> feeling_hand(const xr::Hands& hands) {
  for (const int side : {1, 0})
    if (hands.hand[size_t(side)].active) return side;
  return std::nullopt;
}

glm::dvec3 tip_of(const xr::Hand& hand) {
  return hand.world_from_aim.value_or(hand.world_from_grip).position_m;
}

}  // namespace palpate::app
