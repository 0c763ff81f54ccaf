#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// The share of the narrow window, where it predicts better what was left out: its gain relative to the structure.
//   share = smoothstep(low, high, -gain / q)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1        in         rg32f: gain, q       cells (z, y, x)  1: error of the narrow window less that of the wide one,
//                                                           and structure, smoothed
// 2        in         rgba: . r^2 w q      cells            of the coarser level when it ended
// 3        out        rgba: share r^2 w q  cells            may be the image of 2
//
// One invocation: one cell. Border: none. Precision: fp32. Race: 2 is read only at the own cell.
// CPU oracle: oracle::window_share.
layout(set = 0, binding = 1) uniform sampler3D gain;
layout(set = 0, binding = 2) uniform sampler3D coarser;
layout(set = 0, binding = 3) uniform writeonly image3D with_share;
layout(push_constant) uniform Push { WindowSharePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec2 g = texelFetch(gain, cell, 0).xy;
  const float share = smoothstep(push.share.x, push.share.y, -g.x / max(g.y, 1e-6));
  imageStore(with_share, cell, vec4(share, texelFetch(coarser, cell, 0).yzw));
}
