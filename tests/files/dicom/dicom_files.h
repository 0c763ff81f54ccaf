#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate::files {

/// The encoding of a DICOM file's elements (its transfer syntax); pixels are not compressed.
enum class DicomSyntax { kExplicitLittle, kImplicitLittle, kExplicitBig, kDeflated };

/// (group << 16 | element) -> value as text, VR in the first two letters ("DS12.5"); an empty text
/// removes the element.
using DicomValues = std::map<unsigned, std::string>;

/// One CT slice as a DICOM file, written byte by byte by the standard, so that a test can write
/// files that no library writes.
struct DicomFile {
  Grid grid;                ///< of the whole volume
  int slice = 0;            ///< k
  std::vector<int> stored;  ///< nx * ny stored values, 16 bit signed (or 8 bit unsigned)
  double slope = 1.0;
  double intercept = 0.0;
  std::string series = "1.2.3.1";
  int series_number = 1;
  int instance = 1;
  DicomValues more;
  DicomSyntax syntax = DicomSyntax::kExplicitLittle;
  /// 8 or 16 per pixel.
  int bits = 16;
  std::string pixel_vr = "OW";
};

void write_dicom(const std::filesystem::path& path, const DicomFile& file);

/// One file per slice of a volume of integers.
void write_dicom_volume(const std::filesystem::path& folder, const Volume& volume);

/// One frame of an enhanced multi-frame file.
struct EnhancedFrame {
  int slice = 0;            ///< k
  std::vector<int> stored;  ///< nx * ny stored values, 16 bit signed
  double slope = 1.0;
  double intercept = 0.0;
  /// Further items of this frame's groups: tag of the sequence -> its elements.
  std::map<unsigned, DicomValues> groups;
};

/// An enhanced CT: pixel measures and orientation for all frames at once, position and rescaling
/// per frame.
struct EnhancedFile {
  Grid grid;
  std::vector<EnhancedFrame> frames;
  DicomSyntax syntax = DicomSyntax::kExplicitLittle;
  /// Of the patient.
  bool without_orientation = false;
  /// Sequences of undefined length, ended by delimiters.
  bool open_sequences = false;
  DicomValues more;
};

void write_enhanced(const std::filesystem::path& path, const EnhancedFile& file);

/// The same DICOM file of compressed pixels with every fragment cut in two, and an offset table.
std::string with_cut_fragments(const std::string& bytes);

inline constexpr unsigned kTagSeriesDescription = 0x0008103e, kTagTriggerTime = 0x00181060,
                          kTagAcquisitionNumber = 0x00200012, kTagTemporalPosition = 0x00200100,
                          kTagTemporalResolution = 0x00200110, kTagCardiacPhase = 0x00209241,
                          kTagNumberOfFrames = 0x00280008, kTagAcquisitionTime = 0x00080032,
                          kTagAcquisitionDate = 0x00080022, kTagAcquisitionDateTime = 0x0008002a,
                          kTagFrameReferenceTime = 0x00541300;

}  // namespace palpate::files
