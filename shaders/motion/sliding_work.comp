#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/sliding.glsl"
// Where the step for sliding borders has work: cells whose intensities match worse than noise explains and around which
// the motion differs.
//   to beat = cost - max(share cost, noise)                                  (a candidate must cost less)
//   there is work for the candidates that lie across a border (sliding.glsl), where to beat > noise_cost
//
// binding  direction  format                  shape            unit
// 0        in         uint                    bricks listed    packed brick coordinates
// 1        in         rgba: cost . . .        cells (z, y, x)  of the cell's own motion, smoothed
// 2        in         rgba32f: u              cells            mm
// 3        out        rgba: to beat, -1, 0, 0 cells            1; -1: no candidate chosen yet
// 4        in/out     uint                    bricks listed    bit n: there is work for candidate n
//
// One invocation: one cell. Border: a candidate outside the field is ignored. Precision: fp32. Race: atomic or. CPU
// oracle: oracle::sliding_work.
TEXELS(1, costs, rgba16f);
TEXELS(2, field, rgba32f);
layout(set = 0, binding = 3) uniform writeonly image3D chosen;
layout(set = 0, binding = 4) buffer Work { uint work[]; };
layout(push_constant) uniform Push { SlidingWorkPush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const float cost = READ(costs, cell).x;
  const float to_beat = cost - max(push.cost.x * cost, push.cost.y);
  imageStore(chosen, cell, vec4(to_beat, -1.0, 0.0, 0.0));
  if (to_beat <= push.cost.z) return;
  const vec3 u = READ(field, cell).xyz;
  uint wanted = 0u;
  for (int c = 0; c < 6 * kSlidingSteps; ++c) {
    const ivec3 offset = candidate_offset(c, push.step.xyz);
    const ivec3 from = cell + offset;
    if (from != clamp(from, ivec3(0), push.cells.xyz - 1)) continue;
    if (across_border(u, READ(field, from).xyz, offset, push.cell_mm.xyz, push.different.xy)) wanted |= 1u << c;
  }
  if (wanted != 0u) atomicOr(work[gl_WorkGroupID.x], wanted);
}
