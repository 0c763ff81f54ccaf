#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Iteration (34) of the paper, in units of the voxel; the Gaussian that follows is gauss.comp.
//   d = L1(x + M) - L0(x),   M <- M - d grad L0 / (|grad L0|^2 + d^2)          (Thirion 1998, eq. 4)
// Where gradient and difference are both 0 the quotient is undefined, and M is not changed.
//
// binding  direction  format                       shape            unit
// 0        in         uint                         bricks listed    packed brick coordinates, a cell is a voxel
// 1        in         rgba: gx gy gz L0            image (z, y, x)  1/mm, scaled intensity
// 2        in         rgba: . . . L1               image            scaled intensity
// 3        in         rgba32f: M                   image            mm along the image axes
// 4        out        rgba32f: M                   image            mm
//
// One invocation: one voxel. Border: L1 clamped; outside the mask (an infinite gradient) M stays. Precision: fp32.
// Race: each output written once. CPU oracle: oracle::classic_force.
TEXELS(1, fixed_image, rgba16f);
layout(set = 0, binding = 2) uniform sampler3D moving_image;
TEXELS(3, field, rgba32f);
layout(set = 0, binding = 4) uniform writeonly image3D updated;
layout(push_constant) uniform Push { ClassicPush push; };

void main() {
  const ivec3 i = brick_cell();
  if (beyond(i, push.size.xyz)) return;
  const vec3 spacing = push.spacing_mm.xyz;
  vec3 u = READ(field, i).xyz;
  const vec4 f = READ(fixed_image, i);
  const vec3 at = (vec3(i) + 0.5 + u / spacing) / vec3(push.size.xyz);
  const float d = textureLod(moving_image, at, 0.0).w - f.w;
  const vec3 g = f.xyz * spacing;  // per voxel
  const float scale = dot(g, g) + d * d;
  if (abs(f.x) <= kLargestGradient && scale > 1e-12) u -= spacing * (d / scale) * g;
  imageStore(updated, i, vec4(u, 0.0));
}
