#include "module/haptics/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compute/volume/portable.h"
#include "module/scene/drive.h"
#include "module/scene/segment_modes.h"

namespace palpate {
namespace {

Error bad(std::string sentence) {
  return {ErrorKind::kBadInput, std::move(sentence)};
}

/// The carrier for a volume and motion, made when the first mode asks for it.
int carrier_of(Scene& scene, int volume, const Motion* motion) {
  for (size_t c = 0; c < scene.carriers.size(); ++c)
    if (scene.carriers[c].volume == volume && scene.carriers[c].motion == motion) return int(c);
  scene.carriers.push_back({volume, motion});
  return int(scene.carriers.size()) - 1;
}

/// The motion a mode names; null is an answer: the data stand still, or nothing of them is known to
/// move.
Result<const Motion*> motion_of(const ModeSpec& mode, const MovingVolume& data) {
  if (data.whole) return nullptr;  // one motion carries all there is
  if (mode.motion.empty()) return data.motions.empty() ? nullptr : &data.motions.front();
  for (const Motion& motion : data.motions)
    if (motion.name == mode.motion) return &motion;
  return bad("Mode \"" + mode.name + "\" is carried by the motion \"" + mode.motion +
             "\", which volume \"" + mode.volume + "\" does not have.");
}

/// The index of the segment a mode reads; -1: the values.
Result<int> segment_of(const ModeSpec& mode, const MovingVolume& data) {
  if (mode.segment.empty()) return -1;
  std::string known;
  for (size_t s = 0; s < data.segments.size(); ++s) {
    if (data.segments[s].name == mode.segment) {
      if (data.segments[s].distance_mm.size() == data.frames.size()) return int(s);
      return bad("Mode \"" + mode.name + "\" reads the segment \"" + mode.segment +
                 "\" of volume \"" + mode.volume + "\", which is only known in frame " +
                 std::to_string(data.segments_frame) +
                 ": give one motion for the whole sequence, or a segmentation of each frame.");
    }
    known += (s ? ", " : "") + data.segments[s].name;
  }
  return bad("Mode \"" + mode.name + "\" reads the segment \"" + mode.segment +
             "\", which volume \"" + mode.volume + "\" does not have; it has " +
             (known.empty() ? "none." : known + "."));
}

/// Which part of the volume's data a mode reads, and what carries it.
Status read_data(Scene& scene, int volume, SceneMode& mode) {
  const MovingVolume& data = *scene.volumes[size_t(volume)].data;
  const auto motion = motion_of(mode.spec, data);
  if (!motion) return motion.error();
  const auto segment = segment_of(mode.spec, data);
  if (!segment) return segment.error();
  mode.carrier = carrier_of(scene, volume, *motion);
  mode.segment = *segment;
  return Nothing{};
}

PoseStage pose_stage(const VolumeSpec& spec) {
  if (spec.drive.kind == DriveSpec::Kind::kStill) return PoseStage::kNone;
  switch (spec.path) {
    case PosePath::kExact:
      return spec.drive.kind == DriveSpec::Kind::kSecondHand ? PoseStage::kNewest
                                                             : PoseStage::kDrive;
    case PosePath::kPaper:
      return PoseStage::kPaper;
    case PosePath::kSmooth:
      break;
  }
  return PoseStage::kSmooth;
}

/// Of a finger pad that has no radius: about that of a fingertip.
constexpr double kPadRadius_m = 0.005;

/// Where the points of a tool are.
std::vector<glm::dvec3> points_of(const SceneSpec& spec) {
  if (spec.tool_points == 1) return {glm::dvec3(0.0)};
  const double radius_m = spec.tool_radius_m > 0.0 ? spec.tool_radius_m : kPadRadius_m;
  const int around = std::min(spec.tool_points, 4);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < around; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / around;
    points.push_back(radius_m * glm::dvec3(portable::cos(angle), portable::sin(angle), 0.0));
  }
  if (spec.tool_points > around) points.emplace_back(0.0);
  return points;
}

/// The stages of a volume.
SceneVolume planned(const VolumeSpec& spec, std::shared_ptr<const MovingVolume> data) {
  SceneVolume volume{spec, std::move(data), pose_stage(spec)};
  if (!volume.data->is_still())
    volume.phase = volume.data->whole ? DataStage::kMaterial : DataStage::kFrames;
  volume.blends = volume.phase == DataStage::kFrames && spec.blend_values;
  return volume;
}

/// Checks the numbers of a scene, apart from its data.
Status check_numbers(const SceneSpec& spec, const std::vector<ModeSpec>& modes) {
  if (!(spec.stiffness_n_per_m > 0.0) || !std::isfinite(spec.stiffness_n_per_m))
    return bad("The scene's stiffness must be a number above 0 (N/m).");
  if (!(spec.damping_n_s_per_m >= 0.0) || !std::isfinite(spec.damping_n_s_per_m))
    return bad("The scene's damping must be a number that is not negative (N s/m).");
  if (!(spec.tool_radius_m >= 0.0) || !std::isfinite(spec.tool_radius_m))
    return bad("The tool's radius must be a number that is not negative (m).");
  if (spec.tool_points < 1 || spec.tool_points > kMostToolPoints)
    return bad("The tool can have 1 to " + std::to_string(kMostToolPoints) + " points.");
  if (const Status fine = check(spec.world_from_device); !fine)
    return bad("The place of the device: " + fine.error().message);
  for (const VolumeSpec& volume : spec.volumes) {
    if (const Status fine = check(volume.transform); !fine)
      return bad("Volume \"" + volume.name + "\": " + fine.error().message);
    if (const Status fine = check(volume.drive, volume.transform); !fine)
      return bad("Volume \"" + volume.name + "\": " + fine.error().message);
    if (!std::isfinite(volume.rate))
      return bad("Volume \"" + volume.name + "\" is played by a number that is not finite.");
  }
  for (const VolumeSpec& volume : spec.volumes)
    for (const SegmentSpec& segment : volume.segments.parts)
      if (!(segment.strength_n >= 0.0 && segment.stiffness_n_per_m > 0.0 &&
            segment.friction >= 0.0) ||
          !std::isfinite(segment.strength_n + segment.stiffness_n_per_m + segment.friction))
        return bad("The segment \"" + segment.name + "\" of volume \"" + volume.name +
                   "\" has a strength, stiffness or friction that is not a finite number above 0.");
  for (const ModeSpec& mode : modes)
    if (!std::isfinite(mode.gain + mode.range_m + glm::dot(mode.point_m, glm::dvec3(1.0))))
      return bad("Mode \"" + mode.name + "\" has a gain, point or range that is not finite.");
  return Nothing{};
}

}  // namespace

Result<std::shared_ptr<const Scene>> plan(const SceneSpec& spec,
                                          std::vector<std::shared_ptr<const MovingVolume>> data,
                                          const ModeKinds& kinds) {
  if (data.size() != spec.volumes.size())
    return bad("The scene has " + std::to_string(spec.volumes.size()) + " volumes, but data for " +
               std::to_string(data.size()) + ".");
  const std::vector<ModeSpec> modes = modes_of(spec);
  if (int(modes.size()) > kMostModes)
    return bad("The scene has " + std::to_string(modes.size()) +
               " modes and felt segments; a hand can be given " + std::to_string(kMostModes) +
               " at once: leave some out.");
  if (const Status fine = check_numbers(spec, modes); !fine) return fine.error();
  auto scene = std::make_shared<Scene>();
  scene->stiffness_n_per_m = spec.stiffness_n_per_m;
  scene->damping_n_s_per_m = spec.damping_n_s_per_m;
  scene->points_m = points_of(spec);
  if (spec.tool_points == 1) scene->tool_radius_m = spec.tool_radius_m;
  scene->world_from_device = spec.world_from_device;
  for (size_t v = 0; v < data.size(); ++v) {
    if (const Status fits = check(*data[v]); !fits) return fits.error();
    scene->volumes.push_back(planned(spec.volumes[v], std::move(data[v])));
  }
  for (const ModeSpec& mode : modes) {
    const auto named = std::find_if(spec.volumes.begin(), spec.volumes.end(),
                                    [&](const VolumeSpec& v) { return v.name == mode.volume; });
    if (named == spec.volumes.end())
      return bad("Mode \"" + mode.name + "\" reads volume \"" + mode.volume +
                 "\", which the scene does not have.");
    SceneMode made{ModeKinds::completed(mode), nullptr};
    const Status read = read_data(*scene, int(named - spec.volumes.begin()), made);
    if (!read) return read.error();
    auto of_kind = kinds.make(mode);
    if (!of_kind) return of_kind.error();
    made.mode = std::move(*of_kind);
    made.reads_contact = scene->tool_radius_m > 0.0 && mode.kind == "surface" && made.segment < 0 &&
                         mode.scalar == ScalarProperty::kValue && !mode.leaving && !mode.two_sided;
    scene->modes.push_back(std::move(made));
  }
  return std::shared_ptr<const Scene>(scene);
}

Result<std::shared_ptr<const Scene>> with_data(const Scene& scene, size_t volume,
                                               std::shared_ptr<const MovingVolume> data) {
  if (const Status fits = check(*data); !fits) return fits.error();
  auto changed = std::make_shared<Scene>(scene);
  changed->volumes[volume] = planned(scene.volumes[volume].spec, std::move(data));
  changed->carriers.clear();
  for (SceneMode& mode : changed->modes) {
    const int of = scene.carriers[size_t(mode.carrier)].volume;
    if (const Status read = read_data(*changed, of, mode); !read) return read.error();
  }
  return std::shared_ptr<const Scene>(changed);
}

}  // namespace palpate
