// Reads single texels inside an image: TEXELS(binding, name, format) and READ(name, at). Every kernel is compiled
// twice, and MotionKernels takes one: with LOADS texels are loaded from storage images of the named format, the
// engine's own; without it they are fetched through samplers, from images of any format. A CPU driver (llvmpipe)
// computes a level of detail for every lane of a fetch, 180 instructions instead of the 60 of a load. A GPU has units
// and caches for fetches.
#ifdef LOADS
#define TEXELS(place, name, format) layout(set = 0, binding = place, format) uniform readonly image3D name
#define READ(name, at) imageLoad(name, at)
#else
#define TEXELS(place, name, format) layout(set = 0, binding = place) uniform sampler3D name
#define READ(name, at) texelFetch(name, at, 0)
#endif
