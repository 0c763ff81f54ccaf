#pragma once

#include <filesystem>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/sequence.h"
#include "compute/volume/volume.h"

namespace palpate::files {

/// Every writer goes by the ending of the name (.mha, .nrrd, .nii, .nii.gz), writes the whole file
/// or none (see AtomicFile), and returns kBadOutput with a sentence if that is not possible. Only
/// .nii.gz is packed: noise does not shrink, and writing should cost what the disk costs. NIfTI
/// keeps geometry in single precision. What was read from a file with left-handed axes is written
/// with these axes again (Grid::j_reversed_in_file). Any thread.

/// Samples as float.
Status write_volume(const Volume& volume, const std::filesystem::path& path);

/// Samples as uint8, 0 or 1.
Status write_mask(const Mask& mask, const std::filesystem::path& path);

/// Samples as float in [0, 1].
Status write_confidence(const Confidence& confidence, const std::filesystem::path& path);

/// Two components of float, mm: along the image gradient, and across it.
Status write_deviation(const Deviation& deviation, const std::filesystem::path& path);

/// A 3D Slicer sequence (.seq.nrrd), list axis last, times as index values in s if they are known.
/// All frames must be on the grid of the first.
Status write_sequence(const Sequence& sequence, const std::filesystem::path& path);

/// To be asked before long work: does the name end in a format that palpate writes, and can the
/// file be written?
Status check_can_write_image(const std::filesystem::path& path, double bytes = 0.0);

}  // namespace palpate::files
