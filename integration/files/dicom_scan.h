#pragma once

#include "integration/files/dicom_layout.h"

namespace palpate::files {

/// The DICOM image slices in a folder and below it, or of one file, enhanced multi-frame files
/// included; files that are no DICOM images are passed over. kBadInput for what palpate does not
/// read: damaged files, colour, slices without a place in space.
Result<std::vector<DicomSlice>> scan_dicom(const std::filesystem::path& input);

}  // namespace palpate::files
