#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// The elements of one DICOM file, as views into its bytes. Only little endian syntaxes, which all
/// of today's are.
struct DicomElements {
  std::map<uint32_t, std::string_view>
      values;  ///< top level, before the pixels; tag is group << 16 | element
  bool has_pixels = false;
  bool is_packed = false;   ///< the pixels are JPEG or the like
  std::string_view pixels;  ///< plain pixels; empty if packed

  /// Text without padding; empty if the element is not there.
  std::string text(uint32_t tag) const;
  /// A number written as text (DS, IS).
  std::optional<double> number(uint32_t tag) const;
  /// "1\2\3"; empty if there are not `count` finite numbers.
  std::vector<double> numbers(uint32_t tag, size_t count) const;
  /// A 16-bit binary number (US).
  std::optional<int> whole(uint32_t tag) const;
  /// A 64-bit binary number (FD).
  std::optional<double> real(uint32_t tag) const;
};

/// Walks through all elements up to the pixels and checks that every length fits, sequences
/// included: GDCM ends the process over a file that is cut short, so it never gets to see one.
/// `bytes` is the whole file and must outlive the result. kBadInput with a sentence. Touches no
/// file; any thread.
Result<DicomElements> parse_dicom(const std::filesystem::path& file, std::string_view bytes);

}  // namespace palpate::files
