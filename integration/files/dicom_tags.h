#pragma once

#include <array>
#include <cstdint>

/// The DICOM elements that are looked at, group << 16 | element.
namespace palpate::files::tags {

inline constexpr uint32_t kAcquisitionDate = 0x00080022, kAcquisitionDateTime = 0x0008002a,
                          kAcquisitionTime = 0x00080032, kSeriesDescription = 0x0008103e,
                          kSliceThickness = 0x00180050, kTriggerTime = 0x00181060,
                          kSeries = 0x0020000e, kSeriesNumber = 0x00200011,
                          kAcquisitionNumber = 0x00200012, kPosition = 0x00200032,
                          kOrientation = 0x00200037, kTemporalPosition = 0x00200100,
                          kTemporalResolution = 0x00200110, kCardiacPhase = 0x00209241,
                          kSamplesPerPixel = 0x00280002, kPhotometric = 0x00280004,
                          kNumberOfFrames = 0x00280008, kRows = 0x00280010, kColumns = 0x00280011,
                          kPixelSpacing = 0x00280030, kBitsAllocated = 0x00280100,
                          kBitsStored = 0x00280101, kPixelRepresentation = 0x00280103,
                          kIntercept = 0x00281052, kSlope = 0x00281053,
                          kFrameReferenceTime = 0x00541300;

/// Who the patient is: names (also of parents and former ones), and numbers and dates.
inline constexpr std::array<uint32_t, 4> kPatientNames = {0x00100010, 0x00101001, 0x00101005,
                                                          0x00101060};
inline constexpr std::array<uint32_t, 5> kPatientNumbers = {0x00100020, 0x00100030, 0x00101000,
                                                            0x00080050, 0x00380010};

/// Enhanced multi-frame files: sequences ("macros") with one item for all frames or one per frame,
/// and what is in them.
inline constexpr uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230,
                          kPixelMeasures = 0x00289110, kPlanePosition = 0x00209113,
                          kPlaneOrientation = 0x00209116, kPixelValueTransformation = 0x00289145,
                          kFrameContent = 0x00209111, kFrameAcquisitionTime = 0x00189074,
                          kFrameReferenceDateTime = 0x00189151,
                          kFrameAcquisitionNumber = 0x00209156, kTemporalPositionIndex = 0x00209128,
                          kCardiacSynchronization = 0x00189118, kCardiacDelay = 0x00209153,
                          kRespiratorySynchronization = 0x00209253, kRespiratoryPhase = 0x00209245,
                          kRespiratoryDelay = 0x00209255, kTemporalPositionGroup = 0x00209310,
                          kTemporalOffset = 0x0020930d, kVolumePosition = 0x0020930e,
                          kImagePositionVolume = 0x00209301, kVolumeOrientation = 0x0020930f,
                          kImageOrientationVolume = 0x00209302;

}  // namespace palpate::files::tags
