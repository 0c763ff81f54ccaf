#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
// Interpolates a field to finer cells with a smooth curve: trilinear interpolation of the coarse cells, followed by
// that of the finer ones, would flatten its bends twice.
//   to(i) = from(scale i + offset): Catmull-Rom cubic with the share `push.scale.w`, linear with the rest
//
// binding  direction  format                  shape                  unit
// 0        in         rgba32f: u, confidence  from cells (z, y, x)   mm along the image axes, 1
// 1, 2     out        rgba32f: u, confidence  to cells               mm, 1 (within 0 to 1)
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::upsample_cubic.
layout(local_size_x = 64) in;
TEXELS(0, from, rgba32f);
layout(set = 0, binding = 1) uniform writeonly image3D to;
layout(set = 0, binding = 2) uniform writeonly image3D to_as_well;
layout(push_constant) uniform Push { UpsamplePush push; };

// Weights of the samples before, at, after and two after floor, for the fraction t.
vec4 weights(float t) {
  const vec4 cubic = 0.5 * vec4(((2.0 - t) * t - 1.0) * t, (3.0 * t - 5.0) * t * t + 2.0,
                                ((4.0 - 3.0 * t) * t + 1.0) * t, (t - 1.0) * t * t);
  return mix(vec4(0.0, 1.0 - t, t, 0.0), cubic, push.scale.w);
}

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.to_cells.xyz))) return;
  const vec3 at = push.scale.xyz * vec3(i) + push.offset.xyz;
  const ivec3 base = ivec3(floor(at));
  const vec3 t = at - vec3(base);
  const ivec3 last = push.from_cells.xyz - 1;
  const vec4 wx = weights(t.x), wy = weights(t.y), wz = weights(t.z);
  vec4 sum = vec4(0.0);
  for (int z = 0; z < 4; ++z) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 4; ++x) {
        sum += wz[z] * wy[y] * wx[x] * READ(from, clamp(base + ivec3(x, y, z) - 1, ivec3(0), last));
      }
    }
  }
  sum.w = clamp(sum.w, 0.0, 1.0);
  imageStore(to, i, sum);
  imageStore(to_as_well, i, sum);
}
