#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
// Packs an image and its gradient into one texel, so that the data term reads one texel instead of seven.
//   (gx gy gz I), g = central difference in 1/mm, halved at the border; infinite where it does not count
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
// The outermost voxels of the whole image do not count where push.size.w asks for that: their differences are halved and
// their local windows are cut, which drags tissue where motion leads inwards. An axis of fewer than kLeastForOutermost
// voxels keeps them.
//
// One invocation: one voxel, from `begin` on. Border: clamped. Precision: fp32.
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

bool is_outermost(ivec3 i) {
  const ivec3 whole = ivec3(push.size.xy, push.size.w);
  const ivec3 at = ivec3(i.xy, i.z + push.begin.w);
  const bvec3 at_end = equal(min(at, whole - 1 - at), ivec3(0));
  const bvec3 is_long = greaterThanEqual(whole, ivec3(kLeastForOutermost));
  return push.size.w != 0 && any(bvec3(at_end.x && is_long.x, at_end.y && is_long.y, at_end.z && is_long.z));
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
  const bool is_masked = kMasked != 0 && READ(mask, i).r == 0.0;
  if (is_masked || is_outermost(i)) g = vec3(uintBitsToFloat(0x7f800000u));
  imageStore(packed_image, i, vec4(g, READ(image, i).r));
}
