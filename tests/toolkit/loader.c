/* Loads the library, uses it and lets it go, twice; 0 if all went well and it is gone at the end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

#include "integration/toolkit/palpate.h"

typedef PalResult (*Open)(const PalContextInfo*, PalContext**);
typedef PalResult (*Close)(PalContext**);

int main(int argc, char** argv) {
  for (int round = 0; round < 2 && argc > 1; ++round) {
    void* library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    Open open_context;
    Close close_context;
    *(void**)&open_context = dlsym(library, "pal_context_open");
    *(void**)&close_context = dlsym(library, "pal_context_close");
    if (!open_context || !close_context) return 2;
    PalContextInfo info;
    memset(&info, 0, sizeof info);
    info.size = sizeof info;
    info.version = PAL_VERSION;
    info.flags = PAL_CONTEXT_NO_GPU;
    PalContext* context = NULL;
    if (open_context(&info, &context) != PAL_OK || !context) return 3;
    if (close_context(&context) != PAL_OK || context) return 4;
    if (dlclose(library) != 0) return 5;
  }
  return argc > 1 ? 0 : 6;
}
