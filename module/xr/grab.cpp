#include "module/xr/grab.h"

#include <algorithm>
#include <cmath>

namespace palpate::xr {
namespace {

constexpr double kStill = 1e-9;  // m or sine: shorter has no direction

/// The shortest turn of one unit vector into another.
glm::dquat turn_between(glm::dvec3 from, glm::dvec3 to) {
  const double along = glm::dot(from, to);
  if (along < -1.0 + 1e-12) {
    // Opposite: any axis across will do.
    const glm::dvec3 other = std::abs(from.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 axis = glm::normalize(glm::cross(from, other));
    return glm::dquat(0.0, axis.x, axis.y, axis.z);
  }
  const glm::dvec3 across = glm::cross(from, to);
  return glm::normalize(glm::dquat(1.0 + along, across.x, across.y, across.z));
}

/// How far a turn goes about an axis, -pi to pi.
double twist(const glm::dquat& turn, glm::dvec3 axis) {
  const double sine = glm::dot(glm::dvec3(turn.x, turn.y, turn.z), axis);
  double angle = 2.0 * std::atan2(sine, turn.w);
  const double pi = std::acos(-1.0);
  if (angle > pi) angle -= 2.0 * pi;
  if (angle < -pi) angle += 2.0 * pi;
  return angle;
}

}  // namespace

Transform Grab::drag(const Transform& world_from_volume, const Hands& hands) {
  std::array<bool, 2> holds{};
  std::array<Pose, 2> now{};
  for (size_t side = 0; side < 2; ++side) {
    const Controller& hand = hands.hand[side];
    holds[side] = hands.focused && hand.active && hand.grabs;
    now[side] = hand.world_from_grip;
  }
  Transform moved = world_from_volume;
  // Only hands that held on before and still do can have moved something.
  const bool left = holds[0] && held_[0], right = holds[1] && held_[1];
  if (left && right)
    moved = by_two(moved, now);
  else if (left || right)
    moved = by_one(moved, last_[right ? 1 : 0], now[right ? 1 : 0]);
  held_ = holds;
  last_ = now;
  return moved;
}

Transform Grab::by_one(const Transform& volume, const Pose& before, const Pose& now) const {
  const Pose step = now * inverse(before);
  Transform moved = volume;
  moved.translation_m = step(volume.translation_m);
  moved.rotation = glm::normalize(step.rotation * volume.rotation);
  return moved;
}

Transform Grab::by_two(const Transform& volume, const std::array<Pose, 2>& now) const {
  const glm::dvec3 line_0 = last_[1].position_m - last_[0].position_m;
  const glm::dvec3 line_1 = now[1].position_m - now[0].position_m;
  const glm::dvec3 middle_0 = 0.5 * (last_[0].position_m + last_[1].position_m);
  const glm::dvec3 middle_1 = 0.5 * (now[0].position_m + now[1].position_m);
  const double length_0 = glm::length(line_0), length_1 = glm::length(line_1);
  glm::dquat turn(1.0, 0.0, 0.0, 0.0);
  if (length_0 > kStill && length_1 > kStill) {
    const glm::dvec3 axis = line_1 / length_1;
    const glm::dquat swing = turn_between(line_0 / length_0, axis);
    double roll = 0.0;
    for (size_t side = 0; side < 2; ++side) {
      const glm::dquat whole = now[side].rotation * glm::conjugate(last_[side].rotation);
      roll += 0.5 * twist(whole * glm::conjugate(swing), axis);
    }
    turn = glm::angleAxis(roll, axis) * swing;
  }
  double factor = 1.0;
  if (length_0 >= limits_.apart_m && length_1 >= limits_.apart_m) factor = length_1 / length_0;
  const double least = glm::min(volume.scale.x, glm::min(volume.scale.y, volume.scale.z));
  const double most = glm::max(volume.scale.x, glm::max(volume.scale.y, volume.scale.z));
  // A volume that came in beyond the limits may go back, but not further out.
  factor = std::min(factor, std::max(1.0, limits_.scale_max / most));
  factor = std::max(factor, std::min(1.0, limits_.scale_min / least));

  Transform moved = volume;
  moved.translation_m = middle_1 + turn * (factor * (volume.translation_m - middle_0));
  moved.rotation = glm::normalize(turn * volume.rotation);
  moved.scale = factor * volume.scale;
  return moved;
}

CutPlane clip_plane(const Pose& world_from_grip, int hand) {
  // The grip's x axis comes out of the left palm and goes into the right one.
  const glm::dvec3 out_of_palm(hand == 0 ? 1.0 : -1.0, 0.0, 0.0);
  return {world_from_grip.position_m, glm::normalize(world_from_grip.rotation * out_of_palm)};
}

Transform brought_to(const Transform& world_from_volume, glm::dvec3 centre_m, glm::dvec3 target_m,
                     glm::dvec3 viewer_m) {
  Transform moved = world_from_volume;
  const glm::dvec3 towards(viewer_m.x - target_m.x, 0.0, viewer_m.z - target_m.z);
  if (glm::length(towards) > kStill) {
    const double yaw = std::atan2(towards.x, towards.z);
    moved.rotation = glm::angleAxis(yaw, glm::dvec3(0.0, 1.0, 0.0));
  }
  moved.translation_m = target_m - moved.rotation * (moved.scale * centre_m);
  return moved;
}

}  // namespace palpate::xr
