#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/scene_spec.h"

namespace palpate::x3d {

/// A scene that was read from X3D, with what of it is not used.
struct X3dScene {
  SceneSpec spec;  ///< its modes may be none: X3D scenes are for the eye first
  /// A sentence each: nodes, fields and ROUTEs that have no effect here, all by name.
  std::vector<std::string> notes;
  /// The scene file and those that it names: other scenes, volumes, segmentations.
  std::vector<std::filesystem::path> files;
};

/// The scene of an X3D file in its XML encoding (docs/x3d.md says every node and field). Paths in
/// it are relative to `folder`, or to the file's own where that is empty. kBadInput, in one
/// sentence that names the file and the line: what is no XML or goes beyond the bounds of
/// parse_xml(), fields with wrong values, names that nothing defines, nodes and ROUTEs that lead
/// back to themselves, transforms that shear or mirror, files that are not there, and a scene
/// without a volume. Any thread.
Result<X3dScene> read_x3d(const std::filesystem::path& file,
                          const std::filesystem::path& folder = {});

/// The same from text that was read; looks for no files and opens no other scene. Any thread.
Result<X3dScene> parse_x3d(const std::filesystem::path& file, std::string_view text);

/// Whether a file is to be read by read_x3d(): by its ending, .x3d.
bool is_x3d(const std::filesystem::path& file);

/// A scene as text of an X3D file, with a sentence for all that X3D can not say.
struct X3dText {
  std::string text;
  std::vector<std::string> notes;
};

/// Volumes of files need a box (see place_by_box() of module/scene/make_volume.h), synthetic data
/// other than charges have no node: kBadInput, in one sentence. Paths are made relative to where
/// `file` would be. Any thread.
Result<X3dText> x3d_text(const SceneSpec& scene, const std::filesystem::path& file);

}  // namespace palpate::x3d
