#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The next coarser level of the light grid: the mean of 2 x 2 x 2 cells.
//
// binding  direction  format    shape               unit
// 0        in         r         finer cells         optical depth of one edge of the finest level's cells
// 1        out        r         cells (z, y, x)     the same
//
// One invocation: one cell. Precision: fp32. Race: each output written once.
// Tested as part of the light: tests/view/light_grid_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D finer;
layout(set = 0, binding = 1) uniform writeonly image3D coarser;
layout(push_constant) uniform Push { LightHalvePush push; };

void main() {
  const ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(cell, push.cells.xyz))) return;
  float sum = 0.0;
  for (int k = 0; k < 8; ++k) {
    sum += texelFetch(finer, 2 * cell + ivec3(k & 1, k >> 1 & 1, k >> 2), 0).x;
  }
  imageStore(coarser, cell, vec4(0.125 * sum));
}
