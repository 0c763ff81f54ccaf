#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/flagged.glsl"
// Repair of folds: replaces cells that touch a folded one by a smoothed field and keeps all others.
//   u(i) <- G u(i) where any cell within 1 of i is flagged;  G = (1 2 1)/4 along each axis
// or everywhere in the listed bricks. Only gradients near folds are reduced. Repetition always ends, since a constant
// field does not fold.
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1        in         any: flags           cells (z, y, x)
// 2        in         rgba32f: u .         cells            mm
// 3        out        rgba32f: u .         cells            mm; the fourth is the cell's own
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once, not in place.
// CPU oracle: oracle::blend.
layout(set = 0, binding = 1) uniform sampler3D flags;
layout(set = 0, binding = 2) uniform sampler3D field;
layout(set = 0, binding = 3) uniform writeonly image3D repaired;
layout(push_constant) uniform Push { BlendPush push; };

void main() {
  const ivec3 cell = brick_cell();
  const ivec3 last = push.cells.xyz - 1;
  if (beyond(cell, push.cells.xyz)) return;
  vec4 u = texelFetch(field, cell, 0);
  if (push.cells.w != 0 || touches_flagged(flags, cell, last)) {
    u.xyz = vec3(0.0);
    for (int k = 0; k < 27; ++k) {
      const ivec3 step = ivec3(k % 3, k / 3 % 3, k / 9) - 1;
      const float weight = float((2 - abs(step.x)) * (2 - abs(step.y)) * (2 - abs(step.z))) / 64.0;
      u.xyz += weight * texelFetch(field, clamp(cell + step, ivec3(0), last), 0).xyz;
    }
  }
  imageStore(repaired, cell, u);
}
