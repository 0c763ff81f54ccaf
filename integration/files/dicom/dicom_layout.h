#pragma once

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "compute/volume/result.h"

namespace palpate::files {

/// What makes the kind of an image: frames of one sequence agree in all of these at every place.
/// Their values are normalised texts, empty where a file does not have them.
enum class KindTag {
  kImageType,         ///< (0008,0008), or (0008,9007) of a frame; without its first two values
  kOriginality,       ///< the first two values: "DERIVED\SECONDARY"
  kComplexComponent,  ///< (0008,9208), or GE's (0043,102F), or Philips' (2005,1011)
  kEchoTime,          ///< (0018,0081), (0018,9082)
  kEchoNumber,        ///< (0018,0086)
  kRepetitionTime,    ///< (0018,0080)
  kInversionTime,     ///< (0018,0082), (0018,9079)
  kFlipAngle,         ///< (0018,1314)
  kBValue,            ///< (0018,9087) and the makers' own elements
  kDiffusion,         ///< (0018,9075)
  kVelocity,          ///< (0018,9090), or Siemens' (0051,1014)
  kSequenceName,      ///< (0018,0024), (0018,9005)
  kScanningSequence,  ///< (0018,0020)
  kContrast,          ///< (0018,0010), (0008,9209)
  kCoil,              ///< (0018,1250), or Siemens' (0051,100F)
  kLabel,             ///< Philips' (2005,1429): label or control of perfusion
  kVoltage,           ///< (0018,0060)
  kKernel,            ///< (0018,1210)
  kThickness,         ///< (0018,0050)
  kUnits,             ///< (0054,1001) of PET
  kCorrections,       ///< (0028,0051), (0054,1101), (0054,1103) of PET
  kSeriesType,        ///< (0054,1000) of PET
  kDataType,          ///< (0018,9808) of ultrasound
  kPatientPosition,   ///< (0018,5100)
  kCount
};
inline constexpr size_t kKindTags = size_t(KindTag::kCount);

/// "echo time (0018,0081)".
const char* name_of(KindTag tag);

/// The tags of one slice that determine its place in a 4D image. LPS mm, as DICOM has it.
struct DicomSlice {
  std::filesystem::path file;
  size_t frame = 0;  ///< which of the frames of a multi-frame file
  size_t frames_in_file = 1;
  size_t input = 0;                ///< which of the named folders or series it lies in
  std::string owner;               ///< patient, study, modality: compared, never shown
  std::string instance;            ///< (0008,0018)
  std::string series;              ///< (0020,000E)
  double series_number = 0.0;      ///< (0020,0011)
  std::string series_description;  ///< (0008,103E); "Gated 30%" names a phase
  std::array<std::string, kKindTags> kind;
  glm::ivec2 size{0};             ///< columns, rows
  glm::ivec2 picture_size{0};     ///< of the stored picture: larger than size in a mosaic
  glm::ivec2 first_pixel{0};      ///< column, row of the slice in it
  glm::dvec2 spacing_mm{1.0};     ///< between columns, between rows
  double thickness_mm = 1.0;      ///< used only where there is a single slice
  glm::dvec3 position_mm{0.0};    ///< (0020,0032)
  double position_unit_mm = 0.0;  ///< one unit of the last decimal of its text
  glm::dvec3 along_row{1, 0, 0};  ///< (0020,0037)
  glm::dvec3 along_column{0, 1, 0};
  double slope = 1.0;  ///< value = slope * stored + intercept
  double intercept = 0.0;
  bool is_gated = false;  ///< the file says that heart or breath steered the acquisition
  std::optional<double> temporal_position;   ///< (0020,0100), (0020,9128)
  std::optional<double> trigger_time_ms;     ///< (0018,1060), delays of enhanced files
  std::optional<double> phase_percent;       ///< cardiac (0020,9241) or of breathing (0020,9245)
  std::optional<double> phase_number;        ///< Philips' (2001,1008)
  std::optional<double> scan_percent;        ///< of (0018,1022): "TP20PC"
  std::optional<double> acquisition_number;  ///< (0020,0012), (0020,9156)
  std::optional<double> frame_reference_ms;  ///< (0054,1300), of PET
  std::optional<double> acquisition_time_s;  ///< date and time; any day where there is no date
  std::optional<double> content_time_s;      ///< (0008,0033), the same
  std::optional<double> instance_number;     ///< (0020,0013)
  std::optional<double> temporal_resolution_ms;  ///< (0020,0110)
};

/// Slices in order.
struct DicomLayout {
  Grid grid;
  std::vector<std::vector<size_t>> frames;  ///< per frame: slice numbers, k rising
  std::vector<double> times_s;
  bool times_known = false;
  std::string ordered_by;          ///< "trigger time (0018,1060)"; empty for a single frame
  std::vector<std::string> notes;  ///< what a person should know of the order, a sentence each
};

/// In what two slices differ that can not be of one image ("size", "pixel spacing", "direction"),
/// or null.
const char* shape_difference(const DicomSlice& a, const DicomSlice& b);

/// Places along the normal of the first slice of `group`, in its order; each has the slices that
/// lie there. Slices closer than 2 % of the spacing (and the rounding of their text) share a place.
std::vector<std::vector<size_t>> places_of(const std::vector<DicomSlice>& slices,
                                           std::vector<size_t> group);

/// "Thorax 25% In": what is left of a description when its numbers and the words for the direction
/// of a breath are masked, and these.
struct PhaseName {
  std::string rest;             ///< lower case, "#" for a number
  std::vector<double> numbers;  ///< in the order of the text
  int direction = 0;            ///< 1: breathing in, -1: out, 0: not said
};
PhaseName phase_name(const std::string& description);

/// Sorts slices of one kind into frames: by place along the normal, and at each place by what tells
/// its slices apart (docs/decisions/files.md has the keys in their order, and which must agree).
/// `name` is the folder, for messages. kBadInput if slices are missing, unevenly spaced, shifted
/// sideways, if nothing tells them apart, or if two keys disagree about the order. Pure; any
/// thread.
Result<DicomLayout> arrange_slices(const std::filesystem::path& name,
                                   const std::vector<DicomSlice>& slices,
                                   const std::vector<size_t>& group);

}  // namespace palpate::files
