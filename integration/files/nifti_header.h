#pragma once

#include <string_view>

#include "integration/files/raster.h"

namespace palpate::files {

/// Bytes of a NIfTI-1 header.
inline constexpr size_t kNiftiHeaderBytes = 348;

/// What a NIfTI-1 header (.nii, or .hdr of a pair) says; either byte order. Space comes from the
/// sform where it names scanner coordinates or stands alone, else from the qform, as ITK chooses,
/// and is turned from RAS to LPS; units of space and time are honoured. `packed` says that the file
/// is a gzip stream. Vectors with the intent "vector" are LPS, as ITK and ANTs write them; with the
/// intent "displacement vector" they are RAS, as the standard says. Touches no file; any thread.
Result<Raster> parse_nifti_header(const std::filesystem::path& file, std::string_view bytes,
                                  bool packed);

}  // namespace palpate::files
