#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/symmetric.glsl"
// A Gauss-Newton step that goes on from equations which stay those of one field u0: without the images.
//   d = (A + (alpha / h)^2 I)^-1 (b - A (v - u0)),  |d| <= limit,  w = v + d
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, at u0, smoothed    cells (z, y, x)
// 4        in         rgba32f: vx vy vz .  cells            mm along the image axes
// 5        in         rgba32f: u0          cells            mm
// 6        out        rgba32f: w, 0        cells            mm
//
// One invocation: one cell. Border: none. Precision: fp32. Race: each output written once. CPU oracle: oracle::refit.
layout(set = 0, binding = 1) uniform sampler3D equations0;
layout(set = 0, binding = 2) uniform sampler3D equations1;
layout(set = 0, binding = 3) uniform sampler3D equations2;
layout(set = 0, binding = 4) uniform sampler3D ahead;
layout(set = 0, binding = 5) uniform sampler3D start;
layout(set = 0, binding = 6) uniform writeonly image3D refitted;
layout(push_constant) uniform Push { UpdatePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = texelFetch(equations0, cell, 0);
  const Symmetric a = matrix_of(e0, texelFetch(equations1, cell, 0), texelFetch(equations2, cell, 0));
  const vec3 v = texelFetch(ahead, cell, 0).xyz;
  const vec3 b = e0.xyz - times(a, v - texelFetch(start, cell, 0).xyz);
  imageStore(refitted, cell, vec4(v + shortened(solved(a, push.step.x, b), push.step.y), 0.0));
}
