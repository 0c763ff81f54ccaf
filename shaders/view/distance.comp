#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Distance in bricks, as the largest of the three axes (Chebyshev), to the nearest occupied brick, one axis per pass:
// d'(i) = min over k of max(|k|, d(i + k));  likewise to the nearest brick that is not solid, and to the nearest one
// that is not thin.
// For skipping empty space as in Deakin & Knackstedt 2019 (doi 10.1007/s41095-019-0155-y).
//
// binding  direction  format  shape                     unit
// 0        in out     uint    kSkipWords per brick      word 0, see kSolid in interface/view.h
// 1        in         uint    bricks (z, y, x)          the distances after the axis before, packed as in
//                                                       word 0
// 2        out        uint    bricks                    the same after this axis
//
// kAxis 0 reads what brick.comp wrote instead of binding 1, kAxis 2 writes word 0 instead of
// binding 2. One invocation: one brick. Distances stop at kFarthest. Race: each output written once;
// in pass 2 every invocation reads and writes only its own brick's words.
// CPU oracle: none; skipping is tested as a whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) buffer Skip { uint skip[]; };
layout(set = 0, binding = 1) readonly buffer From { uint from[]; };
layout(set = 0, binding = 2) writeonly buffer To { uint to[]; };
layout(push_constant) uniform Push { BricksPush push; };
layout(constant_id = 0) const int kAxis = 0;

uint place(ivec3 brick) {
  return uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z));
}

uint word_of(ivec3 brick) { return uint(push.bricks.w) + uint(kSkipWords) * place(brick); }

uvec3 unpacked(uint packed) { return uvec3(packed, packed >> 8, packed >> 16) & 0xffu; }
uint packed(uvec3 distances) { return distances.x | distances.y << 8 | distances.z << 16; }

// Distances to the nearest brick that is occupied, not solid, not thin.
uvec3 distances_before(ivec3 brick) {
  if (any(lessThan(brick, ivec3(0))) || any(greaterThanEqual(brick, push.bricks.xyz)))
    return uvec3(kFarthest);
  if (kAxis > 0) return unpacked(from[place(brick)]);
  const uint word = word_of(brick);
  const bool empty = (skip[word + uint(kBlockWord)] | skip[word + uint(kBlockWord) + 1u]) == 0u;
  const bool solid = (skip[word] & kSolid) != 0u, thin = (skip[word] & kThin) != 0u;
  return mix(uvec3(0u), uvec3(kFarthest), bvec3(empty, solid, thin));
}

void main() {
  const ivec3 brick = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(brick, push.bricks.xyz))) return;
  ivec3 way = ivec3(0);
  way[kAxis] = 1;
  uvec3 best = distances_before(brick);
  for (int k = 1; k < kFarthest && uint(k) < max(max(best.x, best.y), best.z); ++k) {
    const uvec3 nearest = min(distances_before(brick - k * way), distances_before(brick + k * way));
    best = min(best, max(uvec3(k), nearest));
  }
  if (kAxis < 2) {
    to[place(brick)] = packed(best);
    return;
  }
  skip[word_of(brick)] = packed(best);
}
