#include "integration/loading/load_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "compute/volume/portable.h"
#include "integration/files/frames.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/files/scene/scene_file.h"
#include "integration/files/sentences.h"
#include "integration/loading/carry_motion.h"
#include "integration/loading/choose_wall.h"
#include "integration/loading/mode_library.h"
#include "integration/loading/read_volume_data.h"
#include "integration/x3d/x3d_file.h"
#include "module/haptics/scene/scene.h"
#include "module/scene/built_in.h"
#include "module/scene/segment_modes.h"

namespace palpate::loading {
namespace {

namespace fs = std::filesystem;

/// Says in the spec where the volume starts.
Status place(LoadedScene& scene, VolumeSpec& spec, const MovingVolume& volume) {
  const auto start = start_transform(spec, volume);
  if (!start) return start.error();
  if (spec.box_m && spec.source.empty()) {
    if (const glm::dvec3 box = filled_box(spec, volume); box != *spec.box_m) {
      Note& note = scene.notes.emplace_back();
      note = {NoteKind::kOwnBox, {box.x, box.y, box.z}, {spec.name}};
      if (!spec.box_assumed)
        note.numbers.insert(note.numbers.end(), {spec.box_m->x, spec.box_m->y, spec.box_m->z});
    }
    spec.box_m.reset();
  }
  spec.transform = *start;
  spec.centred = false;
  return Nothing{};
}

/// Puts what was chosen into the scene: a mode, or a segment of the volume.
void feel(LoadedScene& scene, size_t v, ChosenWall wall, MovingVolume& volume) {
  VolumeSpec& spec = scene.spec.volumes[v];
  scene.notes.insert(scene.notes.end(), wall.notes.begin(), wall.notes.end());
  if (wall.mode) {
    wall.mode->volume = spec.name;
    if (v > 0) wall.mode->name += fmt::format(" of {}", spec.name);
    scene.spec.modes.push_back(std::move(*wall.mode));
    return;
  }
  spec.segments = std::move(wall.segments);
  const SegmentSpec& part = spec.segments.parts.front();
  const glm::vec3 colour = part.colour ? glm::vec3(*part.colour) : glm::vec3(0.85F, 0.55F, 0.5F);
  volume.segments.push_back(
      {part.name, colour, {sampled_scalar(std::move(wall.derived->distance_mm))}, part.shown});
}

/// The scale at which a volume is shown: a derived wall must hold a hand at that.
Result<double> shown_scale(const LoadedScene& scene, const VolumeSpec& spec,
                           const MovingVolume& volume) {
  const auto start = start_transform(spec, volume);
  if (!start) return start.error();
  const glm::dvec3 scale = start->scale;
  return portable::cube_root(scale.x * scale.y * scale.z) *
         (scene.from_sequence ? scale_to_reach(*volume.frames.front(), kUsualReach_m) : 1.0);
}

/// The wall that is felt of a volume's values; none where nothing is, or what a scene's modes say.
/// With segments their walls are felt, the values only if that is asked for.
std::optional<Result<ChosenWall>> felt_wall(const LoadedScene& scene, const VolumeSpec& spec,
                                            const MovingVolume& volume, const WallFrame& frame,
                                            bool chooses, const SequenceChoices& choices) {
  if (spec.segments.from != SegmentsFrom::kFiles && !scene.from_sequence)
    return derive_wall(frame, spec.segments, spec.files.front());
  if (chooses && !frame.values.values.empty() && (volume.segments.empty() || choices.iso_value))
    return choose_wall(frame, choices, can_carry_one_wall(spec, volume, frame.values, choices),
                       spec.files.front());
  return std::nullopt;
}

/// Adds the data of the next volume, as it is until its motion is known. open_again: see
/// ReadVolume.
Status add_starting(LoadedScene& scene, size_t v, MovingVolume volume,
                    const std::function<Result<Frames>()>& open_again) {
  const VolumeSpec& spec = scene.spec.volumes[v];
  const size_t known_frame = volume.segments_frame;
  auto starting = start_volume(spec, std::move(volume), open_again);
  if (!starting) return starting.error();
  if (starting->missing) {
    starting->missing->volume = v;
    if (starting->missing->own)
      scene.notes.push_back(
          {NoteKind::kStandsStill,
           {double(known_frame)},
           {spec.segments.from == SegmentsFrom::kFiles ? "segmentation" : "wall", spec.name}});
    scene.missing.push_back(std::move(*starting->missing));
  }
  scene.data.push_back(std::move(starting->data));
  return Nothing{};
}

/// Loads the data of one volume of the scene's spec. chooses: the spec has no modes, so the choices
/// say what is felt.
Status load_volume(LoadedScene& scene, size_t v, bool chooses, const SequenceChoices& choices,
                   const OnDoing& doing) {
  const auto prepares = [&] {
    if (doing) doing("preparing " + scene.spec.volumes[v].name);
  };
  VolumeSpec& spec = scene.spec.volumes[v];
  prepares();

  // What files or a program hold; synthetic data are made whole.
  ReadVolume read;
  if (spec.source.empty()) {
    auto found = read_volume_data(spec, choices, doing);
    if (!found) return found.error();
    read = std::move(*found);
    for (std::string& note : read.notes) scene.notes.push_back(text_note(std::move(note)));
    prepares();
  }
  if (scene.from_sequence)
    for (SegmentSpec& part : spec.segments.parts) {
      part.strength_n = choices.strength_n;
      part.friction = choices.friction;
    }
  WallFrame frame = std::move(read.wall_frame);
  const auto open_again = std::move(read.open_again);
  frame.leave_out_no_data();

  // How it moves.
  auto volume = spec.source.empty() ? carry_motion(spec, std::move(read)) : build(spec);
  if (!volume) return volume.error();

  const auto shown = shown_scale(scene, spec, *volume);
  if (!shown) return shown.error();
  const SegmentSpec part =
      spec.segments.parts.empty() ? SegmentSpec() : spec.segments.parts.front();
  frame.half_mm = half_thickness_mm(
      std::min(kFirmPress_n, scene.from_sequence ? choices.strength_n : part.strength_n),
      scene.spec.stiffness_n_per_m, part.stiffness_n_per_m, *shown);

  // Nobody said how stiff the walls of a sequence's segments are: thin ones are stiffer.
  if (scene.from_sequence)
    for (SegmentSpec& of : spec.segments.parts)
      for (const Segment& segment : volume->segments)
        if (segment.name == of.name)
          of.stiffness_n_per_m = holding_stiffness(*segment.distance_mm.front(), of, *shown);

  // What is felt of it.
  auto wall = felt_wall(scene, spec, *volume, frame, chooses, choices);
  if (wall && !*wall) return wall->error();
  if (wall) feel(scene, v, std::move(**wall), *volume);

  // Where it is, and what it does until its motion is known.
  if (const Status placed = place(scene, spec, *volume); !placed) return placed;
  return add_starting(scene, v, std::move(*volume), open_again);
}

/// Loads the data of a scene's spec. Without modes each volume gets the same as a sequence without
/// a scene file.
Result<LoadedScene> loaded(LoadedScene scene, const SequenceChoices& choices,
                           const OnDoing& doing) {
  const bool chooses = scene.spec.modes.empty();
  for (size_t v = 0; v < scene.spec.volumes.size(); ++v)
    if (const Status done = load_volume(scene, v, chooses, choices, doing); !done)
      return done.error();
  return scene;
}

Result<LoadedScene> of_spec(std::string name, SceneSpec spec, const SequenceChoices& choices,
                            const OnDoing& doing, std::vector<Note> notes = {}) {
  LoadedScene scene;
  scene.name = std::move(name);
  scene.spec = std::move(spec);
  scene.notes = std::move(notes);
  return loaded(std::move(scene), choices, doing);
}

/// The scene of a sequence without a scene file is what the choices say.
Result<LoadedScene> of_sequence(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                                const OnDoing& doing) {
  LoadedScene scene;
  scene.name = inputs.front().string();
  scene.from_sequence = true;
  VolumeSpec& spec = scene.spec.volumes.emplace_back();
  spec.name = files::sequence_name(inputs);
  spec.files = inputs;
  spec.frames_per_second = choices.frames_per_second;
  spec.cyclic = choices.cyclic;
  if (!choices.fields.empty()) {
    MotionSpec& motion = spec.motions.emplace_back();
    motion.fields = {choices.fields};
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(choices.fields, error))
      if (entry.path().filename().string().starts_with("confidence_"))
        motion.confidences = {choices.fields};
  }
  spec.values = choices.values;
  spec.segments.files = choices.segments;
  // A derived wall is known in the frame that it is derived from.
  if (!choices.segments.empty()) spec.segments.frame = choices.segments_frame;
  for (const std::string& name : choices.segment_names)
    spec.segments.parts.emplace_back().name = name;
  if (choices.wall == FeltWall::kRegion) spec.segments.from = SegmentsFrom::kRegion;
  if (choices.wall == FeltWall::kRidges) spec.segments.from = SegmentsFrom::kRidges;
  return loaded(std::move(scene), choices, doing);
}

/// Loads a scene from text; `read` parses it with the known kinds of mode.
template <class Read>
Result<LoadedScene> of_words(const std::string& name, const SequenceChoices& choices,
                             const OnDoing& doing, const Read& read) {
  auto kinds = load_modes(choices.mode_libraries);
  if (!kinds) return kinds.error();
  Result<SceneSpec> spec = read(added_kinds(*kinds));
  if (!spec) return spec.error();
  const bool is_felt = choices.wall != FeltWall::kNotFelt;
  const bool has_segments = std::any_of(spec->volumes.begin(), spec->volumes.end(),
                                        [](const VolumeSpec& v) { return v.segments.any(); });
  if (is_felt && spec->modes.empty() && !has_segments)
    return files::bad_input(name, "at modes: nothing would be felt: give a list of modes.");
  if (choices.values)
    for (VolumeSpec& volume : spec->volumes)
      if (volume.source.empty()) volume.values = choices.values;
  auto scene = of_spec(name, std::move(*spec), choices, doing);
  if (scene) scene->kinds = std::move(*kinds);
  return scene;
}

}  // namespace

Result<LoadedScene> load_scene_text(const std::string& text, const SequenceChoices& choices,
                                    const OnDoing& doing) {
  return of_words("scene", choices, doing, [&](const std::vector<std::string>& more_kinds) {
    return files::parse_scene("scene", text, more_kinds, nullptr, choices.folder);
  });
}

Result<LoadedScene> load_scene(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                               const OnDoing& doing) {
  const std::string name = inputs.front().string();
  const bool is_scene = inputs.size() == 1 && inputs.front().extension() == ".json";
  if (!choices.mode_libraries.empty() && !is_scene)
    return Error{
        ErrorKind::kBadInput,
        "Libraries of haptic modes are for a scene file, which names the modes: give one (.json)"};
  // Frames given by a program may have any name, also that of synthetic data.
  if (given_for(inputs, choices)) return of_sequence(inputs, choices, doing);
  using SyntheticScene = std::pair<const char*, SceneSpec (*)()>;
  for (const auto& [made, scene] :
       {SyntheticScene{"heart", heart_scene}, SyntheticScene{"shell", shell_scene},
        SyntheticScene{"molecule", molecule_scene}}) {
    if (inputs.size() != 1 || name != made) continue;
    if (choices.values)
      return Error{
          ErrorKind::kBadInput,
          fmt::format("'{}' is synthetic data, which have their own values at all times: leave "
                      "the choice of values out",
                      name)};
    return of_spec(name, scene(), choices, doing);
  }
  if (is_scene)
    return of_words(name, choices, doing, [&](const std::vector<std::string>& more_kinds) {
      return files::read_scene(inputs.front(), more_kinds, choices.folder);
    });
  if (inputs.size() == 1 && x3d::is_x3d(inputs.front())) {
    auto read = x3d::read_x3d(inputs.front(), choices.folder);
    if (!read) return read.error();
    if (choices.values)
      for (VolumeSpec& volume : read->spec.volumes)
        if (volume.source.empty()) volume.values = choices.values;
    std::vector<Note> notes;
    for (std::string& note : read->notes) notes.push_back(text_note(std::move(note)));
    return of_spec(name, std::move(read->spec), choices, doing, std::move(notes));
  }
  return of_sequence(inputs, choices, doing);
}

namespace {

/// Inputs that are not frames of one sequence become a volume each.
Result<LoadedScene> shown_scene(const std::vector<fs::path>& inputs, const SequenceChoices& choices,
                                const OnDoing& doing) {
  const auto vectors = std::count_if(inputs.begin(), inputs.end(), [](const fs::path& input) {
    return files::holds_vectors({input});
  });
  const bool alike = vectors == 0 ? bool(files::SequenceReader::open(inputs))
                                  : vectors == std::ptrdiff_t(inputs.size());
  if (inputs.size() == 1 || alike) return load_scene(inputs, choices, doing);
  LoadedScene all;
  for (const fs::path& input : inputs) {
    auto one = load_scene({input}, choices, doing);
    if (!one) return one.error();
    if (all.data.empty()) {
      all = std::move(*one);
      continue;
    }
    for (size_t v = 0; v < one->data.size(); ++v) {
      VolumeSpec volume = one->spec.volumes[v];
      volume.name += fmt::format(" ({})", all.data.size() + 1);
      // The middle of a file's data is placed at the origin: here that of the first file.
      if (!volume.files.empty()) volume.transform = all.spec.volumes.front().transform;
      all.spec.volumes.push_back(std::move(volume));
      all.data.push_back(one->data[v]);
    }
  }
  return all;
}

}  // namespace

Result<LoadedScene> load_shown_scene(const std::vector<fs::path>& inputs,
                                     const SequenceChoices& choices, const OnDoing& doing) {
  auto scene = shown_scene(inputs, choices, doing);
  if (scene && !scene->missing.empty() && choices.values && choices.values != CarriedValues::kOwn)
    return files::bad_input(inputs.front(),
                            "has no motion yet that could carry values: run 'palpate motion' and "
                            "name its output as the fields, or leave the choice of values out");
  return scene;
}

}  // namespace palpate::loading
