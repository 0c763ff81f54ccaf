#include "module/scene/plan.h"

#include <algorithm>
#include <cstdio>

#include "module/scene/segment_modes.h"

namespace palpate {
namespace {

template <class... Args>
std::string formatted(const char* format, Args... args) {
  char buffer[256];
  std::snprintf(buffer, sizeof(buffer), format, args...);
  return buffer;
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

MotionNeeds needs_of(const Motion& motion) {
  MotionNeeds needs;
  needs.name = motion.name;
  needs.steps = int(motion.steps.size());
  for (const auto& map : motion.steps) {
    if (!map) continue;
    ++needs.known;
    needs.moving_share += map->moving_share();
    needs.largest_u_m = std::max(needs.largest_u_m, map->largest_u_m());
    needs.worst_contraction = std::max(needs.worst_contraction, map->worst_contraction());
    needs.folded_cells += map->folded_cells();
    needs.bytes += map->bytes();
  }
  if (needs.known > 0) needs.moving_share /= needs.known;
  return needs;
}

MotionNeeds needs_of(const SequenceMap& whole) {
  MotionNeeds needs;
  needs.name = "data";
  needs.whole = true;
  needs.harmonics = whole.basis().harmonics;
  needs.steps = needs.known = int(whole.basis().times_s.size());
  needs.moving_share = whole.moving_share();
  needs.largest_u_m = whole.largest_u_m();
  needs.folded_cells = whole.folded_samples();
  needs.least_determinant = whole.least_determinant();
  needs.bytes = whole.bytes();
  return needs;
}

/// How the pose of a haptic frame comes about, or why none is asked for.
void plan_pose(const VolumeSpec& spec, VolumeNeeds& needs) {
  if (spec.drive.kind == DriveSpec::Kind::kStill) {
    needs.left_out.push_back("pose: its transform does not change");
    return;
  }
  const bool second_hand = spec.drive.kind == DriveSpec::Kind::kSecondHand;
  const std::string source = second_hand                                 ? "of the second hand"
                             : spec.drive.kind == DriveSpec::Kind::kTurn ? "turning"
                             : spec.drive.kind == DriveSpec::Kind::kKeys ? "moving by keys"
                                                                         : "swinging";
  switch (spec.path) {
    case PosePath::kExact:
      needs.each_tick.push_back(second_hand ? "newest pose " + source
                                            : "pose, " + source + ", at the tick's own time");
      break;
    case PosePath::kPaper:
      needs.each_tick.push_back("pose, " + source + ", by lerp and slerp over the frame time");
      break;
    case PosePath::kSmooth:
      needs.each_tick.push_back("pose, " + source + ", on a smooth path through the frames'");
      break;
  }
}

void plan_data(const VolumeSpec& spec, const MovingVolume& data, VolumeNeeds& needs) {
  if (data.is_still()) {
    needs.left_out.push_back("phase, back-tracking, blending: it has one frame");
    return;
  }
  needs.each_tick.push_back("phase");
  const bool carried = std::any_of(needs.motions.begin(), needs.motions.end(),
                                   [](const MotionNeeds& m) { return !m.modes.empty(); });
  if (carried)
    needs.each_tick.push_back(data.whole || spec.back_tracking == BackTracking::kNewton
                                  ? "back-tracking by Newton"
                                  : "back-tracking by the paper's fixed point");
  else
    needs.left_out.push_back("back-tracking: no motion of it is known");
  if (data.whole)
    needs.left_out.push_back(
        "blending, frame borders: one volume's values are carried at all times");
  else if (spec.blend_values)
    needs.each_tick.push_back("blending the values of two frames");
  else
    needs.left_out.push_back("blending: each frame's own values are carried");
}

VolumeNeeds needs_of(const SceneSpec& scene, const VolumeSpec& spec, const MovingVolume& data) {
  VolumeNeeds needs;
  needs.name = spec.name;
  needs.frames = int(data.times.times_s.size());
  needs.length_s = data.times.length_s();
  needs.cyclic = data.times.cyclic();
  for (const Motion& motion : data.motions) needs.motions.push_back(needs_of(motion));
  if (data.whole) needs.motions.push_back(needs_of(*data.whole));
  for (const ModeSpec& mode : modes_of(scene)) {
    if (mode.volume != spec.name) continue;
    needs.modes.push_back(mode.name);
    for (size_t m = 0; m < needs.motions.size(); ++m)
      if (data.whole || mode.motion.empty() ? m == 0 : mode.motion == needs.motions[m].name)
        needs.motions[m].modes.push_back(mode.name);
  }
  if (needs.modes.empty()) {
    needs.left_out.push_back("everything: no mode reads it");
    return needs;
  }
  plan_pose(spec, needs);
  plan_data(spec, data, needs);
  if (!needs.each_tick.empty() || data.is_still())
    needs.each_tick.push_back(std::to_string(needs.modes.size()) +
                              (needs.modes.size() == 1 ? " mode" : " modes"));
  return needs;
}

std::string text(const MotionNeeds& m) {
  if (m.modes.empty()) return "not needed: no mode is carried by it";
  std::string line;
  if (m.whole) {
    line = m.harmonics > 0 ? formatted("one for all times, %d harmonics", m.harmonics)
                           : std::string("one for all times, in smooth curves between frames");
  } else {
    line = formatted("%d of %d steps known", m.known, m.steps);
    if (m.known == 0) return line + ": it stands still until they are";
  }
  line += formatted(", %.0f %% of the samples move, by %.1f mm at most%s", 100.0 * m.moving_share,
                    1e3 * m.largest_u_m, m.whole ? "" : " in a step");
  line += m.whole ? formatted("; least determinant %.2f", m.least_determinant)
                  : formatted("; contraction %.2f at worst", double(m.worst_contraction));
  if (m.folded_cells > 0)
    line += formatted(": %zu cells fold or may fold, there the point is held and the force fades",
                      m.folded_cells);
  else
    line += m.whole || m.worst_contraction < 1.0F
                ? ": inverted everywhere"
                : ": no fold, but not all of it is proved to be inverted";
  return line + formatted(" (%.1f MB)", 1e-6 * double(m.bytes));
}

}  // namespace

ScenePlan plan(const SceneSpec& spec,
               const std::vector<std::shared_ptr<const MovingVolume>>& data) {
  ScenePlan plan;
  for (size_t v = 0; v < data.size(); ++v)
    plan.volumes.push_back(needs_of(spec, spec.volumes[v], *data[v]));
  for (const ModeSpec& mode : spec.modes)
    if (!mode.on) plan.idle_modes.push_back(mode.name);
  return plan;
}

std::string text(const ScenePlan& plan) {
  std::string all;
  for (const VolumeNeeds& v : plan.volumes) {
    all += v.name + "\n";
    all += "  felt by    " + (v.modes.empty() ? std::string("nothing") : joined(v.modes)) + "\n";
    all += v.frames == 1 ? "  frames     1, it stands still\n"
                         : formatted("  frames     %d in %.3g s%s\n", v.frames, v.length_s,
                                     v.cyclic ? ", over and over" : "");
    for (const MotionNeeds& motion : v.motions)
      all += "  motion     \"" + motion.name + "\": " + text(motion) + "\n";
    if (!v.each_tick.empty()) all += "  each tick  " + joined(v.each_tick) + "\n";
    for (const std::string& left : v.left_out) all += "  left out   " + left + "\n";
  }
  if (!plan.idle_modes.empty())
    all += "Off at the start, and not read until they are switched on: " + joined(plan.idle_modes) +
           "\n";
  return all;
}

}  // namespace palpate
