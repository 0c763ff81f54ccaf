#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/sliding.glsl"
// Of four candidates of the step for sliding borders that lie across a border (sliding.glsl), and the best one so far,
// takes the one with the least cost.
//
// binding  direction  format                    shape            unit
// 0        in         uint                      bricks listed    packed brick coordinates
// 1        in         rgba: cost                cells (z, y, x)  of candidates first .. first + 3, smoothed
// 2        in         rgba: least, which, 0, 0  cells            1
// 3        out        the same                  cells
// 4        in         rgba32f: u                cells            mm
//
// One invocation: one cell. Border: a candidate outside the field is ignored. Precision: fp32; the candidate's number
// is a small integer in fp16. Race: 2 is read only at the own cell, so 2 and 3 may be the same image. CPU oracle:
// oracle::sliding_choose.
TEXELS(1, costs, rgba16f);
TEXELS(2, so_far, rgba16f);
layout(set = 0, binding = 3) uniform writeonly image3D chosen;
TEXELS(4, field, rgba32f);
layout(push_constant) uniform Push { SlidingChoosePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 cost = READ(costs, cell);
  vec2 best = READ(so_far, cell).xy;
  const vec3 u = READ(field, cell).xyz;
  for (int c = 0; c < 4; ++c) {
    const ivec3 offset = candidate_offset(push.cells.w + c, push.step.xyz);
    const ivec3 from = cell + offset;
    if (cost[c] >= best.x || from != clamp(from, ivec3(0), push.cells.xyz - 1)) continue;
    if (across_border(u, READ(field, from).xyz, offset, push.cell_mm.xyz, push.different.xy))
      best = vec2(cost[c], float(push.cells.w + c));
  }
  imageStore(chosen, cell, vec4(best, 0.0, 0.0));
}
