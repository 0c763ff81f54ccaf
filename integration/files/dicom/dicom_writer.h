#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "compute/volume/result.h"
#include "compute/volume/sequence.h"

namespace palpate::files {

/// Made data as a series of MR images: one file per slice of a frame, 16-bit samples with slope and
/// intercept, explicit VR little endian. Each has its trigger time and temporal position. `id`
/// makes the unique identifiers: the same number, the same ones. `path_of` says where a file of
/// this name is to be written. The axes of the grid must be right-handed. Errors: kBadOutput, and
/// those of path_of. Any thread.
Status write_dicom(const Sequence& sequence, const std::string& description, uint64_t id,
                   const std::function<Result<std::filesystem::path>(const std::string&)>& path_of);

}  // namespace palpate::files
