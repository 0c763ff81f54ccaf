#pragma once

#include <string_view>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// What a MetaImage header (.mha, .mhd) says. `text` begins with the file and goes to the end of
/// the ElementDataFile line, or of the list of files after it. 2D (a slice) or 3D, with frames
/// slowest in 4D, or where Kinds says "list" of the last axis or PLUS says something of each frame.
/// Frames have the times of their `Seq_Frame0000_Timestamp`; without these, a spacing of the frames
/// other than 1 is the time step in seconds (the format knows no units). ElementToIntensityFunction
/// and UltrasoundImageOrientation are applied. Touches no file; any thread.
Result<Raster> parse_meta_header(const std::filesystem::path& file, std::string_view text);

}  // namespace palpate::files
