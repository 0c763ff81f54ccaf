#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Lists the marked bricks and their neighbours, where segments of rays that begin in a marked brick may end. Only
// listed bricks are computed; all others become empty in the skip structure. Nodes are needed one brick further out.
//
// binding  direction  format  shape              unit
// 0        in         uint    bricks (z, y, x)   1 = marked
// 1        out        uint    the same           1 = this brick or a neighbour is listed
// 2        out        uint    3 + bricks         workgroups to dispatch (x; y and z are 1), then bricks
// 3        out        uint    skip words
//
// One invocation: one brick. Race: places in the list by an atomic; their order does not matter. CPU oracle: none;
// skipping is tested as a whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Marks { uint marks[]; };
layout(set = 0, binding = 1) writeonly buffer Near { uint near[]; };
layout(set = 0, binding = 2) buffer List { uint list[]; };
layout(set = 0, binding = 3) writeonly buffer Skip { uint skip[]; };
layout(push_constant) uniform Push { BricksPush push; };

void main() {
  const ivec3 brick = ivec3(gl_GlobalInvocationID);
  const ivec3 last = push.bricks.xyz - 1;
  if (any(greaterThan(brick, last))) return;
  const uint place = uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z));
  const ivec3 from = max(brick - 2, ivec3(0)), to = min(brick + 2, last);
  uint near_listed = 0u, listed = 0u;
  for (int z = from.z; z <= to.z; ++z)
    for (int y = from.y; y <= to.y; ++y)
      for (int x = from.x; x <= to.x; ++x) {
        const uint mark = marks[uint(x + push.bricks.x * (y + push.bricks.y * z))];
        near_listed |= mark;
        listed |= all(lessThanEqual(abs(ivec3(x, y, z) - brick), ivec3(1))) ? mark : 0u;
      }
  near[place] = near_listed;
  const uint word = uint(push.bricks.w) + uint(kSkipWords) * place;
  if (listed != 0u) {
    list[3u + atomicAdd(list[0], 1u)] = place;
  } else {
    // Not thin: nothing is sampled here.
    skip[word] = 0u;
    for (uint k = 1u; k < uint(kSkipWords); ++k) skip[word + k] = 0u;
  }
}
