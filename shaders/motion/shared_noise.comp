#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// What a cell's equations say of the noise in it.
//   k = N w |b|^2 / (r^2 tr A)     0.7 in the median where the noise of its N voxels is white; as much larger as voxels
//                                  share their noise, or as motion is left that all of them show
//   u = r^2 / (2 q)                how much of what the frames show differs between them, 1 where they share nothing
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp       cells (z, y, x)
// 4        out        rgba: k, q / w, u, w                  cells            1
//
// One invocation: one cell. Border: none. Precision: fp32. Race: each output written once. CPU oracle: oracle::shared_noise.
layout(set = 0, binding = 1) uniform sampler3D equations0;
layout(set = 0, binding = 2) uniform sampler3D equations1;
layout(set = 0, binding = 3) uniform sampler3D equations2;
layout(set = 0, binding = 4) uniform writeonly image3D noise;
layout(push_constant) uniform Push { SharedNoisePush push; };

// Below this there is nothing to divide by.
const float kNothing = 1e-9;

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = texelFetch(equations0, cell, 0), e2 = texelFetch(equations2, cell, 0);
  const float trace = e0.w + texelFetch(equations1, cell, 0).z + e2.x;
  const float k = push.voxels.x * e2.z * dot(e0.xyz, e0.xyz) / max(e2.y * trace, kNothing);
  imageStore(noise, cell, vec4(k, e2.w / max(e2.z, kNothing), e2.y / max(2.0 * e2.w, kNothing), e2.z));
}
