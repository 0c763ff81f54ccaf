#pragma once

#include <filesystem>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate::files {

/// Exactly one 3D frame: a NRRD, MetaImage or NIfTI-1 file (a 4D file with one frame will do) or a
/// folder of DICOM slices. Rescaled once. kBadInput with a sentence otherwise. Any thread.
Result<Volume> read_volume(const std::filesystem::path& input);

/// The same as a mask: what is not zero is inside (1), what is zero is outside (0).
Result<Mask> read_mask(const std::filesystem::path& input);

/// An ITK displacement field: three components per voxel, mm along L, P, S, in any of the file
/// formats. NIfTI vectors with the intent "displacement vector" are turned from RAS. kBadInput with
/// a sentence otherwise. Any thread.
Result<Field> read_field(const std::filesystem::path& file);

}  // namespace palpate::files
