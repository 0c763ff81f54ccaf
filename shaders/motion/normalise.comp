#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/push.glsl"
// Local normalisation: removes gain, offset and slow bias from an image.
//   N = (I - m) / sqrt(v + f^2), m and v = m2 - m^2 local mean and variance, f the noise SD
// m1 and m2 are smoothed on a coarser grid and interpolated trilinearly.
//
// binding  direction  format                shape             unit
// 0        in         any, one channel      image (z, y, x)   scaled intensity
// 1        in         rg32f: m1 m2          cells             smoothed moments
// 2        out        any, one channel      image             1 (local SDs)
//
// One invocation: one voxel, from `begin` on. Border: clamped. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::normalise.
layout(local_size_x = 64) in;
TEXELS(0, image, r16f);
layout(set = 0, binding = 1) uniform sampler3D moments;
layout(set = 0, binding = 2) uniform writeonly image3D normalised;
PUSH_CONSTANTS(NormalisePush);

void main() {
  push = push_constants;
  const ivec3 i = push.begin.xyz + ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.size.xyz))) return;
  float value = READ(image, i).r;
  if (push.noise.y != 0.0) {
    const vec3 at = (vec3(i) + 0.5) / vec3(push.cell.xyz * push.cells.xyz);
    const vec2 m = textureLod(moments, at, 0.0).rg;
    value = (value - m.x) * inversesqrt(max(m.y - m.x * m.x, 0.0) + push.noise.x);
  }
  imageStore(normalised, i, vec4(value));
}
