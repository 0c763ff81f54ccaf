#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/symmetric.glsl"
// One Gauss-Newton step per cell from the windowed normal equations, composed with the field.
//   d = (A + (alpha / h)^2 I)^-1 b,  |d| <= limit          (Levenberg's damping; Lucas & Kanade 1981)
//   w(x) = v(x + d) + d                                     (compositive update, Vercauteren 2009)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, smoothed   cells (z, y, x)
// 4        in         rgba32f: vx vy vz .  cells            mm along the image axes
// 5        out        rgba32f: w           cells            mm
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written
// once. CPU oracle: oracle::update.
TEXELS(1, equations0, rgba16f);
TEXELS(2, equations1, rgba16f);
TEXELS(3, equations2, rgba16f);
layout(set = 0, binding = 4) uniform sampler3D field;
layout(set = 0, binding = 5) uniform writeonly image3D composed;
layout(push_constant) uniform Push { UpdatePush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = READ(equations0, cell);
  const Symmetric a = matrix_of(e0, READ(equations1, cell), READ(equations2, cell));
  const vec3 d = shortened(solved(a, push.step.x, e0.xyz), push.step.y);

  const vec3 at = (vec3(cell) + 0.5 + d / push.cell_mm.xyz) / vec3(push.cells.xyz);
  imageStore(composed, cell, vec4(textureLod(field, at, 0.0).xyz + d, 0.0));
}
