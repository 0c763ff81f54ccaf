#pragma once

#include <string_view>

#include "integration/files/raster.h"

namespace palpate::files {

/// What a MetaImage header (.mha, .mhd) says. `text` begins with the file and goes to the end of
/// the ElementDataFile line, or of the list of files after it. 3D, or 4D with time slowest; a
/// fourth spacing other than 1 is the time step in seconds (the format knows no units).
/// ElementToIntensityFunction is applied. Touches no file; any thread.
Result<Raster> parse_meta_header(const std::filesystem::path& file, std::string_view text);

}  // namespace palpate::files
