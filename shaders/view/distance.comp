#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// How many bricks away the nearest occupied one is, in the greatest of the three axes (Chebyshev),
// one axis per pass:  d'(i) = min over k of max(|k|, d(i + k)).
// Deakin & Knackstedt 2019 (doi 10.1007/s41095-019-0155-y) skip by such a map.
//
// binding  direction  format  shape                     unit
// 0        in out     uint    kSkipWords per brick      word 0: bricks, or kFull; see surface.comp
// 1        in         uint    bricks (z, y, x)          distance after the axis before
// 2        out        uint    bricks                    distance after this axis
//
// kAxis 0 reads the bits of the bricks instead of binding 1, kAxis 2 writes word 0 instead of
// binding 2. One invocation: one brick. Distances stop at kFarthest. Race: each output written once;
// in pass 2 every invocation reads and writes only its own brick's words.
// CPU oracle: distances of tests/view/skip_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) buffer Skip { uint skip[]; };
layout(set = 0, binding = 1) readonly buffer From { uint from[]; };
layout(set = 0, binding = 2) writeonly buffer To { uint to[]; };
layout(push_constant) uniform Push { DistancePush push; };
layout(constant_id = 0) const int kAxis = 0;

uint place(ivec3 brick) {
  return uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z));
}

uint word_of(ivec3 brick) { return uint(push.bricks.w) + uint(kSkipWords) * place(brick); }

uint distance_before(ivec3 brick) {
  if (any(lessThan(brick, ivec3(0))) || any(greaterThanEqual(brick, push.bricks.xyz)))
    return uint(kFarthest);
  if (kAxis > 0) return from[place(brick)];
  const uint word = word_of(brick);
  return (skip[word + 1u] | skip[word + 2u]) != 0u ? 0u : uint(kFarthest);
}

void main() {
  const ivec3 brick = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(brick, push.bricks.xyz))) return;
  ivec3 way = ivec3(0);
  way[kAxis] = 1;
  uint best = distance_before(brick);
  for (int k = 1; k < kFarthest && uint(k) < best; ++k) {
    const uint nearest = min(distance_before(brick - k * way), distance_before(brick + k * way));
    best = min(best, max(uint(k), nearest));
  }
  if (kAxis < 2) {
    to[place(brick)] = best;
    return;
  }
  const uint word = word_of(brick);
  const bool full = (skip[word + 1u] & skip[word + 2u]) == 0xffffffffu;
  skip[word] = full ? kFull : best;
}
