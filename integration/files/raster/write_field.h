#pragma once

#include <filesystem>

#include "compute/volume/field.h"
#include "compute/volume/result.h"

namespace palpate::files {

/// Writes an ITK displacement field on the field's own grid (of an image with left-handed axes: on
/// that image's axes, see Grid::j_reversed_in_file): three floats per voxel, mm, LPS; the material
/// at x of the fixed frame is at x + u(x) in the moving one. By the ending: .mha, .nrrd,
/// .nii or .nii.gz. NIfTI carries the intent "vector" (1007) with LPS values, because every version
/// of ITK and ANTs reads that unchanged, while "displacement vector" (1006) is LPS to ITK
/// before 5.3 and RAS after. Whole or not at all; kBadOutput with a sentence. Any thread.
Status write_field(const Field& field, const std::filesystem::path& path);

}  // namespace palpate::files
