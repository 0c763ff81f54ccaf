#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/flagged.glsl"
// Repair of folds at sliding borders: smooths cells that touch a folded one along the jump of the field only, since a
// jump folds along its own direction.
//   u(i) <- u(i) / 2 + (u(i - d) + u(i + d)) / 4 where any cell within 1 of i is flagged
//   d: along the largest difference of u to one of the six neighbours; its longest component is push.cells.w cells
//
// binding  direction  format                      shape            unit
// 0        in         uint                        bricks listed    packed brick coordinates
// 1        in         any: flags                  cells (z, y, x)
// 2        in         rgba32f: u, confidence      cells            mm, 1; through a linear sampler
// 3        out        rgba32f: u, confidence      cells            mm, 1
// 4        in         the image of 2, for its single texels
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once, not in place.
// CPU oracle: oracle::blend_along.
layout(set = 0, binding = 1) uniform sampler3D flags;
layout(set = 0, binding = 2) uniform sampler3D field;
layout(set = 0, binding = 3) uniform writeonly image3D repaired;
TEXELS(4, field_texels, rgba32f);
layout(push_constant) uniform Push { BlendAlongPush push; };

vec3 beside(vec3 cell) { return textureLod(field, (cell + 0.5) / vec3(push.cells.xyz), 0.0).xyz; }

void main() {
  const ivec3 cell = brick_cell();
  const ivec3 last = push.cells.xyz - 1;
  if (beyond(cell, push.cells.xyz)) return;
  vec4 u = READ(field_texels, cell);
  if (touches_flagged(flags, cell, last)) {
    vec3 jump = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = -1; side <= 1; side += 2) {
        ivec3 next = cell;
        next[axis] = clamp(cell[axis] + side, 0, last[axis]);
        const vec3 d = READ(field_texels, next).xyz - u.xyz;
        if (dot(d, d) > dot(jump, jump)) jump = d;
      }
    }
    vec3 d = jump / push.cell_mm.xyz;
    d *= float(push.cells.w) / max(max(abs(d.x), max(abs(d.y), abs(d.z))), 1e-20);
    u.xyz = 0.5 * u.xyz + 0.25 * (beside(vec3(cell) - d) + beside(vec3(cell) + d));
  }
  imageStore(repaired, cell, u);
}
