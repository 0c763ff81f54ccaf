#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "integration/files/raster/raster.h"

namespace palpate::files {

/// A file with this key holds the motion of a whole sequence, see sequence_motion_file.h.
inline constexpr const char* kSequenceMotionKey = "SequenceMotion.Version";

/// The lines of a NRRD header, sorted by what they are; nothing is interpreted yet.
struct NrrdFields {
  /// "space directions: x", name in lower case without blanks
  std::map<std::string, std::string> fields;
  std::map<std::string, std::string> keys;  ///< "name:=value"
  std::vector<std::string> data_files;      ///< the lines after "data file: LIST"

  /// The field's text, or empty.
  std::string_view field(const std::string& name) const;
  std::string_view key(const std::string& name) const;
};

/// kBadInput if the magic is missing.
Result<NrrdFields> split_nrrd_header(const std::filesystem::path& file, std::string_view text);

/// What one axis of the array is.
enum class NrrdRole { kSpace, kFrames, kComponents };

/// One axis with everything the header says of it.
struct NrrdAxis {
  double size = 0.0;
  NrrdRole role = NrrdRole::kSpace;
  /// in the header's own space; empty for "none" or without directions
  std::vector<double> direction;
  double spacing = 0.0;  ///< 0 where not given; negative where the positions fall
  double first = 0.0;    ///< position of the first sample, where given
  std::string unit;      ///< lower case; empty where not given
};

/// Reads sizes, kinds, space directions, spacings, ranges and units, and decides the role of every
/// axis.
Result<std::vector<NrrdAxis>> nrrd_axes(const std::filesystem::path& file,
                                        const NrrdFields& header);

/// "(1,0,0)" -> 1 0 0; "none" -> empty. Nothing if it is neither.
std::optional<std::vector<double>> parse_nrrd_vector(std::string_view text);

/// Several of them, "(1,0,0) none (0,0,1)". Nothing if one is neither.
std::optional<std::vector<std::vector<double>>> parse_nrrd_vectors(std::string_view text);

}  // namespace palpate::files
