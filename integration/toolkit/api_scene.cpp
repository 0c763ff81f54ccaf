// Scenes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "integration/files/scene/scene_file.h"
#include "integration/files/vtk_lines.h"
#include "integration/loading/load_scene.h"
#include "integration/loading/tubes_file.h"
#include "integration/running/open_session.h"
#include "integration/running/replay.h"
#include "integration/toolkit/motion_content.h"
#include "integration/toolkit/options.h"
#include "module/haptics/scene/scene.h"
#include "module/scene/data_box.h"

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
  if (!grid) return refused("have no valid grid: " + grid.error().message);
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

nlohmann::json texts_of(const char* const* texts, uint64_t count) {
  nlohmann::json list = nlohmann::json::array();
  for (uint64_t k = 0; k < count; ++k) list.push_back(texts[k]);
  return list;
}

/// The fields of the structure, as options; then the text of options.
Status take_options(const PalSceneInfo& info, running::SessionRequest& request) {
  const auto refused = [](const char* sentence) { return Error{ErrorKind::kBadInput, sentence}; };
  constexpr uint32_t kFlags = PAL_SCENE_MOVABLE | PAL_SCENE_TRUE_SIZE | PAL_SCENE_NOT_CYCLIC |
                              PAL_SCENE_LIVE | PAL_SCENE_NO_MOTION | PAL_SCENE_FORGET_MOTION;
  if (const Status checked = check_flags("PalSceneInfo", info.flags, kFlags); !checked)
    return checked;
  if (!has_strings(info.segments, info.segmentation_count) ||
      !has_strings(info.segment_names, info.segment_count))
    return refused("A segmentation's file or the name of a segment is missing");
  if (!has_strings(info.mode_libraries, info.mode_library_count))
    return refused("A path of the libraries of modes is missing");
  request.wait_s = 10.0;
  // Below 0 there is no friction.
  const bool no_friction = std::isfinite(info.friction) && info.friction < 0.0;
  OptionTaker take(request);
  if (info.iso_value) take.any("iso_value", number(*info.iso_value));
  take.number("strength_n", info.strength_n);
  if (no_friction)
    take.any("friction", 0.0);
  else
    take.number("friction", info.friction);
  take.number("frames_per_second", info.frames_per_second);
  take.text("fields", info.fields);
  take.text("folder", info.folder);
  take.text("wall", info.wall);
  take.text("values", info.values);
  take.number("width", info.width);
  take.number("scale", info.scale);
  if (info.segmentation_count > 0)
    take.any("segments", texts_of(info.segments, info.segmentation_count));
  take.number("segments_frame", double(info.segments_frame));
  if (info.segment_count > 0)
    take.any("segment_names", texts_of(info.segment_names, info.segment_count));
  if (info.mode_library_count > 0)
    take.any("modes", texts_of(info.mode_libraries, info.mode_library_count));
  take.text("image", info.image);
  take.text("transform", info.transform);
  take.number("wait_s", info.wait_s);
  take.flag("movable", info.flags, PAL_SCENE_MOVABLE, true);
  take.flag("true_size", info.flags, PAL_SCENE_TRUE_SIZE, true);
  take.flag("cyclic", info.flags, PAL_SCENE_NOT_CYCLIC, false);
  take.flag("motion", info.flags, PAL_SCENE_NO_MOTION, false);
  take.flag("forget_motion", info.flags, PAL_SCENE_FORGET_MOTION, true);
  take.all(info.options, running::OptionStage::kScene);
  if (!take.status()) return take.status();
  if (request.given.contains("segments") && request.given.contains("wall"))
    return refused("The parts of a segmentation are the walls: give segments or a wall");
  return Nothing{};
}

/// The host's request, checked and converted.
Result<running::SessionRequest> request_of(const PalSceneInfo& info,
                                           const std::vector<PalFrames>& all_frames) {
  running::SessionRequest request;
  if (const Status taken = take_options(info, request); !taken) return taken.error();
  if (info.paths) request.inputs = {info.paths, info.paths + info.path_count};
  for (const PalFrames& frames : all_frames) {
    auto given = given_of(frames);
    if (!given) return given.error();
    request.sequence.given[frames.name] = std::move(*given);
  }
  return request;
}

bool has_place(const PalSceneInfo& info) {
  return std::any_of(info.paths, info.paths + info.path_count,
                     [](const char* path) { return openigtlink::is_address(path); });
}

/// Loads the live scene, with the source of its frames.
Result<LoadedScene> load_live(const running::SessionRequest& request, LiveOrigin& origin) {
  const auto refused = [](const char* sentence) { return Error{ErrorKind::kBadInput, sentence}; };
  if (request.inputs.size() != 1) return refused("A live source is felt alone: give no other path");
  const std::string path = request.inputs.front().string();
  if (openigtlink::is_address(path)) {
    if (!request.transform.empty() && request.movable)
      return refused("Either transforms of the server move the volume, or the host does");
    auto read = running::load_request(request, {});
    if (!read) return read.error();
    origin.first = read->live->first();
    origin.is_server = true;
    return std::move(read->scene);
  }
  const auto& all_given = request.sequence.given;
  const auto given = all_given.find(path);
  if (all_given.size() != 1 || given == all_given.end())
    return refused(
        "With PAL_SCENE_LIVE the only path is the name of the only PalFrames, the first frame");
  const Sequence& frames = given->second->frames;
  if (frames.frames.size() != 1 || given->second->motion)
    return refused("With PAL_SCENE_LIVE there is one frame, the first, and no motion");
  origin.first = frames.frames.front();
  auto scene = running::live_scene(path, origin.first, request.sequence, true, request.movable);
  if (scene) running::apply_scene_options(request, *scene);
  return scene;
}

/// Loads the scene that the host describes by paths or JSON.
Result<LoadedScene> load(const PalSceneInfo& info, const running::SessionRequest& request) {
  if (!info.json) {
    auto read = running::load_request(request, {});
    if (!read) return read.error();
    return std::move(read->scene);
  }
  auto scene = loading::load_scene_text(info.json, request.sequence);
  if (scene) running::apply_scene_options(request, *scene);
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
  auto request = request_of(info, frames);
  if (!request) return failed(request.error());
  const bool is_live = (info.flags & PAL_SCENE_LIVE) || (has_paths && has_place(info));
  if (is_live && !has_paths)
    return failed(PAL_BAD_INPUT, {"A live source is felt as a sequence without a scene: give "
                                  "paths instead of JSON"});
  LiveOrigin origin;
  auto loaded = is_live ? load_live(*request, origin) : load(info, *request);
  if (!loaded) return failed(loaded.error());
  auto content = std::make_shared<SceneContent>();
  if (is_live) content->live = std::move(origin);
  content->context = use.shared();
  content->scene = std::move(*loaded);
  request->sequence.given.clear();  // the scene has what it needs of them
  content->request = std::move(*request);
  for (const auto& volume : content->scene.data)
    if (auto note = times_note(*volume, !content->scene.from_sequence))
      content->scene.notes.push_back(std::move(*note));
  for (const Note& note : content->scene.notes) content->context->say(note_text(note).c_str());
  *scene = reinterpret_cast<PalScene*>(Handle<SceneContent>::make(std::move(content)));
  return PAL_OK;
}

/// A text into the memory of the host, as far as it has room.
PalResult given_out(const std::string& all, char* text, size_t capacity, size_t* length) {
  if (length) *length = all.size();
  if (!text || capacity == 0) return PAL_OK;
  const size_t written = std::min(all.size(), capacity - 1);
  std::memcpy(text, all.data(), written);
  text[written] = '\0';
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
    return given_out(*all, text, capacity, length);
  });
}

PalResult pal_options(char* text, size_t capacity, size_t* length) {
  return guarded([&] {
    static const std::string all = palpate::running::options_json();
    return given_out(all, text, capacity, length);
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
    const palpate::DataBox box = palpate::box_of(*data.frames.front());
    for (int a = 0; a < 3; ++a) {
      known.corner_m[a] = box.corner_m[a];
      for (int c = 0; c < 3; ++c) known.edges_m[3 * a + c] = box.edges_m[a] * box.axes[a][c];
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
