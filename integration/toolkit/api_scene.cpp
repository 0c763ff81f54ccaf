// Scenes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integration/files/scene/scene_file.h"
#include "integration/files/vtk_lines.h"
#include "integration/loading/load_scene.h"
#include "integration/loading/tubes_file.h"
#include "integration/running/live_source.h"
#include "integration/running/replay.h"
#include "integration/toolkit/motion_content.h"
#include "integration/toolkit/options.h"
#include "module/haptics/scene/scene.h"

namespace palpate::toolkit {
namespace {

Result<std::shared_ptr<const loading::GivenVolume>> given_of(const PalFrames& frames) {
  const auto refused = [&](const std::string& what) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The frames '{}' {}", frames.name ? frames.name : "", what)};
  };
  if (!frames.name || !*frames.name) return refused("need a name");
  if (frames.frame_count == 0 || !frames.frames) return refused("are none");
  const auto grid = grid_of(frames.grid);
  if (!grid) return refused("have no sound grid: " + grid.error().message);
  auto given = std::make_shared<loading::GivenVolume>();
  Sequence& sequence = given->frames;
  sequence.name = frames.name;
  for (uint32_t k = 0; k < frames.frame_count; ++k) {
    auto volume = volume_of(*grid, frames.sample_type, frames.frames[k]);
    if (!volume)
      return refused(fmt::format("can not be taken, in frame {}: {}", k, volume.error().message));
    sequence.frames.push_back(std::move(*volume));
    if (!frames.times_s) continue;
    sequence.times_s.push_back(frames.times_s[k]);
    if (!std::isfinite(sequence.times_s[k]) ||
        (k > 0 && !(sequence.times_s[k] > sequence.times_s[k - 1])))
      return refused("have times that do not rise");
  }
  sequence.times_known = frames.times_s != nullptr;
  if (frames.motion) {
    const Use motion(of(frames.motion));
    if (!motion) return refused("have a motion that was closed");
    auto whole = whole_of(*motion);
    if (!whole) return refused("have a motion that can not be used: " + whole.error().message);
    given->motion = std::move(*whole);
  }
  return std::shared_ptr<const loading::GivenVolume>(std::move(given));
}

/// An array has the stride of the structure as the program knows it.
PalResult take_frames(const PalSceneInfo& info, std::vector<PalFrames>& all) {
  if (info.frame_sets > 0 && !info.frames)
    return failed(PAL_BAD_INPUT, {"PalSceneInfo.frames is missing"});
  for (uint32_t k = 0; k < info.frame_sets; ++k) {
    const auto* const at =
        reinterpret_cast<const char*>(info.frames) + size_t(k) * info.frames->size;
    if (const PalResult read = taken(reinterpret_cast<const PalFrames*>(at),
                                     offsetof(PalFrames, times_s), "PalFrames", all.emplace_back());
        read != PAL_OK)
      return read;
  }
  return PAL_OK;
}

bool has_strings(const char* const* strings, uint64_t count) {
  return count == 0 || (strings && std::all_of(strings, strings + count, [](const char* string) {
                          return string && *string;
                        }));
}

/// Reads the options of a sequence without a scene file.
Status take_words(const PalSceneInfo& info, loading::SequenceChoices& choices) {
  const auto refused = [](const std::string& sentence) {
    return Error{ErrorKind::kBadInput, sentence};
  };
  if (info.wall) {
    const std::string wall = info.wall;
    if (wall != "values" && wall != "region" && wall != "ridges")
      return refused("There is no wall '" + wall + "': values, region or ridges");
    choices.wall = wall == "values"   ? loading::FeltWall::kValues
                   : wall == "region" ? loading::FeltWall::kRegion
                                      : loading::FeltWall::kRidges;
  }
  if (info.values) {
    const auto& known = files::SceneWords::kValues;
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const auto& word) { return word.first == info.values; });
    if (found == known.end())
      return refused(fmt::format("There are no values '{}': reference, mean or own", info.values));
    choices.values = found->second;
  }
  if (info.width > 0.0) choices.width = info.width;
  if (info.segmentation_count > 0 && info.wall)
    return refused("The parts of a segmentation are the walls: give segments or a wall");
  if (!has_strings(info.segments, info.segmentation_count) ||
      !has_strings(info.segment_names, info.segment_count))
    return refused("A segmentation's file or the name of a segment is missing");
  for (uint32_t k = 0; k < info.segmentation_count; ++k)
    choices.segments.emplace_back(info.segments[k]);
  for (uint64_t k = 0; k < info.segment_count; ++k)
    choices.segment_names.emplace_back(info.segment_names[k]);
  choices.segments_frame = info.segments_frame;
  return Nothing{};
}

Status check_numbers(const PalSceneInfo& info) {
  constexpr uint32_t kFlags = PAL_SCENE_MOVABLE | PAL_SCENE_TRUE_SIZE | PAL_SCENE_NOT_CYCLIC |
                              PAL_SCENE_LIVE | PAL_SCENE_NO_MOTION | PAL_SCENE_FORGET_MOTION;
  // Below 0 there is no friction.
  const double friction =
      std::isfinite(info.friction) ? std::max(info.friction, 0.0) : info.friction;
  for (const Status& checked :
       {check_flags("PalSceneInfo", info.flags, kFlags),
        check_number("iso_value", info.iso_value ? *info.iso_value : 0.0, files::kAnyNumber),
        check_field("strength_n", info.strength_n, files::kSurfaceStrengths_n),
        check_field("friction", friction, files::kFrictions),
        check_field("frames_per_second", info.frames_per_second, files::kFrameRates),
        check_field("width", info.width, files::kWidths),
        check_field("scale", info.scale, files::kScales),
        check_field("segments_frame", double(info.segments_frame), files::kFrameNumbers),
        check_field("wait_s", info.wait_s, files::kWaits_s)})
    if (!checked) return checked.error();
  return Nothing{};
}

/// The host's choices, checked and converted.
Result<loading::SequenceChoices> choices_of(const PalSceneInfo& info,
                                            const std::vector<PalFrames>& all_frames) {
  if (const Status checked = check_numbers(info); !checked) return checked.error();
  loading::SequenceChoices choices;
  if (info.iso_value) choices.iso_value = *info.iso_value;
  if (info.strength_n > 0.0) choices.strength_n = info.strength_n;
  if (info.friction != 0.0) choices.friction = std::max(info.friction, 0.0);
  choices.frames_per_second = info.frames_per_second;
  if (info.fields) choices.fields = info.fields;
  if (info.folder) choices.folder = info.folder;
  choices.cyclic = !(info.flags & PAL_SCENE_NOT_CYCLIC);
  choices.finds_motion = !(info.flags & PAL_SCENE_NO_MOTION);
  if (const Status words = take_words(info, choices); !words) return words.error();
  if (!has_strings(info.mode_libraries, info.mode_library_count))
    return Error{ErrorKind::kBadInput, "A path of the libraries of modes is missing"};
  for (uint32_t k = 0; k < info.mode_library_count; ++k)
    choices.mode_libraries.emplace_back(info.mode_libraries[k]);
  for (const PalFrames& frames : all_frames) {
    auto given = given_of(frames);
    if (!given) return given.error();
    choices.given[frames.name] = std::move(*given);
  }
  return choices;
}

bool has_place(const PalSceneInfo& info) {
  return std::any_of(info.paths, info.paths + info.path_count,
                     [](const char* path) { return openigtlink::is_place(path); });
}

/// Loads the live scene, with the source of its frames.
Result<LoadedScene> load_live(const PalSceneInfo& info, const loading::SequenceChoices& choices,
                              LiveOrigin& origin) {
  const auto refused = [](const char* sentence) { return Error{ErrorKind::kBadInput, sentence}; };
  constexpr double kUsualWait_s = 10.0;
  if (info.path_count != 1) return refused("A live source is felt alone: give no other path");
  const std::string path = info.paths[0];
  if (!openigtlink::is_place(path)) {
    const auto given = choices.given.find(path);
    if (choices.given.size() != 1 || given == choices.given.end())
      return refused(
          "With PAL_SCENE_LIVE the only path is the name of the only PalFrames, the first frame");
    const Sequence& frames = given->second->frames;
    if (frames.frames.size() != 1 || given->second->motion)
      return refused("With PAL_SCENE_LIVE there is one frame, the first, and no motion");
    origin.first = frames.frames.front();
    return running::live_scene(path, frames.frames.front(), choices, true,
                               (info.flags & PAL_SCENE_MOVABLE) != 0);
  }
  if (info.image) origin.image = info.image;
  if (info.transform) origin.transform = info.transform;
  if (!origin.transform.empty() && (info.flags & PAL_SCENE_MOVABLE))
    return refused("Either transforms of the server move the volume, or the host does");
  running::LiveSourceOptions options;
  options.image = origin.image;
  options.transform = origin.transform;
  auto source = running::LiveSource::open(path, std::move(options));
  if (!source) return source.error();
  auto scene = (*source)->load(choices, true, {}, info.wait_s > 0.0 ? info.wait_s : kUsualWait_s);
  origin.place = path;
  origin.first = (*source)->first();
  return scene;
}

PalResult open_scene(PalContext* context, const PalSceneInfo* given, PalScene** scene) {
  const Use use(of(context));
  if (!use) return refused_handle("context");
  if (!scene) return failed(PAL_BAD_INPUT, {"The argument that takes the scene is NULL"});
  PalSceneInfo info;
  if (const PalResult read = taken(given, offsetof(PalSceneInfo, folder), "PalSceneInfo", info);
      read != PAL_OK)
    return read;
  const bool has_paths = info.path_count > 0 && info.paths;
  if (has_paths == (info.json != nullptr))
    return failed(PAL_BAD_INPUT,
                  {"A scene is opened from paths or from JSON: give one of the two"});
  if (has_paths && std::any_of(info.paths, info.paths + info.path_count,
                               [](const char* path) { return !path || !*path; }))
    return failed(PAL_BAD_INPUT, {"A path of the scene is empty"});
  std::vector<PalFrames> frames;
  if (const PalResult read = take_frames(info, frames); read != PAL_OK) return read;
  auto choices = choices_of(info, frames);
  if (!choices) return failed(choices.error());
  const bool is_live = (info.flags & PAL_SCENE_LIVE) || (has_paths && has_place(info));
  if (is_live && !has_paths)
    return failed(PAL_BAD_INPUT, {"A live source is felt as a sequence without a scene: give "
                                  "paths instead of JSON"});
  LiveOrigin origin;
  auto loaded = is_live ? load_live(info, *choices, origin)
                : has_paths
                    ? loading::load_scene({info.paths, info.paths + info.path_count}, *choices)
                    : loading::load_scene_text(info.json, *choices);
  if (!loaded) return failed(loaded.error());
  if (info.flags & PAL_SCENE_FORGET_MOTION) forget_motion(*loaded);
  if (info.flags & PAL_SCENE_NO_MOTION) loaded->missing.clear();
  if (info.scale > 0.0 && loaded->from_sequence)
    loaded->spec.volumes[0].transform.scale = glm::dvec3(info.scale);
  auto content = std::make_shared<SceneContent>();
  if (is_live) content->live = std::move(origin);
  content->context = use.shared();
  content->scene = std::move(*loaded);
  content->keeps_size = (info.flags & PAL_SCENE_TRUE_SIZE) || info.scale > 0.0;
  if (info.flags & PAL_SCENE_MOVABLE) make_movable(content->scene);
  for (const auto& volume : content->scene.data)
    if (auto note = assumed_times_note(*volume)) content->scene.notes.push_back(std::move(*note));
  for (const Note& note : content->scene.notes) content->context->say(note_text(note).c_str());
  *scene = reinterpret_cast<PalScene*>(Handle<SceneContent>::make(std::move(content)));
  return PAL_OK;
}

PalResult replay(const PalScene* scene, const char* recording, const char* tubes,
                 PalReplay* result) {
  const Use use(of(scene));
  if (!use) return refused_handle("scene");
  if (!recording) return failed(PAL_BAD_INPUT, {"The path of the recording is missing"});
  PalReplay known;
  if (const PalResult read =
          taken(result, offsetof(PalReplay, first_different), "PalReplay", known);
      read != PAL_OK)
    return read;
  if (tubes)
    if (const Status can = files::check_can_write_vtk(tubes); !can) return failed(can.error());
  HandTubes released;
  const auto replayed = running::replay_felt(use->scene, recording, released);
  if (!replayed) return failed(replayed.error());
  if (tubes)
    if (const Status written = loading::write_tubes(tubes, *released.tubes()); !written)
      return failed(written.error());
  known.is_cut_off = replayed->cut_off;
  known.ticks = replayed->ticks;
  known.different = replayed->different;
  known.first_different = replayed->first_different;
  std::memcpy(result, &known, result->size);
  return PAL_OK;
}

Result<std::string> text_of(const LoadedScene& scene, PalSceneText which) {
  if (which == PAL_SCENE_TEXT_PLAN) {
    const auto planned = plan(scene.spec, scene.data, scene.kinds);
    if (!planned) return planned.error();
    return text(**planned);
  }
  if (which == PAL_SCENE_TEXT_JSON) return files::scene_text(scene.spec);
  std::string notes;
  for (const Note& note : scene.notes) notes += note_text(note) + "\n";
  return notes;
}

}  // namespace

void rows_of(const Transform& transform, double rows[12]) {
  const glm::dmat3 linear = transform.linear();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rows[4 * row + column] = linear[column][row];
    rows[4 * row + 3] = transform.translation_m[row];
  }
}

}  // namespace palpate::toolkit

using namespace palpate::toolkit;

PalResult pal_scene_open(PalContext* context, const PalSceneInfo* info, PalScene** scene) {
  return guarded([&] { return open_scene(context, info, scene); });
}

PalResult pal_scene_close(PalScene** scene) {
  return guarded([&] {
    closed(of(taken_out_of(scene)));
    return PAL_OK;
  });
}

PalResult pal_scene_text(const PalScene* scene, PalSceneText which, char* text, size_t capacity,
                         size_t* length) {
  return guarded([&] {
    const Use use(of(scene));
    if (!use) return refused_handle("scene");
    if (which < PAL_SCENE_TEXT_NOTES || which > PAL_SCENE_TEXT_JSON)
      return failed(PAL_BAD_INPUT, {"There is no such text of a scene"});
    const auto all = text_of(use->scene, which);
    if (!all) return failed(all.error());
    if (length) *length = all->size();
    if (!text || capacity == 0) return PAL_OK;
    const size_t written = std::min(all->size(), capacity - 1);
    std::memcpy(text, all->data(), written);
    text[written] = '\0';
    return PAL_OK;
  });
}

PalResult pal_scene_replay(const PalScene* scene, const char* recording, const char* tubes,
                           PalReplay* replayed) {
  return guarded([&] { return replay(scene, recording, tubes, replayed); });
}

PalResult pal_scene_volume(const PalScene* scene, uint32_t index, PalVolume* volume) {
  return guarded([&] {
    const Use use(of(scene));
    if (!use) return refused_handle("scene");
    PalVolume known;
    if (const PalResult read = taken(volume, offsetof(PalVolume, length_s), "PalVolume", known);
        read != PAL_OK)
      return read;
    const palpate::LoadedScene& of_scene = use->scene;
    if (index >= of_scene.data.size()) return PAL_END;
    const palpate::MovingVolume& data = *of_scene.data[index];
    const palpate::VolumeSpec& spec = of_scene.spec.volumes[index];
    known.frame_count = uint32_t(data.times.times_s.size());
    known.length_s = data.times.length_s();
    for (int a = 0; a < 3; ++a) {
      known.low_m[a] = data.frames.front()->low_m()[a];
      known.high_m[a] = data.frames.front()->high_m()[a];
    }
    rows_of(spec.transform, known.world_from_volume);
    known.is_motion_known = std::none_of(
        of_scene.missing.begin(), of_scene.missing.end(),
        [&](const palpate::MissingMotion& missing) { return missing.volume == index; });
    known.is_movable = spec.drive.kind == palpate::DriveSpec::Kind::kSecondHand;
    std::memcpy(volume, &known, volume->size);
    return PAL_OK;
  });
}
