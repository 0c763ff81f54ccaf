#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/sliding.glsl"
// The field after the step for sliding borders: each cell takes the motion of its chosen candidate, or keeps its own.
//
// binding  direction  format                      shape            unit
// 0        in         uint                        bricks listed    packed brick coordinates
// 1        in         rgba: . which . .           cells (z, y, x)  candidate, below 0: none
// 2        in         rgba32f: u, confidence      cells            mm, 1
// 3        out        rgba32f: u, confidence      cells            mm, 1 (the cell's own)
//
// One invocation: one cell. Border: none. Precision: fp32. Race: each output written once, not in place.
// CPU oracle: oracle::sliding_take.
TEXELS(1, chosen, rgba16f);
TEXELS(2, field, rgba32f);
layout(set = 0, binding = 3) uniform writeonly image3D taken;
layout(push_constant) uniform Push { SlidingTakePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  vec4 u = READ(field, cell);
  const int which = int(round(READ(chosen, cell).y));
  if (which >= 0) u.xyz = READ(field, cell + candidate_offset(which, push.step.xyz)).xyz;
  imageStore(taken, cell, u);
}
