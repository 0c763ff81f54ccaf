#pragma once

#include <filesystem>

#include "compute/volume/result.h"
#include "module/session/hand_tubes.h"

namespace palpate::loading {

/// The title of such a file, in its second line.
inline constexpr const char* kTubesTitle = "palpate stream tubes, mm";

/// Writes stream tubes as lines in the patient space of their volumes (LPS, mm), at the places
/// where they were released: there they are the field lines. Per point: `length` of the vector
/// (StreamTube::lengths()) and `to_first_frame`, the displacement by the motion to the first frame
/// (mm). Per line: `volume` (index in the scene), `field` (TubeField), `frame` (of the release,
/// with its phase) and `kept`. See write_vtk_lines(). Errors: kBadOutput.
Status write_tubes(const std::filesystem::path& path, const ReleasedTubes& tubes);

}  // namespace palpate::loading
