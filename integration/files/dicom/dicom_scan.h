#pragma once

#include <string>
#include <vector>

#include "integration/files/dicom/dicom_layout.h"

namespace palpate::files {

/// The DICOM images of a folder, or of one file.
struct DicomScan {
  std::vector<DicomSlice> slices;
  std::vector<std::string> notes;  ///< what was left out, and why; a sentence each
};

/// The DICOM image slices in a folder and below it, or of one file, enhanced multi-frame files and
/// Siemens mosaics included; of a DICOMDIR the folder is read in which it lies. In a folder what is
/// no slice (reports, colour, pictures without a place in space, doses, copies of an image) is left
/// out with a note. kBadInput for damaged files, and if nothing is left: the reason of the first.
Result<DicomScan> scan_dicom(const std::filesystem::path& input);

}  // namespace palpate::files
