#pragma once

#include "integration/files/dicom_layout.h"

namespace palpate::files {

/// The pixels of one slice, rescaled once by slope and intercept, written to values[0 .. columns *
/// rows). Plain pixels are decoded here; packed ones (JPEG and the like) by ITK. kBadInput with a
/// sentence. Any thread.
Status read_dicom_slice(const DicomSlice& slice, float* values);

}  // namespace palpate::files
