#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// Takes, cell by cell, of two fields the one with which the frames match better.
//   e = (r^2 + 2 max(0, w_now - w)) / w_now,  q of the present field   (a voxel without a partner counts as a mismatch)
//   s = smoothstep(least, all, (e_now - e_new) / (2 q + flat))
//   u <- u + s (other - u)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1        in         rgba: . r^2 w q      cells (z, y, x)  of the present field, smoothed
// 2        in         rgba: . r^2 w q      cells            of the other, smoothed
// 3        in         rgba32f: u           cells            mm
// 4        in         rgba32f: other       cells            mm
// 5, 6     out        rgba32f: u           cells            mm
//
// One invocation: one cell. Border: none. Precision: fp32. Race: 3 is read only at the own cell, so 3 and 5 may be the
// same image. CPU oracle: oracle::choose.
layout(set = 0, binding = 1) uniform sampler3D now;
layout(set = 0, binding = 2) uniform sampler3D then;
layout(set = 0, binding = 3) uniform sampler3D field;
layout(set = 0, binding = 4) uniform sampler3D other;
layout(set = 0, binding = 5) uniform writeonly image3D chosen;
layout(set = 0, binding = 6) uniform writeonly image3D chosen_as_well;
layout(push_constant) uniform Push { ChoosePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 a = texelFetch(now, cell, 0);
  const vec4 b = texelFetch(then, cell, 0);
  const vec4 u = texelFetch(field, cell, 0);
  float s = 0.0;
  if (a.z > 0.01) {
    const float left = b.y + 2.0 * max(0.0, a.z - b.z);
    s = smoothstep(push.gain.x, push.gain.y, (a.y - left) / (2.0 * a.w + push.gain.z * a.z));
  }
  const vec4 result = mix(u, texelFetch(other, cell, 0), s);
  imageStore(chosen, cell, result);
  imageStore(chosen_as_well, cell, result);
}
