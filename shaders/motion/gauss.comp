#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// One axis of a separable Gaussian over four channels at once, on the bricks in which work is needed.
//   out(i) = sum_k w_|k| in(i + k), |k| <= radius, weights normalised to 1 on the host
//
// binding  direction  format        shape           unit
// 0        in         uint          bricks listed   packed brick coordinates
// 1        in         any rgba      cells (z, y, x) any
// 2        out        any rgba      cells           the same
//
// One invocation: 8 outputs in a row along the axis, so that each input is fetched (8 + 2 radius) / 8 times instead of
// 2 radius + 1; the 64 invocations of a group are the face of one brick. Border: held. Precision: fp32 sums.
// Race: each output written once, never in place. CPU oracle: oracle::gauss.
layout(set = 0, binding = 1) uniform sampler3D source;
layout(set = 0, binding = 2) uniform writeonly image3D target;
layout(push_constant) uniform Push { GaussPush push; };

float weight(int k) {
  const int tap = abs(k);
  return tap <= push.radius.x ? push.weights[tap >> 2][tap & 3] : 0.0;
}

void main() {
  const int axis = push.size.w;
  const ivec2 face = ivec2(gl_LocalInvocationID.xy);
  const ivec3 along = ivec3(axis == 0, axis == 1, axis == 2);
  const ivec3 first = brick_origin() + (axis == 0 ? ivec3(0, face) : axis == 1 ? ivec3(face.x, 0, face.y) : ivec3(face, 0));
  const ivec3 last = push.size.xyz - 1;
  if (any(greaterThan(first, last))) return;

  vec4 sum[8];
  for (int t = 0; t < 8; ++t) sum[t] = vec4(0.0);
  for (int k = -push.radius.x; k < 8 + push.radius.x; ++k) {
    const vec4 value = texelFetch(source, clamp(first + k * along, ivec3(0), last), 0);
    for (int t = 0; t < 8; ++t) sum[t] += weight(k - t) * value;
  }
  for (int t = 0; t < 8; ++t) {
    const ivec3 i = first + t * along;
    if (all(lessThanEqual(i, last))) imageStore(target, i, sum[t]);
  }
}
