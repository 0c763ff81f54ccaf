#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/flagged.glsl"
// Repair of folds at sliding borders: where a border is ragged it folds, so cells that touch a folded one take the
// vector median of their neighbourhood, which straightens a border and keeps its jump.
//   u(i) <- the u(m) with the least sum over n of |u(m) - u(n)|, m and n among i and its six neighbours,
//           where any cell within 1 of i is flagged
//
// binding  direction  format                      shape            unit
// 0        in         uint                        bricks listed    packed brick coordinates
// 1        in         any: flags                  cells (z, y, x)
// 2        in         rgba32f: u, confidence      cells            mm, 1
// 3        out        rgba32f: u, confidence      cells            mm, 1 (the cell's own)
//
// One invocation: one cell. Border: clamped. Precision: fp32; of equal sums the cell's own. Race: each output written
// once, not in place. CPU oracle: oracle::distances_around.
layout(set = 0, binding = 1) uniform sampler3D flags;
TEXELS(2, field, rgba32f);
layout(set = 0, binding = 3) uniform writeonly image3D repaired;
layout(push_constant) uniform Push { MedianPush push; };

void main() {
  const ivec3 cell = brick_cell();
  const ivec3 last = push.cells.xyz - 1;
  if (beyond(cell, push.cells.xyz)) return;
  vec4 u = READ(field, cell);
  if (touches_flagged(flags, cell, last)) {
    vec3 near[7];
    near[0] = u.xyz;
    for (int k = 0; k < 6; ++k) {
      ivec3 next = cell;
      next[k % 3] = clamp(cell[k % 3] + (k < 3 ? 1 : -1), 0, last[k % 3]);
      near[k + 1] = READ(field, next).xyz;
    }
    float least = 1e30;
    for (int m = 0; m < 7; ++m) {
      float sum = 0.0;
      for (int n = 0; n < 7; ++n) sum += distance(near[m], near[n]);
      if (sum >= least) continue;
      least = sum;
      u.xyz = near[m];
    }
  }
  imageStore(repaired, cell, u);
}
