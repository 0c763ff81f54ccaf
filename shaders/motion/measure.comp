#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// What has changed in each brick since its last measurement, to decide whether the next iterations can leave it out.
//   moved = max |u - seen|,  structure = max (q / w),  reach = max |u|,  seen <- u
// q / w is the mean squared normalised intensity, near 1 where the images have structure and near
// noise^2 / (noise^2 + f^2) where they have none.
//
// binding  direction  format                  shape            unit
// 0        in         uint                    bricks listed    packed brick coordinates
// 1        in         rgba32f: u              cells (z, y, x)  mm
// 2        in         rgba: seen              cells            mm
// 3        out        rgba: seen              cells            mm
// 4        in         rgba: Azz r^2 w q       cells            smoothed normal equations
// 5        in/out     uint triples            bricks listed    bits of the floats moved (units), structure, reach (units)
//
// One invocation: a column of 8 cells, so that there are few atomics. Border: none. Precision: fp32. Race: atomic
// maxima of the bits, whose order is that of the values since none is negative; `seen` is read and written only at the
// own cell, so 2 and 3 may be the same image. CPU oracle: oracle::measure.
TEXELS(1, field, rgba32f);
TEXELS(2, seen, rgba16f);
layout(set = 0, binding = 3) uniform writeonly image3D now_seen;
TEXELS(4, equations2, rgba16f);
layout(set = 0, binding = 5) buffer Looks { uint looks[]; };
layout(push_constant) uniform Push { MeasurePush push; };

void main() {
  const ivec3 first = brick_origin() + ivec3(gl_LocalInvocationID.xy, 0);
  float moved = 0.0;
  float structure = 0.0;
  float reach = 0.0;
  for (int z = 0; z < kBrick; ++z) {
    const ivec3 cell = first + ivec3(0, 0, z);
    if (beyond(cell, push.cells.xyz)) continue;
    const vec3 u = READ(field, cell).xyz;
    moved = max(moved, length(u - READ(seen, cell).xyz) * push.unit.x);
    reach = max(reach, length(u) * push.unit.x);
    imageStore(now_seen, cell, vec4(u, 0.0));
    const vec4 e = READ(equations2, cell);
    structure = max(structure, e.z > 0.01 ? e.w / e.z : 0.0);
  }
  if (beyond(first, push.cells.xyz)) return;
  atomicMax(looks[3u * gl_WorkGroupID.x], floatBitsToUint(moved));
  atomicMax(looks[3u * gl_WorkGroupID.x + 1u], floatBitsToUint(structure));
  atomicMax(looks[3u * gl_WorkGroupID.x + 2u], floatBitsToUint(reach));
}
