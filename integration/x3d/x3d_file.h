#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/scene_spec.h"

namespace palpate::x3d {

/// A scene read from X3D, with notes on what is not used.
struct X3dScene {
  SceneSpec spec;  ///< it may have no modes: most X3D scenes are made for display
  /// A sentence each: nodes, fields and ROUTEs without effect here, with their names.
  std::vector<std::string> notes;
  /// The scene file and those that it names: other scenes, volumes, segmentations.
  std::vector<std::filesystem::path> files;
};

/// Reads the scene of an X3D file in XML encoding, plain or packed by gzip (docs/x3d.md lists every
/// node and field). Its paths are relative to `folder`, or to the file's own folder if that is
/// empty. Errors: kBadInput, with one sentence that names the file and the line: not XML (also
/// where it is X3D in another encoding) or beyond the limits of parse_xml(). Likewise fields with
/// wrong values, undefined names, circular nodes or ROUTEs, transforms that shear or mirror,
/// missing files, and a scene without a volume. Any thread.
Result<X3dScene> read_x3d(const std::filesystem::path& file,
                          const std::filesystem::path& folder = {});

/// The same from text; looks for no files and opens no other scene. Any thread.
Result<X3dScene> parse_x3d(const std::filesystem::path& file, std::string_view text);

/// Whether a file is for read_x3d(), by its ending: .x3d, .x3dz, and those of the encodings that
/// read_x3d() refuses by name (.x3dv, .x3db, .wrl and their packed forms).
bool is_x3d(const std::filesystem::path& file);

/// A scene as text of an X3D file, with a sentence for everything that X3D can not express.
struct X3dText {
  std::string text;
  std::vector<std::string> notes;
};

/// Errors: kBadInput, with one sentence: volumes of files without a box (see place_by_box() of
/// module/scene/make_volume.h); synthetic data other than charges, for which there is no node.
/// Paths are written relative to the folder of `file`. Any thread.
Result<X3dText> x3d_text(const SceneSpec& scene, const std::filesystem::path& file);

}  // namespace palpate::x3d
