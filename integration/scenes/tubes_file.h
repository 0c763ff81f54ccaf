#pragma once

#include <filesystem>

#include "compute/volume/result.h"
#include "module/session/hand_tubes.h"

namespace palpate::scenes {

/// Writes stream tubes as lines in the patient space of their volumes (LPS, mm), where they were
/// when they were released: there they are the field lines. Of each point `length`, that of the
/// vector (StreamTube::lengths()), and `to_first_frame`, by which the motion takes it to where it
/// is in the first frame (mm); of each line `volume` (of the scene, from 0 on), `field`
/// (TubeField), `frame` (when it was released, with its phase) and `kept`. See write_vtk_lines().
Status write_tubes(const std::filesystem::path& path, const ReleasedTubes& tubes);

}  // namespace palpate::scenes
