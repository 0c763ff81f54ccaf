#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Dual step of the vectorial Huber total variation filter: gradient ascent, then projection onto the ball. All nine
// differences share one ball, so that the components have common edges.
//   p <- P( (p + t D u) / (1 + t e / c) ),  P(p) = p / max(1, |p| / c),  (D u)_a(i) = s_a (u(i + e_a) - u(i))
// c = lambda h (1 + more) in mm, more the mean addition to the weight of a cell and its three next neighbours, e the
// Huber threshold in mm, t the step, s_a the slope weight                             (Chambolle & Pock 2011, sec. 6.2)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1        in         rgba32f: u, more     cells (z, y, x)  mm along the image axes; more >= -1
// 2-4      in         rgba: p of x, y, z   cells            mm
// 5-7      out        the same, new        cells            mm
//
// One invocation: one cell. Border: no difference beyond the last cell. Precision: fp32, stored as the images are.
// Race: p is read only at the own cell, so 2-4 and 5-7 may be the same images. CPU oracle: oracle::tv_dual.
TEXELS(1, field, rgba32f);
TEXELS(2, dual_x, rgba16f);
TEXELS(3, dual_y, rgba16f);
TEXELS(4, dual_z, rgba16f);
layout(set = 0, binding = 5) uniform writeonly image3D new_x;
layout(set = 0, binding = 6) uniform writeonly image3D new_y;
layout(set = 0, binding = 7) uniform writeonly image3D new_z;
layout(push_constant) uniform Push { TotalVariationPush push; };

// Lower limit of 1 + more: the ball must have a radius.
const float kLeastWeight = 1e-3;

void main() {
  const ivec3 i = brick_cell();
  if (beyond(i, push.cells.xyz)) return;
  const ivec3 last = push.cells.xyz - 1;
  const vec4 here = READ(field, i);
  const vec4 after_x = READ(field, ivec3(min(i.x + 1, last.x), i.yz));
  const vec4 after_y = READ(field, ivec3(i.x, min(i.y + 1, last.y), i.z));
  const vec4 after_z = READ(field, ivec3(i.xy, min(i.z + 1, last.z)));
  const vec3 u = here.xyz;
  const vec3 step = push.weight.y * push.slope.xyz;
  vec3 px = READ(dual_x, i).xyz + step.x * (after_x.xyz - u);
  vec3 py = READ(dual_y, i).xyz + step.y * (after_y.xyz - u);
  vec3 pz = READ(dual_z, i).xyz + step.z * (after_z.xyz - u);
  const float more = 0.25 * (here.w + after_x.w + after_y.w + after_z.w);
  const float c = push.weight.x * max(1.0 + more, kLeastWeight);
  const float shrink = 1.0 / (1.0 + push.weight.y * push.weight.z / c);
  const float norm = shrink * sqrt(dot(px, px) + dot(py, py) + dot(pz, pz));
  const float scale = shrink / max(1.0, norm / c);
  imageStore(new_x, i, vec4(scale * px, 0.0));
  imageStore(new_y, i, vec4(scale * py, 0.0));
  imageStore(new_z, i, vec4(scale * pz, 0.0));
}
