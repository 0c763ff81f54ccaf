#pragma once

#include <string>
#include <utility>
#include <vector>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// An image in memory, ready for any format. Frames follow each other; the components of a voxel
/// lie together.
struct ImageToWrite {
  Grid grid;
  SampleType type = SampleType::kFloat;  ///< kFloat or kUint8
  size_t components = 1;
  std::vector<const void*> frames;  ///< grid.count() * components samples each
  std::vector<double> times_s;      ///< one per frame, or empty if not known
  const char* list_of = "frame";    ///< NRRD: what the list axis counts where times are not known
  std::vector<std::pair<std::string, std::string>> keys;  ///< NRRD: key and value pairs
};

/// Which format a name asks for. kBadOutput if it is none that is written.
enum class ImageFormat { kMeta, kNrrd, kNifti, kPackedNifti };
Result<ImageFormat> format_of(const std::filesystem::path& path);

/// Writes the picture atomically.
Status write_picture(const ImageToWrite& picture, const std::filesystem::path& path);

/// Headers as bytes, up to the first sample, in the order of the file (as_in_file()). Pure.
std::string meta_header_of(const ImageToWrite& picture);
std::string nrrd_header_of(const ImageToWrite& picture);
std::string nifti_header_of(const ImageToWrite& picture);

}  // namespace palpate::files
