#pragma once

#include <map>
#include <string>
#include <string_view>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// What PLUS and 3D Slicer's IGT modules say of each frame in a header, as MetaImage field or NRRD
/// key: `Seq_Frame0003_Timestamp = 100.75` is frame 3, "timestamp". Names in lower case.
using FrameFields = std::map<size_t, std::map<std::string, std::string>>;

/// These of all fields; names are compared without regard to case.
FrameFields frame_fields(const std::map<std::string, std::string>& fields);

/// Takes the time stamps (s), and notes how far the probe moved and where its place is not known.
/// kBadInput with a sentence if a frame has no picture, if the times do not rise, or if the probe
/// moved so far that the frames are a sweep through space rather than pictures of one place.
Status apply_frame_fields(const FrameFields& fields, Raster& raster);

/// Turns the axes of a file by `UltrasoundImageOrientation` of PLUS: a letter per axis says towards
/// what it counts (M marked side, U unmarked; F far from the probe, N near; A ascending, D
/// descending). PLUS and 3D Slicer place the picture as if it were stored as MFA. An empty one
/// changes nothing, nor does one that can not be understood, which is noted. axes: those of space,
/// 2 or 3.
void turn_ultrasound(std::string_view orientation, int axes, Placement& placement, Raster& raster);

}  // namespace palpate::files
