#pragma once

#include <string>

#include "integration/files/dicom/dicom_elements.h"

namespace palpate::files {

/// A text of a DICOM file as it may be shown: every part of the patient's names, numbers and birth
/// date in it is replaced by "***", whatever the case of its letters. People write them into
/// descriptions of series. Every text of a tag that reaches a message or an output passes through
/// here. Any thread.
std::string without_identity(const std::string& text, const DicomElements& file);

}  // namespace palpate::files
