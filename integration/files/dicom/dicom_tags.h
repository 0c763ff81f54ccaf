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

/// What makes the kind of an image, and what belongs to whom. Values of the patient are compared,
/// never shown.
inline constexpr uint32_t kImageType = 0x00080008, kSopInstance = 0x00080018,
                          kModality = 0x00080060, kPatient = 0x00100020,
                          kContrastAgent = 0x00180010, kScanningSequence = 0x00180020,
                          kSequenceName = 0x00180024, kKilovolts = 0x00180060,
                          kRepetitionTime = 0x00180080, kEchoTime = 0x00180081,
                          kInversionTime = 0x00180082, kEchoNumber = 0x00180086,
                          kSpacingBetweenSlices = 0x00180088, kNominalInterval = 0x00181062,
                          kHeartRate = 0x00181088, kCardiacImages = 0x00181090,
                          kScanOptions = 0x00180022, kKernel = 0x00181210, kCoil = 0x00181250,
                          kFlipAngle = 0x00181314, kPatientPosition = 0x00185100,
                          kCardiacTechnique = 0x00189037, kStudy = 0x0020000d,
                          kInstanceNumber = 0x00200013, kTemporalPositions = 0x00200105,
                          kContentDate = 0x00080023, kContentTime = 0x00080033,
                          kCorrectedImage = 0x00280051, kSeriesType = 0x00541000,
                          kUnits = 0x00541001, kAttenuation = 0x00541101,
                          kReconstruction = 0x00541103;

/// Private elements that are well known: tiles of a mosaic and Siemens' own header ("CSA"), coils
/// and velocity of Siemens, kind of image of GE and Philips, phase number of Philips, b-values.
inline constexpr uint32_t kMosaicTiles = 0x0019100a, kSiemensHeader = 0x00291010,
                          kSiemensCoil = 0x0051100f, kSiemensVelocity = 0x00511014,
                          kSiemensB = 0x0019100c, kGeImageType = 0x0043102f, kGeB = 0x00431039,
                          kPhilipsImageType = 0x20051011, kPhilipsPhase = 0x20011008,
                          kPhilipsB = 0x20011003, kPhilipsLabel = 0x20051429;

/// Pixels as real numbers.
inline constexpr uint32_t kFloatPixels = 0x7fe00008, kDoublePixels = 0x7fe00009;

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
                          kImageOrientationVolume = 0x00209302, kMrFrameType = 0x00189226,
                          kCtFrameType = 0x00189329, kFrameType = 0x00089007,
                          kComplexComponent = 0x00089208, kAcquisitionContrast = 0x00089209,
                          kMrEcho = 0x00189114, kEffectiveEchoTime = 0x00189082,
                          kMrModifier = 0x00189115, kInversionTimes = 0x00189079,
                          kMrTiming = 0x00189112, kMrDiffusion = 0x00189117, kBValue = 0x00189087,
                          kDiffusionDirectionality = 0x00189075, kMrVelocity = 0x00189197,
                          kVelocityDirection = 0x00189090, kPulseSequence = 0x00189005,
                          kUsImage = 0x00189806, kUsDataType = 0x00189808;

}  // namespace palpate::files::tags
