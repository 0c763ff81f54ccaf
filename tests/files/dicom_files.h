#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compute/volume/grid.h"

namespace palpate::files {

/// One CT slice as a DICOM file in explicit little endian, byte by byte after the standard, so that
/// a test can write what no library would.
struct DicomFile {
  Grid grid;                ///< of the whole volume
  int slice = 0;            ///< k
  std::vector<int> stored;  ///< nx * ny stored values, 16 bit signed
  double slope = 1.0;
  double intercept = 0.0;
  std::string series = "1.2.3.1";
  int series_number = 1;
  int instance = 1;
  /// Further elements: (group << 16 | element) -> value as text, VR by first two letters
  /// ("DS12.5").
  std::map<unsigned, std::string> more;
};

void write_dicom(const std::filesystem::path& path, const DicomFile& file);

inline constexpr unsigned kTagSeriesDescription = 0x0008103e, kTagTriggerTime = 0x00181060,
                          kTagAcquisitionNumber = 0x00200012, kTagTemporalPosition = 0x00200100,
                          kTagTemporalResolution = 0x00200110, kTagCardiacPhase = 0x00209241,
                          kTagNumberOfFrames = 0x00280008;

}  // namespace palpate::files
