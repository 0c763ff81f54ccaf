#pragma once

#include <string_view>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// Bytes of the headers of NIfTI-1 and NIfTI-2; a header starts with this number.
inline constexpr size_t kNiftiHeaderBytes = 348, kNifti2HeaderBytes = 540;

/// Whether a file that starts with these bytes can be NIfTI, of either version and byte order.
bool starts_like_nifti(std::string_view bytes);

/// What a NIfTI-1 or NIfTI-2 header (.nii, or .hdr of a pair) says; either byte order. Space comes
/// from the sform where it names scanner coordinates or stands alone, else from the qform, as ITK
/// chooses, and is turned from RAS to LPS. Where sform and qform differ by more than half a voxel,
/// a note says which is used; units of space and time are honoured. `packed` says that the file is
/// a gzip stream. Vectors with the intent "vector" are LPS, as ITK and ANTs write them; with the
/// intent "displacement vector" they are RAS, as the standard says. NiftyReg's displacements (RAS)
/// and deformations, and SPM's deformations (places, RAS) are told by their names; kBadInput for
/// warps of FSL and for velocities and splines. Touches no file; any thread.
Result<Raster> parse_nifti_header(const std::filesystem::path& file, std::string_view bytes,
                                  bool packed);

}  // namespace palpate::files
