#include "module/scene/drive.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>

#include "compute/volume/portable.h"

namespace palpate {

namespace {

Error drive_refused(const std::string& what) {
  return {ErrorKind::kBadInput, "The drive can not be followed: " + what + "."};
}

constexpr double kFarthest_m = 1.000001e6;  // 1000 km, and what is rounded beyond

glm::dvec3 blend(const glm::dvec3& a, const glm::dvec3& b, double share) noexcept {
  return a + share * (b - a);
}
glm::dquat blend(const glm::dquat& a, const glm::dquat& b, double share) noexcept {
  return between(a, b, share);
}

template <class T>
T at(const KeyTrack<T>& track, const T& without_keys, double time_s) noexcept {
  if (track.keys.empty()) return without_keys;
  double share = std::max(0.0, time_s / track.cycle_s);
  share = track.loop ? share - std::floor(share) : std::min(share, 1.0);
  const auto above = std::upper_bound(track.keys.begin(), track.keys.end(), share);
  if (above == track.keys.begin()) return track.values.front();
  if (above == track.keys.end()) return track.values.back();
  const size_t k = size_t(above - track.keys.begin());
  const double low = track.keys[k - 1], high = track.keys[k];
  return blend(track.values[k - 1], track.values[k], (share - low) / (high - low));
}

/// The inner transform within the outer one; see check() for what can be said so.
Transform within(const Transform& outer, const Transform& inner) noexcept {
  Transform both;
  both.translation_m = outer.world_from_volume(inner.translation_m);
  both.rotation = glm::normalize(outer.rotation * inner.rotation);
  both.scale = outer.scale * inner.scale;
  return both;
}

bool is_even(glm::dvec3 scale) {
  return glm::all(glm::lessThan(glm::abs(scale - scale.x), glm::dvec3(1e-9 * scale.x)));
}

template <class T>
bool fits(const KeyTrack<T>& track) {
  if (track.keys.size() != track.values.size()) return false;
  if (track.keys.empty()) return true;
  if (!(track.cycle_s > 0.0) || !std::isfinite(track.cycle_s)) return false;
  for (size_t k = 0; k < track.keys.size(); ++k)
    if (!(track.keys[k] >= (k ? track.keys[k - 1] : 0.0) && track.keys[k] <= 1.0)) return false;
  return true;
}

/// Whether each value makes a transform of `pose`.
template <class T>
bool all_fit(const KeyTrack<T>& track, Transform pose, T Transform::*part) {
  return std::all_of(track.values.begin(), track.values.end(), [&](const T& value) {
    pose.*part = value;
    return bool(check(pose));
  });
}

}  // namespace

Status check(const DriveSpec& drive, const Transform& start) {
  if (!std::isfinite(glm::dot(drive.axis, drive.centre_m) + drive.rate_hz + drive.amplitude_m))
    return drive_refused("an axis, a centre, a rate or an amplitude is not finite; correct it");
  if (drive.kind != DriveSpec::Kind::kKeys) return Nothing{};
  bool even = true;
  double least = 1.0, most = 1.0;  // scale of all together
  for (size_t k = 0; k <= drive.poses.size(); ++k) {
    const bool last = k == drive.poses.size();
    const KeyedPose own{start, {}, {}, {}};
    const KeyedPose& pose = last ? own : drive.poses[k];
    if (!fits(pose.translation_m) || !fits(pose.rotation) || !fits(pose.scale))
      return drive_refused(
          "keys have to rise within 0 to 1, with one value each and a cycle above 0 s; correct "
          "them");
    if (const Status fine = check(pose.pose); !fine) return fine.error();
    if (!all_fit(pose.translation_m, pose.pose, &Transform::translation_m) ||
        !all_fit(pose.rotation, pose.pose, &Transform::rotation) ||
        !all_fit(pose.scale, pose.pose, &Transform::scale))
      return drive_refused(
          "a key's value is no translation, rotation of length 1, or scale from 1e-4 to 1e4; "
          "correct it");
    const bool turns =
        !pose.rotation.keys.empty() || std::abs(std::abs(pose.pose.rotation.w) - 1.0) > 1e-12;
    if (!even && turns)
      return drive_refused(
          "a scale that differs between axes would shear what turns within it; give the same scale "
          "along all axes");
    double low = std::numeric_limits<double>::infinity(), high = 0.0;
    const auto reach = [&](glm::dvec3 scale) {
      for (int a = 0; a < 3; ++a) low = std::min(low, scale[a]), high = std::max(high, scale[a]);
    };
    if (pose.scale.values.empty()) reach(pose.pose.scale);
    for (const glm::dvec3& scale : pose.scale.values) reach(scale);
    least *= low;
    most *= high;
    const auto is_far = [](glm::dvec3 x) {
      return !glm::all(glm::lessThan(glm::abs(x), glm::dvec3(kFarthest_m)));
    };
    if (!(least >= 1e-4 && most <= 1e4) || is_far(pose.pose.translation_m) ||
        std::any_of(pose.translation_m.values.begin(), pose.translation_m.values.end(), is_far))
      return drive_refused(
          "the transforms together lead to a scale outside 1e-4 to 1e4, or one of them "
          "farther than 1000 km; give smaller numbers");
    even = even && is_even(pose.pose.scale) &&
           std::all_of(pose.scale.values.begin(), pose.scale.values.end(), is_even);
  }
  return Nothing{};
}

Transform driven(const DriveSpec& drive, const Transform& start, double time_s) noexcept {
  if (drive.kind == DriveSpec::Kind::kKeys) {
    if (!std::isfinite(time_s)) return start;
    Transform pose;
    for (const KeyedPose& keyed : drive.poses) {
      Transform now;
      now.translation_m = at(keyed.translation_m, keyed.pose.translation_m, time_s);
      now.rotation = at(keyed.rotation, keyed.pose.rotation, time_s);
      now.scale = at(keyed.scale, keyed.pose.scale, time_s);
      pose = within(pose, now);
    }
    return within(pose, start);
  }
  const double angle = glm::two_pi<double>() * drive.rate_hz * time_s;
  const double length = glm::length(drive.axis);
  if (!(length > 0.0) || !std::isfinite(angle)) return start;
  const glm::dvec3 axis = drive.axis / length;
  Transform pose = start;
  if (drive.kind == DriveSpec::Kind::kTurn) {
    const auto [sine, cosine] = portable::sin_cos(0.5 * angle);
    const glm::dquat turn(cosine, sine * axis);
    pose.rotation = glm::normalize(turn * start.rotation);
    pose.translation_m = drive.centre_m + turn * (start.translation_m - drive.centre_m);
  } else if (drive.kind == DriveSpec::Kind::kSwing) {
    pose.translation_m += axis * (drive.amplitude_m * portable::sin(angle));
  }
  return pose;
}

}  // namespace palpate
