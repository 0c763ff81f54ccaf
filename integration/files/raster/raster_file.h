#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// What a file is: an image in one of raster_formats(), DICOM, or neither.
enum class FileKind { kImage, kDicom, kUnknown };

/// What a file is by its first bytes; its name does not matter. kBadInput if it can not be read or
/// is empty.
Result<FileKind> sniff(const std::filesystem::path& file);

/// A format of image files. It has to say where the samples lie (Raster); reading them, with all
/// checks, is the same for all formats.
struct RasterFormat {
  std::string name;                  ///< for people: "NRRD"
  std::vector<std::string> endings;  ///< of the names of its files, in lower case: ".nrrd"
  /// Whether a file that starts with these bytes, 4096 at most, is one.
  bool (*is_start)(std::string_view bytes);
  /// kBadInput with a sentence for an impossible header.
  Result<Raster> (*read_header)(const std::filesystem::path& file);
};

/// The formats, in the order in which they are tried.
const std::vector<RasterFormat>& raster_formats();

/// Adds a format, which is tried after the others. Call it once per format, before any file is
/// read.
void add_raster_format(RasterFormat format);

/// The format of a file, or null if it is in none of them or can not be read.
const RasterFormat* raster_format_of(const std::filesystem::path& file);

/// The first n bytes of a file, fewer if it is shorter. kBadInput if it can not be read or is
/// empty.
Result<std::string> start_of_file(const std::filesystem::path& file, size_t n);

/// The header of a file in one of raster_formats(). kBadInput with a sentence for anything else.
/// Any thread.
Result<Raster> read_raster_header(const std::filesystem::path& file);

/// The header of a NRRD file as text, up to its first sample. kBadInput if it is none.
Result<std::string> read_nrrd_header_text(const std::filesystem::path& file);

/// True if the name is one under which files of raster_formats() go.
bool has_raster_name(const std::filesystem::path& file);

/// Such files directly in a folder, hidden ones left out, "frame2" before "frame10".
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// kBadInput if a folder directly holds DICOM files beside these images: either can be meant.
Status check_one_kind(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& images);

}  // namespace palpate::files
