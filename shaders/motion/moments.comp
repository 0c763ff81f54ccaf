#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
// First and second moments of the intensity in cells of a few voxels, for local normalisation (normalise.comp): m1 =
// mean(I), m2 = mean(I^2). On a coarser grid than the image because a wide low-pass follows: the same result for an
// eighth of the work.
//
// binding  direction  format                shape             unit
// 0        in         any, one channel      image (z, y, x)   scaled intensity
// 1        out        rg32f: m1 m2          cells             scaled intensity, its square
//
// One invocation: one cell, from `begin` on. Border: a cell that extends beyond the image averages its inner part.
// Precision: fp32, also stored, since m2 - m1^2 cancels. Race: each output written once. CPU oracle: oracle::moments.
layout(local_size_x = 64) in;
TEXELS(0, image, r16f);
layout(set = 0, binding = 1) uniform writeonly image3D moments;
layout(push_constant) uniform Push { MomentsPush push; };

void main() {
  const ivec3 i = push.begin.xyz + ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.cells.xyz))) return;
  const ivec3 begin = i * push.cell.xyz;
  const ivec3 end = min(begin + push.cell.xyz, push.size.xyz);
  vec2 sum = vec2(0.0);
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const float value = READ(image, ivec3(x, y, z)).r;
        sum += vec2(value, value * value);
      }
    }
  }
  const ivec3 n = end - begin;
  imageStore(moments, i, vec4(sum / float(n.x * n.y * n.z), 0.0, 0.0));
}
