#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Lists the groups of bricks that have a marked brick or a neighbour of one, where segments of rays that begin in a marked
// brick may end. Only listed groups are computed; all other bricks become empty in the skip structure. Nodes are needed
// one brick further out.
//
// binding  direction  format  shape              unit
// 0        in         uint    bricks (z, y, x)   1 = marked
// 1        out        uint    the same           not 0: this brick or a neighbour may be listed
// 2        out        uint    3 + bricks         workgroups to dispatch (x; y and z are 1), then groups
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
layout(constant_id = 0) const int kGroup = 1;  // as in brick.comp

void main() {
  const ivec3 brick = ivec3(gl_GlobalInvocationID);
  const ivec3 last = push.bricks.xyz - 1;
  if (any(greaterThan(brick, last))) return;
  const uint place = uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z));
  // A group that lists this brick or a neighbour reaches one brick further, as its marks do.
  const ivec3 group = ivec3(kGroup, kGroup, 1), first = brick / group * group;
  const ivec3 from = max(brick - 1 - group, ivec3(0)), to = min(brick + 1 + group, last);
  uint near_listed = 0u, listed = 0u;
  for (int z = from.z; z <= to.z; ++z)
    for (int y = from.y; y <= to.y; ++y)
      for (int x = from.x; x <= to.x; ++x) {
        const ivec3 at = ivec3(x, y, z);
        const uint mark = marks[uint(x + push.bricks.x * (y + push.bricks.y * z))];
        near_listed |= mark;
        listed |= all(greaterThanEqual(at, first - 1)) && all(lessThanEqual(at, first + group)) ? mark : 0u;
      }
  near[place] = near_listed;
  if (listed == 0u) {
    // Not thin: nothing is sampled here.
    const uint word = uint(push.bricks.w) + uint(kSkipWords) * place;
    skip[word] = 0u;
    for (uint k = 1u; k < uint(kSkipWords); ++k) skip[word + k] = 0u;
  } else if (brick == first) {
    const ivec3 groups = (push.bricks.xyz + group - 1) / group, its = brick / group;
    list[3u + atomicAdd(list[0], 1u)] = uint(its.x + groups.x * (its.y + groups.y * its.z));
  }
}
