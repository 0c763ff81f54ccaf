#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/scene_spec.h"

namespace palpate::files {

/// A scene as a person wrote it down (docs/scene-file.md says every key). Paths in it are relative
/// to `folder`, or to the file's own where that is empty. kBadInput, in one sentence that names the
/// file and the place in it (modes[1].strength): what is no JSON, unknown keys (with the nearest
/// known one), wrong types and numbers, names that do not exist, files that are not there.
/// `more_kinds`: kinds of mode beyond the built-in ones. Any thread.
Result<SceneSpec> read_scene(const std::filesystem::path& file,
                             const std::vector<std::string>& more_kinds = {},
                             const std::filesystem::path& folder = {});

/// The same from text that was read; looks for no files. `accepted` gets every key that was asked
/// for, as "modes[].strength": what the documentation has to say.
Result<SceneSpec> parse_scene(const std::filesystem::path& file, std::string_view text,
                              const std::vector<std::string>& more_kinds = {},
                              std::set<std::string>* accepted = nullptr,
                              const std::filesystem::path& folder = {});

/// Writes a scene so that read_scene gives it back: keys that differ from their default, paths
/// relative to the file. kBadOutput if it can not be written. Any thread.
Status write_scene(const SceneSpec& scene, const std::filesystem::path& file);

/// The same as text; paths relative to where `file` would be. Any thread.
std::string scene_text(const SceneSpec& scene, const std::filesystem::path& file = "scene.json");

/// Whether a key of a mode has an effect on modes of this kind; a user's own kinds may use all. One
/// without effect is refused.
bool mode_key_applies(std::string_view kind, std::string_view key);

/// The words of the file for what scene.h enumerates.
struct SceneWords {
  static const std::vector<std::pair<std::string_view, ScalarProperty>> kScalars;
  static const std::vector<std::pair<std::string_view, VectorProperty>> kVectors;
  static const std::vector<std::pair<std::string_view, DriveSpec::Kind>> kDrives;
  static const std::vector<std::pair<std::string_view, PosePath>> kPaths;
  static const std::vector<std::pair<std::string_view, BackTracking>> kBackTrackings;
  static const std::vector<std::pair<std::string_view, CarriedValues>> kValues;
  static const std::vector<std::pair<std::string_view, SampleType>> kSampleTypes;
  /// Of values; files go without a word.
  static const std::vector<std::pair<std::string_view, SegmentsFrom>> kDerivedSegments;
};

}  // namespace palpate::files
