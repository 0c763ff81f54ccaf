#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "compute/volume/result.h"

namespace palpate::files {

/// The tags of one slice that determine its place in a 4D image. LPS mm, as DICOM has it.
struct DicomSlice {
  std::filesystem::path file;
  size_t frame = 0;  ///< which of the frames of a multi-frame file
  size_t frames_in_file = 1;
  size_t input = 0;                ///< which of the named folders it lies in
  std::string series;              ///< (0020,000E)
  double series_number = 0.0;      ///< (0020,0011)
  std::string series_description;  ///< (0008,103E); "Gated 30%" names a phase
  glm::ivec2 size{0};              ///< columns, rows
  glm::dvec2 spacing_mm{1.0};      ///< between columns, between rows
  double thickness_mm = 1.0;       ///< used only where there is a single slice
  glm::dvec3 position_mm{0.0};     ///< (0020,0032)
  glm::dvec3 along_row{1, 0, 0};   ///< (0020,0037)
  glm::dvec3 along_column{0, 1, 0};
  double slope = 1.0;  ///< value = slope * stored + intercept
  double intercept = 0.0;
  std::optional<double> temporal_position;   ///< (0020,0100), (0020,9128)
  std::optional<double> trigger_time_ms;     ///< (0018,1060), delays of enhanced files
  std::optional<double> phase_percent;       ///< cardiac (0020,9241) or of breathing (0020,9245)
  std::optional<double> acquisition_number;  ///< (0020,0012), (0020,9156)
  std::optional<double> frame_reference_ms;  ///< (0054,1300), of PET
  std::optional<double> acquisition_time_s;  ///< date and time; any day where there is no date
  std::optional<double> temporal_resolution_ms;  ///< (0020,0110)
};

/// Slices in order.
struct DicomLayout {
  Grid grid;
  std::vector<std::vector<size_t>> frames;  ///< per frame: slice numbers, k rising
  std::vector<double> times_s;
  bool times_known = false;
};

/// Sorts slices into frames: by place along the normal, and at each place by the first of folder,
/// temporal position, trigger time, phase, series, acquisition number, frame reference time and
/// acquisition time that tells all slices of a place apart. Series that are no part of one 4D image
/// are tried each alone. `name` is the folder, for messages. kBadInput if slices are missing,
/// unevenly spaced, shifted sideways, of different size or direction, or can not be told apart.
/// Pure; any thread.
Result<DicomLayout> arrange_slices(const std::filesystem::path& name,
                                   const std::vector<DicomSlice>& slices);

}  // namespace palpate::files
