#pragma once

#include <string>

#include "integration/files/raster.h"

namespace palpate::files {

enum class FileKind { kNrrd, kMeta, kNifti, kPackedNifti, kDicom, kUnknown };

/// What a file is by its first bytes; its name is not asked. kBadInput if it can not be read or is
/// empty.
Result<FileKind> sniff(const std::filesystem::path& file);

/// The header of a NRRD, MetaImage or NIfTI file. kBadInput with a sentence for anything else. Any
/// thread.
Result<Raster> read_raster_header(const std::filesystem::path& file);

/// The header of a NRRD file as text, up to its first sample. kBadInput if it is none.
Result<std::string> read_nrrd_header_text(const std::filesystem::path& file);

/// True if the name is one under which such files go (.nrrd .nhdr .mha .mhd .nii .nii.gz .hdr).
bool has_raster_name(const std::filesystem::path& file);

/// Such files directly in a folder, hidden ones left out, "frame2" before "frame10".
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

}  // namespace palpate::files
