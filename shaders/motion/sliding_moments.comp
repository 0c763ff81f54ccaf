#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Moments of two frames that a field aligns, from which the gain between them follows: per cell the means of
//   F, M(x + u), F^2, F M(x + u)
// over every second voxel along each axis. For a voxel without a partner, or outside the mask, M is set to F (gain 1).
//
// binding  direction  format                   shape            unit
// 0        in         uint                     bricks listed    packed brick coordinates
// 1        in         any, one channel: F      image (z, y, x)  scaled intensity
// 2        in         any, one channel: M      image            scaled intensity
// 3        in         rgba32f: u               cells (z, y, x)  mm along the image axes
// 4        in         rgba: gx . . .           image            gx: infinite outside the mask
// 5        out        rgba32f: means           cells            scaled intensity, and its square
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::sliding_moments.
TEXELS(1, fixed_image, r16f);
layout(set = 0, binding = 2) uniform sampler3D moving_image;
layout(set = 0, binding = 3) uniform sampler3D field;
TEXELS(4, packed_image, rgba16f);
layout(set = 0, binding = 5) uniform writeonly image3D means;
layout(push_constant) uniform Push { SlidingMomentsPush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const ivec3 begin = cell * push.cell.xyz;
  const ivec3 end = min(begin + push.cell.xyz, push.size.xyz);
  const vec3 size = vec3(push.size.xyz);
  vec4 sum = vec4(0.0);
  float count = 0.0;
  // The second voxel of each pair; along an axis on which the cell has one voxel, that one.
  const ivec3 first = min(begin + 1, end - 1);
  for (int z = first.z; z < end.z; z += 2) {
    for (int y = first.y; y < end.y; y += 2) {
      for (int x = first.x; x < end.x; x += 2) {
        const ivec3 at = ivec3(x, y, z);
        const float f = READ(fixed_image, at).r;
        const vec3 place = (vec3(at) + 0.5) / vec3(push.cell.xyz * push.cells.xyz);
        const vec3 partner = vec3(at) + textureLod(field, place, 0.0).xyz / push.spacing_mm.xyz;
        const bool counts = all(greaterThanEqual(partner, vec3(-0.5))) && all(lessThanEqual(partner, size - 0.5)) &&
                            abs(READ(packed_image, at).x) <= kLargestGradient;
        const float m = counts ? textureLod(moving_image, (partner + 0.5) / size, 0.0).r : f;
        sum += vec4(f, m, f * f, f * m);
        count += 1.0;
      }
    }
  }
  imageStore(means, cell, sum / max(count, 1.0));
}
