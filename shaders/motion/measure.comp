#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// How far the field moved since the last look, for the stop by convergence.
//   total[0] += |u - seen| in 1/4096 unit, summed over cells;  seen <- u
//
// binding  direction  format         shape            unit
// 0        in         uint           bricks listed    packed brick coordinates
// 1        in         rgba32f: u     cells (z, y, x)  mm
// 2        in         rgba: seen     cells            mm
// 3        out        rgba: seen     cells            mm
// 4        in/out     uint           1                1/4096 unit
//
// One invocation: a column of 8 cells, so that atomics stay rare. Border: none. Precision: fixed point, each column
// rounded to 1/4096 and bounded, so the sum does not depend on the order. Race: atomics; seen only at the own cell.
// CPU oracle: oracle::measure.
layout(set = 0, binding = 1) uniform sampler3D field;
layout(set = 0, binding = 2) uniform sampler3D seen;
layout(set = 0, binding = 3) uniform writeonly image3D now_seen;
layout(set = 0, binding = 4) buffer Total { uint total[]; };
layout(push_constant) uniform Push { MeasurePush push; };

void main() {
  const ivec3 first = brick_origin() + ivec3(gl_LocalInvocationID.xy, 0);
  float moved = 0.0;
  for (int z = 0; z < kBrick; ++z) {
    const ivec3 cell = first + ivec3(0, 0, z);
    if (beyond(cell, push.cells.xyz)) continue;
    const vec3 u = texelFetch(field, cell, 0).xyz;
    moved += min(length(u - texelFetch(seen, cell, 0).xyz) * push.unit.x, 8.0);
    imageStore(now_seen, cell, vec4(u, 0.0));
  }
  atomicAdd(total[0], uint(moved * 4096.0 + 0.5));
}
