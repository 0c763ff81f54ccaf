#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "integration/files/scene/json_object.h"
#include "module/scene/scene_spec.h"
#include "module/scene/transfer.h"
#include "module/scene/transform.h"

namespace palpate::files {

/// Values of a scene that are more than a number. Each reads one key of `parent`: a missing one
/// leaves the value as it is, a wrong one refuses.

/// World from volume: translation, rotation and scale, or one matrix.
void read_transform(JsonObject& parent, const char* key, Transform& out);

/// Transforms whose parts change by keys, one within the other. Only the form is checked here:
/// check() of module/scene/drive.h says whether they can be followed.
void read_keyed_poses(JsonObject& parent, const char* key, std::vector<KeyedPose>& out);

/// Three numbers that are not all 0.
void read_direction(JsonObject& o, const char* key, glm::dvec3& out);

/// A file name or a list of them, relative to the folder of the reading.
std::vector<std::filesystem::path> read_paths(JsonObject& o, const char* key);

/// A number, { "pairs": ... } or { "window": ... }; no output outside of the range, which does not
/// reach below 0.
void read_transfer(JsonObject& parent, const char* key, TransferFunction& out,
                   const NumberRange& range);

/// What is in a file without a header.
void read_raw(JsonObject& parent, const char* key, std::optional<RawSamples>& out);

/// Segmentations of a volume and their parts.
void read_segments(JsonObject& parent, const char* key, SegmentsSpec& out);

/// How a volume is to be seen: a preset or points of its own, a window, stream tubes.
void read_appearance(JsonObject& parent, const char* key, AppearanceSpec& out);

}  // namespace palpate::files
