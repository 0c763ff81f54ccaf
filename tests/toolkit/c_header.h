/* The structures of palpate.h and palpate_mode.h, for both languages. */
#ifndef PALPATE_TESTS_C_HEADER_H
#define PALPATE_TESTS_C_HEADER_H

#include <stddef.h>

#include "integration/loading/palpate_mode.h"
#include "integration/toolkit/palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct CStructure {
  const char* name;
  size_t size;
} CStructure;

/* As the C compiler has them; ends with a name of NULL. */
extern const CStructure kCStructures[];

#ifdef __cplusplus
}
#endif

/* Every structure that the headers define. */
/* clang-format off */
#define C_STRUCTURES(X)                                                                            \
  X(PalGrid) X(PalVulkan) X(PalContextInfo) X(PalEstimatorInfo) X(PalProgress) X(PalMotionSummary) \
  X(PalSequenceInfo) X(PalSequenceSummary) X(PalFieldInfo) X(PalFrames) X(PalSceneInfo) X(PalVolume) X(PalDeviceInfo) X(PalReading)         \
  X(PalDevice) X(PalGrip) X(PalSessionInfo) X(PalTick) X(PalState) X(PalTube) X(PalViewInfo) X(PalEye)        \
  X(PalImages) X(PalReplay) X(PalVolumeState) X(PalModeSpec) X(PalModeSite) X(PalModeKind)
/* clang-format on */

#endif
