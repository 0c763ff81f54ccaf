#pragma once

#include <optional>
#include <string>
#include <vector>

#include "integration/files/dicom/dicom_elements.h"
#include "integration/files/dicom/dicom_layout.h"
#include "integration/files/raster/mapped_file.h"

namespace palpate::files {

/// How a pixel lies in memory. `stored` of `allocated` bits count, the lowest ones; what lies above
/// them may be anything.
struct PixelLayout {
  int allocated = 0;
  int stored = 0;
  bool is_signed = false;
  bool big_endian = false;
  bool swapped_bytes = false;  ///< bytes lie in big-endian words of 16 bits
  bool is_real = false;        ///< floating-point numbers of 32 or 64 bits
};

/// Compares what a slice's file claims with the pixels that are there, before anything of that size
/// is allocated; unpacks nothing.
Status check_pixels(const DicomElements& elements, const DicomSlice& slice);

/// The pixels of slices. The file of the last slice stays open, so that a file with many frames is
/// parsed once. One thread.
class DicomPixels {
 public:
  /// The slice, rescaled once by its slope and intercept, to values[0 .. columns * rows). Plain
  /// pixels and run lengths are decoded here; JPEG, JPEG-LS and JPEG 2000 by GDCM, which is given
  /// only the packed frame, and only if that has the slice's size. kBadInput or kOutOfMemory with a
  /// sentence.
  Status read(const DicomSlice& slice, float* values);

 private:
  Status open(const std::filesystem::path& path);

  std::filesystem::path path_;
  std::optional<MappedFile> file_;
  DicomElements elements_;
  std::vector<char> unpacked_;  ///< the last packed picture: a mosaic is unpacked once
  std::optional<size_t> unpacked_frame_;
  PixelLayout unpacked_layout_;
};

}  // namespace palpate::files
