// Push constants of gradient_length.comp, read by GLSL and by C++ alike. Only 16-byte members, so
// that both languages lay them out the same way.
#ifndef PALPATE_EXAMPLES_GRADIENT_LENGTH_H
#define PALPATE_EXAMPLES_GRADIENT_LENGTH_H

#ifdef __cplusplus
#include <glm/glm.hpp>
using glm::ivec4;
using glm::vec4;
#endif

struct GradientLengthPush {
  ivec4 size;  // voxels of both images
  vec4 spacing_mm;
};

#ifdef __cplusplus
static_assert(sizeof(GradientLengthPush) == 32);
#endif

#endif
