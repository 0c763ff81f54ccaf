#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Primal step of the vectorial Huber total variation filter: the field that belongs to the dual p and, in the last step
// of an iteration, its extrapolation by the momentum.
//   u = w + div p,  (div p)(i) = sum_a s_a (p_a(i) - p_a(i - e_a))        (Chambolle 2004, sec. 3)
//   v = u + m (u - u_before)                                               (Polyak's momentum)
//
// binding  direction  format                 shape            unit
// 0        in         uint                   bricks listed    packed brick coordinates
// 1        in         rgba32f: w, more       cells (z, y, x)  mm along the image axes; weight to add, see tv_dual.comp
// 2-4      in         rgba: p of x, y, z     cells            mm
// 5        in         rgba32f: u_before      cells            mm
// 6        out        rgba32f: u, more       cells            mm; 0 in the last step
// 7        out        rgba32f: v             cells            mm (kLast only)
//
// One invocation: one cell. Border: p is 0 before the first cell and on the last. Precision: fp32.
// Race: each output written once. CPU oracle: oracle::tv_primal.
layout(constant_id = 0) const int kLast = 0;
TEXELS(1, composed, rgba32f);
TEXELS(2, dual_x, rgba16f);
TEXELS(3, dual_y, rgba16f);
TEXELS(4, dual_z, rgba16f);
TEXELS(5, before, rgba32f);
layout(set = 0, binding = 6) uniform writeonly image3D field;
layout(set = 0, binding = 7) uniform writeonly image3D ahead;
layout(push_constant) uniform Push { TotalVariationPush push; };

void main() {
  const ivec3 i = brick_cell();
  if (beyond(i, push.cells.xyz)) return;
  const vec4 w = READ(composed, i);
  vec3 u = w.xyz;
  u += push.slope.x * READ(dual_x, i).xyz;
  u += push.slope.y * READ(dual_y, i).xyz;
  u += push.slope.z * READ(dual_z, i).xyz;
  if (i.x > 0) u -= push.slope.x * READ(dual_x, i - ivec3(1, 0, 0)).xyz;
  if (i.y > 0) u -= push.slope.y * READ(dual_y, i - ivec3(0, 1, 0)).xyz;
  if (i.z > 0) u -= push.slope.z * READ(dual_z, i - ivec3(0, 0, 1)).xyz;
  if (kLast != 0) {
    // Read before the write below: in the last step `before` and the output may be the same image.
    const vec3 u_before = READ(before, i).xyz;
    imageStore(ahead, i, vec4(u + push.weight.w * (u - u_before), 0.0));
  }
  imageStore(field, i, vec4(u, kLast != 0 ? 0.0 : w.w));
}
