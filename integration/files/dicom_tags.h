#pragma once

#include <cstdint>

/// The DICOM elements that are looked at, group << 16 | element.
namespace palpate::files::tags {

inline constexpr uint32_t kSeriesDescription = 0x0008103e, kSliceThickness = 0x00180050,
                          kTriggerTime = 0x00181060, kSeries = 0x0020000e,
                          kSeriesNumber = 0x00200011, kAcquisitionNumber = 0x00200012,
                          kPosition = 0x00200032, kOrientation = 0x00200037,
                          kTemporalPosition = 0x00200100, kTemporalResolution = 0x00200110,
                          kCardiacPhase = 0x00209241, kSamplesPerPixel = 0x00280002,
                          kNumberOfFrames = 0x00280008, kRows = 0x00280010, kColumns = 0x00280011,
                          kPixelSpacing = 0x00280030, kBitsAllocated = 0x00280100,
                          kBitsStored = 0x00280101, kPixelRepresentation = 0x00280103,
                          kIntercept = 0x00281052, kSlope = 0x00281053;

}  // namespace palpate::files::tags
