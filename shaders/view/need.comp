#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// As list.comp, for a volume that one motion carries: lists bricks with an eighth that is marked or beside a marked
// one, where segments of rays that begin there may end. If segments are longer than an eighth, all of a brick counts as
// marked (then push.bricks.w < 0, and the first word is -1 - w).
//
// binding  direction  format  shape              unit
// 0        in         uint    bricks (z, y, x)   bits of marked eighths, x + 2 y + 4 z
// 1        out        uint    the same           bits of the eighths to compute; 0: the brick is not listed
// 2        out        uint    3 + bricks         workgroups to dispatch (x; y and z are 1), then bricks
// 3        out        uint    skip words
//
// One invocation: one brick. Race: places in the list by an atomic; their order does not matter. CPU oracle: none;
// skipping is tested as a whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Marks { uint marks[]; };
layout(set = 0, binding = 1) writeonly buffer Needed { uint needed[]; };
layout(set = 0, binding = 2) buffer List { uint list[]; };
layout(set = 0, binding = 3) writeonly buffer Skip { uint skip[]; };
layout(push_constant) uniform Push { BricksPush push; };

// Masks of the eighths that have a 0 or a 1 along each axis.
const uvec3 kLow = uvec3(0x55u, 0x33u, 0x0fu), kHigh = uvec3(0xaau, 0xccu, 0xf0u);

void main() {
  const ivec3 brick = ivec3(gl_GlobalInvocationID);
  const ivec3 top = push.bricks.xyz - 1;
  if (any(greaterThan(brick, top))) return;
  const bool whole = push.bricks.w < 0;
  const uint place = uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z));
  const ivec3 from = max(brick - 1, ivec3(0)), to = min(brick + 1, top);
  uint need = 0u;
  for (int z = from.z; z <= to.z; ++z)
    for (int y = from.y; y <= to.y; ++y)
      for (int x = from.x; x <= to.x; ++x) {
        const ivec3 way = ivec3(x, y, z) - brick;
        // Of a neighbouring brick only the eighths at this one count, and only the eighths of this one beside them are
        // needed.
        const uvec3 of = mix(mix(uvec3(0xffu), kLow, greaterThan(way, ivec3(0))), kHigh, lessThan(way, ivec3(0)));
        const uvec3 at = mix(mix(uvec3(0xffu), kHigh, greaterThan(way, ivec3(0))), kLow, lessThan(way, ivec3(0)));
        const uint mark = marks[uint(x + push.bricks.x * (y + push.bricks.y * z))];
        const bool counts = (mark & of.x & of.y & of.z) != 0u || whole && mark != 0u;
        need |= counts ? whole ? 0xffu : at.x & at.y & at.z : 0u;
      }
  needed[place] = need;
  const uint word = uint(whole ? -1 - push.bricks.w : push.bricks.w) + uint(kSkipWords) * place;
  if (need != 0u) {
    list[3u + atomicAdd(list[0], 1u)] = place;
  } else {
    skip[word] = 0u;
    for (uint k = 1u; k < uint(kSkipWords); ++k) skip[word + k] = 0u;
  }
}
