#pragma once

#include "integration/files/raster/raster.h"
#include "module/scene/raw_samples.h"

namespace palpate::files {

/// The header that a file without one gets from what somebody says of it. Its axes are those of a
/// scene: i along L, j along S, k along A. kBadInput for sizes that can not be. Touches no file;
/// any thread.
Result<Raster> raw_header(const std::filesystem::path& file, const RawSamples& samples);

}  // namespace palpate::files
