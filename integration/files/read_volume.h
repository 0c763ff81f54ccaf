#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/vector_frame.h"
#include "compute/volume/volume.h"
#include "module/scene/raw_samples.h"

namespace palpate::files {

/// Sentences about files that are read all the same, which a person should see (SequenceReader has
/// the same); readers append to them.
using Notes = std::vector<std::string>;

/// Exactly one 3D frame: a NRRD, MetaImage or NIfTI file (a 4D file with one frame will do) or a
/// folder of DICOM slices. Rescaled once. Left-handed axes are made right-handed, see make_grid().
/// nan_as: what samples that are NaN become; without it kNotFinite refuses them. kBadInput with a
/// sentence otherwise. Any thread.
Result<Volume> read_volume(const std::filesystem::path& input, Notes* notes = nullptr,
                           std::optional<float> nan_as = {});

/// The same as a mask: what is not zero is inside (1), what is zero is outside (0).
Result<Mask> read_mask(const std::filesystem::path& input, Notes* notes = nullptr);

/// Frames of vectors: a file in any of the formats, a list of them, or a folder with nothing else,
/// in natural order of names. All must have one grid. kBadInput with a sentence otherwise. Any
/// thread.
Result<std::vector<VectorFrame>> read_vectors(const std::vector<std::filesystem::path>& inputs);

/// Whether read_vectors() is the one to ask: the first file holds three values per voxel. False for
/// what can not be read: whoever reads it then says why.
bool holds_vectors(const std::vector<std::filesystem::path>& inputs);

/// The one volume, or the one frame of vectors along L, P, S, of a file without a header. kBadInput
/// with a sentence if it is not just as long as that takes, or holds values that are not finite.
/// Any thread.
Result<Volume> read_raw_volume(const std::filesystem::path& file, const RawSamples& samples);
Result<VectorFrame> read_raw_vectors(const std::filesystem::path& file, const RawSamples& samples);

/// An ITK displacement field: three components per voxel, mm along L, P, S, in any of the file
/// formats. NIfTI vectors with the intent "displacement vector" are turned from RAS. kBadInput with
/// a sentence otherwise. Any thread.
Result<Field> read_field(const std::filesystem::path& file, Notes* notes = nullptr);

}  // namespace palpate::files
