#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
// Packs an image and its gradient into one texel, so that the data term reads one texel instead of seven.
//   (gx gy gz I), g = central difference in 1/mm, one-sided at the border; infinite outside the mask
//
// binding  direction  format             shape             unit
// 0        in         any, one channel   image (z, y, x)   1
// 1        in         any, one channel   image             mask: 0 = outside
// 2        out        any rgba           image             1/mm 1/mm 1/mm 1
//
// The mask belongs to the fixed frame, but each frame is fixed once and moving once, and as the moving one its
// intensities outside the mask are needed. So the intensity stays, and the gradient carries the mark; a partner there
// still counts. Infinite, because a trilinear sample that touches such a voxel with any weight is then infinite or NaN
// and fails every comparison. A large finite number was tried: at weights below a hundredth it looked like an image.
//
// One invocation: one voxel, from `begin` on. Border: clamped, so the difference is halved there. Precision: fp32.
// Race: each output written once. CPU oracle: oracle::pack.
layout(local_size_x = 64) in;
TEXELS(0, image, r16f);
TEXELS(1, mask, r8);
layout(set = 0, binding = 2) uniform writeonly image3D packed_image;
layout(push_constant) uniform Push { PackPush push; };
layout(constant_id = 0) const int kMasked = 0;

float slope(float before, float after, float spacing) {
  return clamp(0.5 * (after - before) / spacing, -kLargestGradient, kLargestGradient);
}

void main() {
  const ivec3 i = push.begin.xyz + ivec3(gl_GlobalInvocationID);
  const ivec3 last = push.size.xyz - 1;
  if (any(greaterThan(i, last))) return;
  const ivec3 lo = max(i - 1, ivec3(0));
  const ivec3 hi = min(i + 1, last);
  const vec3 s = push.spacing_mm.xyz;
  vec3 g = vec3(
      slope(READ(image, ivec3(lo.x, i.yz)).r, READ(image, ivec3(hi.x, i.yz)).r, s.x),
      slope(READ(image, ivec3(i.x, lo.y, i.z)).r, READ(image, ivec3(i.x, hi.y, i.z)).r, s.y),
      slope(READ(image, ivec3(i.xy, lo.z)).r, READ(image, ivec3(i.xy, hi.z)).r, s.z));
  if (kMasked != 0 && READ(mask, i).r == 0.0) g = vec3(uintBitsToFloat(0x7f800000u));
  imageStore(packed_image, i, vec4(g, READ(image, i).r));
}
