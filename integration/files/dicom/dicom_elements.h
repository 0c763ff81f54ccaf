#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// The elements of one DICOM file or of one item of a sequence in it, as views into its bytes.
struct DicomElements {
  /// Tag is group << 16 | element; of a file: those before the pixels.
  std::map<uint32_t, std::string_view> values;
  std::map<uint32_t, std::vector<DicomElements>> sequences;
  bool big_endian = false;

  // Of a file only.
  bool has_pixels = false;
  std::string syntax;                       ///< name of the transfer syntax (a UID)
  bool is_packed = false;                   ///< the pixels are JPEG or the like
  std::vector<std::string_view> fragments;  ///< of packed pixels; the first is a table of offsets
  bool has_real_pixels = false;             ///< floating-point numbers instead of integers
  bool has_word_pixels = false;             ///< plain pixels of 8 bits lie in words of 16 (VR "OW")
  std::string_view pixels;                  ///< plain pixels; empty if packed
  std::shared_ptr<const std::string> inflated;  ///< what the views point into if it was deflated

  /// Text without padding; empty if the element is not there.
  std::string text(uint32_t tag) const;
  /// A number written as text (DS, IS).
  std::optional<double> number(uint32_t tag) const;
  /// "1\2\3"; empty if there are not `count` finite numbers.
  std::vector<double> numbers(uint32_t tag, size_t count) const;
  /// A binary whole number of 16 or 32 bits (US, UL).
  std::optional<int> whole(uint32_t tag) const;
  /// A binary real number of 32 or 64 bits (FL, FD).
  std::optional<double> real(uint32_t tag) const;
  /// `count` binary numbers of 64 bits (FD); empty if there are not so many finite ones.
  std::vector<double> reals(uint32_t tag, size_t count) const;
};

/// Where the elements of a file begin, if it is DICOM: behind the preamble, or at once in files of
/// old programs that wrote none. The first 140 bytes are enough.
std::optional<size_t> start_of_dicom(std::string_view bytes);

/// Walks through all elements up to the pixels and checks that every length fits, sequences and
/// fragments included: GDCM ends the process over a damaged file, so it is never given one.
/// Implicit and explicit VR, little and big endian, deflated. `bytes` is the whole file and must
/// outlive the result. kBadInput with a sentence; kOutOfMemory if it inflates beyond the memory.
/// Touches no file; any thread.
Result<DicomElements> parse_dicom(const std::filesystem::path& file, std::string_view bytes);

}  // namespace palpate::files
