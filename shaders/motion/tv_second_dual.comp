#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Dual step of the vectorial Huber total variation of second derivatives, as tv_dual.comp for first ones: it fills in
// linear motion where first derivatives fill in constants. All 18 differences share one ball.
//   q <- P( (q + t D2 u) / (1 + t e / c) ),  P(q) = q / max(1, |q| / c)
//   (D2 u)_aa(i) = s_a^2 (u(i + e_a) - 2 u(i) + u(i - e_a))
//   (D2 u)_ab(i) = sqrt(2) s_a s_b (u(i + e_a + e_b) - u(i + e_a) - u(i + e_b) + u(i)),  a < b
// c = lambda h (1 + min(more, 0)): where the first derivatives get a larger weight, these do not, since motion that is
// not explained has borders. more, e, t and s as in tv_dual.comp
//
// binding  direction  format                   shape            unit
// 0        in         uint                     bricks listed    packed brick coordinates
// 1        in         rgba32f: u, more         cells (z, y, x)  mm along the image axes; more >= -1
// 2-7      in         rgba: q of xx yy zz xy xz yz    cells     mm
// 8-13     out        the same, new            cells            mm
//
// One invocation: one cell. Border: no difference that needs a cell beyond the first or last one; q is 0 there.
// Precision: fp32, stored as the images are. Race: q is read only at the own cell, so 2-7 and 8-13 may be the same
// images. CPU oracle: oracle::tv_second_dual.
TEXELS(1, field, rgba32f);
TEXELS(2, dual_xx, rgba16f);
TEXELS(3, dual_yy, rgba16f);
TEXELS(4, dual_zz, rgba16f);
TEXELS(5, dual_xy, rgba16f);
TEXELS(6, dual_xz, rgba16f);
TEXELS(7, dual_yz, rgba16f);
layout(set = 0, binding = 8) uniform writeonly image3D new_xx;
layout(set = 0, binding = 9) uniform writeonly image3D new_yy;
layout(set = 0, binding = 10) uniform writeonly image3D new_zz;
layout(set = 0, binding = 11) uniform writeonly image3D new_xy;
layout(set = 0, binding = 12) uniform writeonly image3D new_xz;
layout(set = 0, binding = 13) uniform writeonly image3D new_yz;
layout(push_constant) uniform Push { TotalVariationPush push; };

// Lower limit of 1 + more: the ball must have a radius.
const float kLeastWeight = 1e-3;
const float kSqrt2 = 1.41421356;

void main() {
  const ivec3 i = brick_cell();
  if (beyond(i, push.cells.xyz)) return;
  const ivec3 last = push.cells.xyz - 1;
  const ivec3 lo = max(i - 1, ivec3(0)), hi = min(i + 1, last);
  const vec4 here = READ(field, i);
  const vec4 x1 = READ(field, ivec3(hi.x, i.yz)), y1 = READ(field, ivec3(i.x, hi.y, i.z));
  const vec4 z1 = READ(field, ivec3(i.xy, hi.z));
  const vec3 u = here.xyz;

  // 1 where a difference exists, 0 where it would need a cell that does not.
  const vec3 after = vec3(lessThan(i, last));
  const vec3 both = after * vec3(greaterThan(i, ivec3(0)));
  const vec3 s = push.slope.xyz;
  const vec3 straight = push.weight.y * s * s * both;
  const vec3 mixed = push.weight.y * kSqrt2 * s.xxy * s.yzz * after.xxy * after.yzz;
  const vec3 xx = READ(dual_xx, i).xyz + straight.x * (x1.xyz - 2.0 * u + READ(field, ivec3(lo.x, i.yz)).xyz);
  const vec3 yy = READ(dual_yy, i).xyz + straight.y * (y1.xyz - 2.0 * u + READ(field, ivec3(i.x, lo.y, i.z)).xyz);
  const vec3 zz = READ(dual_zz, i).xyz + straight.z * (z1.xyz - 2.0 * u + READ(field, ivec3(i.xy, lo.z)).xyz);
  const vec3 xy = READ(dual_xy, i).xyz + mixed.x * (READ(field, ivec3(hi.xy, i.z)).xyz - x1.xyz - y1.xyz + u);
  const vec3 xz = READ(dual_xz, i).xyz + mixed.y * (READ(field, ivec3(hi.x, i.y, hi.z)).xyz - x1.xyz - z1.xyz + u);
  const vec3 yz = READ(dual_yz, i).xyz + mixed.z * (READ(field, ivec3(i.x, hi.yz)).xyz - y1.xyz - z1.xyz + u);

  const float more = 0.25 * (here.w + x1.w + y1.w + z1.w);
  const float c = push.weight.x * max(1.0 + min(more, 0.0), kLeastWeight);
  const float shrink = 1.0 / (1.0 + push.weight.y * push.weight.z / c);
  const float squares = dot(xx, xx) + dot(yy, yy) + dot(zz, zz) + dot(xy, xy) + dot(xz, xz) + dot(yz, yz);
  const float scale = shrink / max(1.0, shrink * sqrt(squares) / c);
  imageStore(new_xx, i, vec4(scale * xx, 0.0));
  imageStore(new_yy, i, vec4(scale * yy, 0.0));
  imageStore(new_zz, i, vec4(scale * zz, 0.0));
  imageStore(new_xy, i, vec4(scale * xy, 0.0));
  imageStore(new_xz, i, vec4(scale * xz, 0.0));
  imageStore(new_yz, i, vec4(scale * yz, 0.0));
}
