#pragma once

#include "integration/files/dicom_layout.h"

namespace palpate::files {

/// The DICOM image slices in a folder and below it, or of one file; files that are no DICOM images
/// are passed over. kBadInput for what palpate does not read: multi-frame files, slices without a
/// place in space.
Result<std::vector<DicomSlice>> scan_dicom(const std::filesystem::path& input);

/// The pixels of one slice, rescaled once by slope and intercept, written to values[0 .. columns *
/// rows).
Status read_dicom_slice(const DicomSlice& slice, float* values);

}  // namespace palpate::files
