// Push constants of gradient_length.comp, included by GLSL and by C++. All members have 16 bytes,
// so that the layout is the same in both languages.
#ifndef PALPATE_EXAMPLES_GRADIENT_LENGTH_H
#define PALPATE_EXAMPLES_GRADIENT_LENGTH_H

#ifdef __cplusplus
#include <glm/glm.hpp>
using glm::ivec4;
using glm::vec4;
#endif

struct GradientLengthPush {
  ivec4 size;       // x, y, z: voxels of both images; w unused
  vec4 spacing_mm;  // x, y, z; w unused
};

#ifdef __cplusplus
static_assert(sizeof(GradientLengthPush) == 32);
#endif

#endif
