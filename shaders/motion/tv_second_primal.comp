#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// The part of the dual q of the second differences (tv_second_dual.comp) in the primal step; tv_primal.comp adds that of
// the first differences.
//   w' = w - D2^T q
//   (D2^T q)(i) = sum_a s_a^2 (q_aa(i - e_a) - 2 q_aa(i) + q_aa(i + e_a))
//     + sum_{a < b} sqrt(2) s_a s_b (q_ab(i) - q_ab(i - e_a) - q_ab(i - e_b) + q_ab(i - e_a - e_b))
//
// binding  direction  format                   shape            unit
// 0        in         uint                     bricks listed    packed brick coordinates
// 1        in         rgba32f: w, more         cells (z, y, x)  mm along the image axes; weight, passed on
// 2-7      in         rgba: q of xx yy zz xy xz yz    cells     mm
// 8        out        rgba32f: w', more        cells            mm
//
// One invocation: one cell. Border: q is 0 beyond the cells, and where tv_second_dual.comp keeps it 0. Precision: fp32.
// Race: each output written once; w is read only at the own cell. CPU oracle: oracle::tv_second_primal.
TEXELS(1, composed, rgba32f);
TEXELS(2, dual_xx, rgba16f);
TEXELS(3, dual_yy, rgba16f);
TEXELS(4, dual_zz, rgba16f);
TEXELS(5, dual_xy, rgba16f);
TEXELS(6, dual_xz, rgba16f);
TEXELS(7, dual_yz, rgba16f);
layout(set = 0, binding = 8) uniform writeonly image3D without;
layout(push_constant) uniform Push { TotalVariationPush push; };

const float kSqrt2 = 1.41421356;

void main() {
  const ivec3 i = brick_cell();
  if (beyond(i, push.cells.xyz)) return;
  const ivec3 lo = max(i - 1, ivec3(0)), hi = min(i + 1, push.cells.xyz - 1);
  const vec4 w = READ(composed, i);
  const vec3 s = push.slope.xyz;

  // On the first and last cell q_aa is 0, so clamped reads are right.
  const vec3 straight = s * s;
  vec3 u = w.xyz;
  u -= straight.x * (READ(dual_xx, ivec3(lo.x, i.yz)) - 2.0 * READ(dual_xx, i) + READ(dual_xx, ivec3(hi.x, i.yz))).xyz;
  u -= straight.y * (READ(dual_yy, ivec3(i.x, lo.y, i.z)) - 2.0 * READ(dual_yy, i) + READ(dual_yy, ivec3(i.x, hi.y, i.z))).xyz;
  u -= straight.z * (READ(dual_zz, ivec3(i.xy, lo.z)) - 2.0 * READ(dual_zz, i) + READ(dual_zz, ivec3(i.xy, hi.z))).xyz;

  // Before the first cell there is no q_ab: 1 where there is one.
  const vec3 b = vec3(greaterThan(i, ivec3(0)));
  const vec3 mixed = kSqrt2 * s.xxy * s.yzz;
  u -= mixed.x * (READ(dual_xy, i) - b.x * READ(dual_xy, ivec3(lo.x, i.yz)) - b.y * READ(dual_xy, ivec3(i.x, lo.y, i.z)) +
                  b.x * b.y * READ(dual_xy, ivec3(lo.xy, i.z))).xyz;
  u -= mixed.y * (READ(dual_xz, i) - b.x * READ(dual_xz, ivec3(lo.x, i.yz)) - b.z * READ(dual_xz, ivec3(i.xy, lo.z)) +
                  b.x * b.z * READ(dual_xz, ivec3(lo.x, i.y, lo.z))).xyz;
  u -= mixed.z * (READ(dual_yz, i) - b.y * READ(dual_yz, ivec3(i.x, lo.y, i.z)) - b.z * READ(dual_yz, ivec3(i.xy, lo.z)) +
                  b.y * b.z * READ(dual_yz, ivec3(i.x, lo.yz))).xyz;
  imageStore(without, i, vec4(u, w.w));
}
