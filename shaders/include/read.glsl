// Single texels of images within their size: TEXELS(binding, name, format) and READ(name, at). Compiled twice
// (MotionKernels takes one): with LOADS they are loaded from storage images of the named format, those of the engine;
// without it fetched through samplers from images of any. A CPU driver (llvmpipe) works out a level of detail for every lane
// of every fetch, 180 instructions where a load takes 60. A GPU has units and caches for fetches.
#ifdef LOADS
#define TEXELS(place, name, format) layout(set = 0, binding = place, format) uniform readonly image3D name
#define READ(name, at) imageLoad(name, at)
#else
#define TEXELS(place, name, format) layout(set = 0, binding = place) uniform sampler3D name
#define READ(name, at) texelFetch(name, at, 0)
#endif
