#include <algorithm>
#include <cstdio>

#include "module/haptics/scene/scene.h"

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

/// What is known of a motion, of its steps or of one for all times.
struct KnownMotion {
  double moving_share = 0.0;  ///< of the samples
  double largest_u_m = 0.0;   ///< displacement
  size_t folded = 0;          ///< cells or samples that fold or may fold
  bool inverted = false;      ///< proved everywhere
  size_t bytes = 0;
  std::string begin, steepness;  ///< how its line begins; how near to a fold it comes
};

std::string text(const KnownMotion& known, const char* of) {
  std::string line =
      known.begin + formatted(", %.0f %% of the samples move, by %.1f mm at most%s",
                              100.0 * known.moving_share, 1e3 * known.largest_u_m, of);
  line += "; " + known.steepness;
  if (known.folded > 0)
    line += formatted(": %zu cells fold or may fold, there the point is frozen and the force fades",
                      known.folded);
  else
    line += known.inverted ? ": inverted everywhere"
                           : ": no fold, but not all of it is proved to be inverted";
  return line + formatted(" (%.1f MB)", 1e-6 * double(known.bytes));
}

std::string text(const Motion& motion) {
  KnownMotion known;
  int steps = 0;
  float contraction = 0.0F;  // q; below 1 every step can be inverted everywhere
  for (const auto& map : motion.steps) {
    if (!map) continue;
    ++steps;
    known.moving_share += map->moving_share();
    known.largest_u_m = std::max(known.largest_u_m, map->largest_u_m());
    contraction = std::max(contraction, map->worst_contraction());
    known.folded += map->folded_cells();
    known.bytes += map->bytes();
  }
  known.begin = formatted("%d of %d steps known", steps, int(motion.steps.size()));
  if (steps == 0) return known.begin + ": it stands still until they are";
  known.moving_share /= steps;
  known.inverted = contraction < 1.0F;
  known.steepness = formatted("contraction %.2f at worst", double(contraction));
  return text(known, " in a step");
}

std::string text(const SequenceMap& whole) {
  KnownMotion known{whole.moving_share(), whole.largest_u_m(), whole.folded_samples(), true,
                    whole.bytes()};
  const int harmonics = whole.basis().harmonics;
  known.begin = harmonics > 0 ? formatted("one for all times, %d harmonics", harmonics)
                              : "one for all times, in smooth curves between frames";
  known.steepness = formatted("least determinant %.2f", whole.least_determinant());
  return text(known, "");
}

/// The names of the modes that read a volume.
std::vector<std::string> readers_of(const Scene& scene, int volume) {
  std::vector<std::string> names;
  for (const SceneMode& mode : scene.modes)
    if (scene.carriers[size_t(mode.carrier)].volume == volume) names.push_back(mode.spec.name);
  return names;
}

bool is_carrying(const Scene& scene, int volume, const Motion* motion) {
  return std::any_of(scene.carriers.begin(), scene.carriers.end(), [&](const SceneCarrier& one) {
    return one.volume == volume && one.motion == motion;
  });
}

/// Where the pose of a haptic frame comes from; "": there is none.
std::string text(PoseStage pose, DriveSpec::Kind drive) {
  const std::string source = drive == DriveSpec::Kind::kSecondHand ? "of the second hand"
                             : drive == DriveSpec::Kind::kTurn     ? "turning"
                             : drive == DriveSpec::Kind::kKeys     ? "moving by keys"
                                                                   : "swinging";
  switch (pose) {
    case PoseStage::kNone:
      break;
    case PoseStage::kDrive:
      return "pose, " + source + ", at the tick's own time";
    case PoseStage::kNewest:
      return "newest pose " + source;
    case PoseStage::kPaper:
      return "pose, " + source + ", by lerp and slerp over the frame time";
    case PoseStage::kSmooth:
      return "pose, " + source + ", on a smooth path through the frames'";
  }
  return "";
}

/// What a haptic frame does with a volume, in order, and what it does not, and why.
struct StageTexts {
  std::vector<std::string> each_tick, left_out;
};

StageTexts stages_of(const Scene& scene, int v, size_t modes) {
  const SceneVolume& volume = scene.volumes[size_t(v)];
  StageTexts stages;
  const std::string pose = text(volume.pose, volume.spec.drive.kind);
  if (!pose.empty()) stages.each_tick.push_back(pose);
  if (!volume.is_still()) stages.each_tick.emplace_back("phase");
  if (modes == 0) {
    stages.left_out.emplace_back(stages.each_tick.empty() ? "everything: no mode reads it"
                                                          : "all that is felt: no mode reads it");
    return stages;
  }
  if (pose.empty()) stages.left_out.emplace_back("pose: its transform does not change");
  switch (volume.phase) {
    case DataStage::kStill:
      stages.left_out.emplace_back("phase, back-tracking, blending: it has one frame");
      break;
    case DataStage::kMaterial:
      stages.each_tick.emplace_back("back-tracking by Newton");
      stages.left_out.emplace_back(
          "blending, frame borders: one volume's values are carried at all times");
      break;
    case DataStage::kFrames: {
      const auto& motions = volume.data->motions;
      if (std::any_of(motions.begin(), motions.end(),
                      [&](const Motion& motion) { return is_carrying(scene, v, &motion); }))
        stages.each_tick.emplace_back(volume.spec.back_tracking == BackTracking::kNewton
                                          ? "back-tracking by Newton"
                                          : "back-tracking by the paper's fixed point");
      else
        stages.left_out.emplace_back("back-tracking: no motion of it is known");
      if (volume.blends)
        stages.each_tick.emplace_back("blending the values of two frames");
      else
        stages.left_out.emplace_back("blending: each frame's own values are carried");
    }
  }
  stages.each_tick.push_back(std::to_string(modes) + (modes == 1 ? " mode" : " modes"));
  return stages;
}

}  // namespace

std::string text(const Scene& scene) {
  std::string all;
  for (int v = 0; v < int(scene.volumes.size()); ++v) {
    const SceneVolume& volume = scene.volumes[size_t(v)];
    const MovingVolume& data = *volume.data;
    const std::vector<std::string> modes = readers_of(scene, v);
    const int frames = int(data.times.times_s.size());
    all += volume.spec.name + "\n";
    all += "  felt by    " + (modes.empty() ? std::string("nothing") : joined(modes)) + "\n";
    all += frames == 1 ? "  frames     1, it stands still\n"
                       : formatted("  frames     %d in %.3g s%s\n", frames, data.times.length_s(),
                                   data.times.cyclic() ? ", over and over" : "");
    const auto say_motion = [&](const std::string& name, bool carries, const std::string& known) {
      all += "  motion     \"" + name +
             "\": " + (carries ? known : "not needed: no mode is carried by it") + "\n";
    };
    for (const Motion& motion : data.motions)
      say_motion(motion.name, is_carrying(scene, v, &motion), text(motion));
    if (data.whole) say_motion("data", !modes.empty(), text(*data.whole));
    const StageTexts stages = stages_of(scene, v, modes.size());
    if (!stages.each_tick.empty()) all += "  each tick  " + joined(stages.each_tick) + "\n";
    for (const std::string& left : stages.left_out) all += "  left out   " + left + "\n";
  }
  if (scene.points_m.size() > 1)
    all += formatted(
        "A tool of %zu points: each has a proxy of its own, with back-tracking, modes "
        "and balance\n",
        scene.points_m.size());
  std::vector<std::string> idle;
  for (const SceneMode& mode : scene.modes)
    if (!mode.spec.on) idle.push_back(mode.spec.name);
  if (!idle.empty())
    all += "Off at the start, and not read until they are switched on: " + joined(idle) + "\n";
  return all;
}

}  // namespace palpate
