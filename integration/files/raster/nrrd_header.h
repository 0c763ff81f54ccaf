#pragma once

#include <string_view>

#include "integration/files/raster/nrrd_fields.h"
#include "integration/files/raster/raster.h"

namespace palpate::files {

/// What a NRRD header says (format: teem.sourceforge.net/nrrd/format.html, NRRD0001 to NRRD0006).
/// `text` begins with the magic and ends with the blank line before attached data, or with the
/// file. Three axes are space, or two: a slice. Another may be a list of frames or the components
/// of a vector, in any place: kinds and space directions say which. `axis N index values` (3D
/// Slicer sequences), `MultiVolume.FrameLabels`, `Seq_Frame0000_Timestamp` and time steps become
/// times. Space is turned to LPS, and vectors are if the file has a measurement frame. Data files
/// are resolved against the folder of `file`. Touches no file; any thread.
Result<Raster> parse_nrrd_header(const std::filesystem::path& file, std::string_view text);

/// The same for a header that was split already, with these axes. header_bytes: its length.
Result<Raster> nrrd_raster(const std::filesystem::path& file, const NrrdFields& header,
                           const std::vector<NrrdAxis>& axes, size_t header_bytes);

}  // namespace palpate::files
