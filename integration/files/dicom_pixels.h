#pragma once

#include <optional>
#include <vector>

#include "integration/files/dicom_elements.h"
#include "integration/files/dicom_layout.h"
#include "integration/files/mapped_file.h"

namespace palpate::files {

/// The pixels of slices. The file of the last slice stays open, so that a file with many frames is
/// parsed and unpacked once. One thread.
class DicomPixels {
 public:
  /// The slice, rescaled once by its slope and intercept, to values[0 .. columns * rows). Plain
  /// pixels are decoded here; packed ones (JPEG and the like) are unpacked by GDCM. kBadInput or
  /// kOutOfMemory with a sentence.
  Status read(const DicomSlice& slice, float* values);

 private:
  /// `stored` of `allocated` bits count, the lowest ones; what lies above them may be anything.
  struct Layout {
    int allocated = 0;
    int stored = 0;
    bool is_signed = false;
    bool big_endian = false;
    bool swapped_bytes = false;  ///< bytes of 8 bits lie in big-endian words of 16
  };

  Status open(const std::filesystem::path& path);
  Status unpack(const std::filesystem::path& path);

  std::filesystem::path path_;
  std::optional<MappedFile> file_;
  DicomElements elements_;
  std::vector<char> unpacked_;
  std::string_view pixels_;  ///< of all frames, in the file or unpacked
  Layout layout_;
};

}  // namespace palpate::files
