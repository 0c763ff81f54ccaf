#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// One axis of a separable Gaussian over four channels at once, on the listed bricks.
//   out(i) = sum_k w_|k| in(i + k), |k| <= radius, weights normalised to 1 on the host
//
// binding  direction  format        shape           unit
// 0        in         uint          bricks listed   packed brick coordinates
// 1        in         any rgba      cells (z, y, x) any
// 2        out        any rgba      cells           the same
//
// One invocation: 8 outputs in a row along the axis, so that each input is fetched (8 + 2 radius) / 8 times instead of
// 2 radius + 1; the 64 invocations of a group are the face of one brick. Border: clamped. Precision: fp32 sums. Race:
// each output written once, never in place. CPU oracle: oracle::gauss.
TEXELS(1, source, rgba16f);
layout(set = 0, binding = 2) uniform writeonly image3D target;
layout(push_constant) uniform Push { GaussPush push; };

// A constant at compile time, so that all loops are unrolled and weights are in registers: a CPU driver reads a weight
// at a variable index lane by lane, which took longer than the taps themselves.
layout(constant_id = 0) const int kRadius = 1;

void main() {
  const int axis = push.size.w;
  const ivec3 last = push.size.xyz - 1;
  float weights[kMaxRadius + 1];
  [[unroll]] for (int k = 0; k <= kRadius; ++k) weights[k] = push.weights[k >> 2][k & 3];

  const ivec2 face = ivec2(gl_LocalInvocationID.xy);
  const ivec3 along = ivec3(axis == 0, axis == 1, axis == 2);
  const ivec3 first = brick_origin() + (axis == 0 ? ivec3(0, face) : axis == 1 ? ivec3(face.x, 0, face.y) : ivec3(face, 0));
  if (any(greaterThan(first, last))) return;

  vec4 sum[8];
  [[unroll]] for (int t = 0; t < 8; ++t) sum[t] = vec4(0.0);
  [[unroll]] for (int k = -kRadius; k < 8 + kRadius; ++k) {
    const vec4 value = READ(source, clamp(first + k * along, ivec3(0), last));
    [[unroll]] for (int t = 0; t < 8; ++t) {
      if (abs(k - t) <= kRadius) sum[t] += weights[abs(k - t)] * value;
    }
  }
  [[unroll]] for (int t = 0; t < 8; ++t) {
    const ivec3 i = first + t * along;
    if (all(lessThanEqual(i, last))) imageStore(target, i, sum[t]);
  }
}
