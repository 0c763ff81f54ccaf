#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/left_out.glsl"
#include "include/symmetric.glsl"
// How well a fit predicts the cells that were left out of it: by how much its field u changes their squared difference,
// from that of the field u0 at which the equations were made.
//   e = d . A d - 2 b . d,  d = u - u0;   sum(i) += factor e(i) at the cells of the part
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, at u0    cells (z, y, x)
// 4        in         rgba32f: u           cells            mm along the image axes
// 5        in         rgba32f: u0          cells            mm
// 6        in         rg32f: sum, .        cells            1
// 7        out        rg32f: sum, q        cells            1: q, the structure, as in binding 3
//
// One invocation: one cell. Border: none. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::left_out_error.
layout(set = 0, binding = 1) uniform sampler3D all0;
layout(set = 0, binding = 2) uniform sampler3D all1;
layout(set = 0, binding = 3) uniform sampler3D all2;
layout(set = 0, binding = 4) uniform sampler3D field;
layout(set = 0, binding = 5) uniform sampler3D start;
layout(set = 0, binding = 6) uniform sampler3D before;
layout(set = 0, binding = 7) uniform writeonly image3D after;
layout(push_constant) uniform Push { LeftOutErrorPush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = texelFetch(all0, cell, 0), e2 = texelFetch(all2, cell, 0);
  const Symmetric a = matrix_of(e0, texelFetch(all1, cell, 0), e2);
  const vec3 d = texelFetch(field, cell, 0).xyz - texelFetch(start, cell, 0).xyz;
  const float error = dot(d, times(a, d)) - 2.0 * dot(e0.xyz, d);
  const float added = is_left_out(cell, push.cells.w) ? push.factor.x * error : 0.0;
  imageStore(after, cell, vec4(texelFetch(before, cell, 0).x + added, e2.w, 0.0, 0.0));
}
