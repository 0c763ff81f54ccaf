/* palpate.h as a strict C compiler sees it: it compiles, and its structures are as C++ has them. */
#include "integration/toolkit/palpate.h"

#include <stddef.h>

size_t size_in_c(int which);
size_t size_in_c(int which) {
  switch (which) {
    case 0:
      return sizeof(PalContextInfo);
    case 1:
      return sizeof(PalSceneInfo);
    case 2:
      return sizeof(PalSessionInfo);
    case 3:
      return sizeof(PalState);
    case 4:
      return sizeof(PalImages);
    case 6:
      return sizeof(PalTube);
    default:
      return sizeof(PalFrames);
  }
}
