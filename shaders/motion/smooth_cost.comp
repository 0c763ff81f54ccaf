#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// One axis of (1 2 1)/4 over the nodes of each label's cost: the patch that is compared becomes wider than a node.
//
// binding  direction  format   shape                               unit
// 0        in         float    labels (z, y, x), nodes (z, y, x)   1
// 1        out        float    the same                            1
//
// One invocation: one node and one label. Border: held. Precision: fp32. Race: each output written once, not in place.
// CPU oracle: oracle::smooth_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Cost { float cost[]; };
layout(set = 0, binding = 1) writeonly buffer Smooth { float smoothed[]; };
layout(push_constant) uniform Push { SmoothCostPush push; };

void main() {
  const ivec3 nodes = push.nodes.xyz;
  const int count = nodes.x * nodes.y * nodes.z;
  const int n = int(gl_GlobalInvocationID.x);
  if (n >= count) return;
  const int axis = push.nodes.w;
  const int stride = axis == 0 ? 1 : axis == 1 ? nodes.x : nodes.x * nodes.y;
  const int index = n / stride % nodes[axis];
  const int at = int(gl_WorkGroupID.y) * count + n;
  const float before = cost[index > 0 ? at - stride : at];
  const float after = cost[index + 1 < nodes[axis] ? at + stride : at];
  smoothed[at] = 0.25 * (before + after) + 0.5 * cost[at];
}
