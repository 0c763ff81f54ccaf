#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// One axis of (1 2 1)/4 over the nodes of each label's cost, so that the compared patch is larger than a node.
//
// binding  direction  format   shape                                   unit
// 0        in         uint     nodes listed                            index of the node, x fastest
// 1        in         int      nodes (z, y, x)                         index in the list; -1: not listed
// 2        in         float    labels (z, y, x), nodes listed          1
// 3        out        float    the same                                1
//
// One invocation: one node and one label. Border: clamped; a neighbour that is not listed is replaced by the node
// itself. Precision: fp32. Race: each output written once, not in place. CPU oracle: oracle::smooth_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer List { uint listed[]; };
layout(set = 0, binding = 1) readonly buffer Places { int places[]; };
layout(set = 0, binding = 2) readonly buffer Cost { float cost[]; };
layout(set = 0, binding = 3) writeonly buffer Smooth { float smoothed[]; };
layout(push_constant) uniform Push { SmoothCostPush push; };

void main() {
  const ivec3 nodes = push.nodes.xyz;
  const int count = push.count.x;
  const int n = int(gl_GlobalInvocationID.x);
  if (n >= count) return;
  const int number = int(listed[n]);
  const int axis = push.nodes.w;
  const int stride = axis == 0 ? 1 : axis == 1 ? nodes.x : nodes.x * nodes.y;
  const int index = number / stride % nodes[axis];
  const int before = index > 0 ? places[number - stride] : n;
  const int after = index + 1 < nodes[axis] ? places[number + stride] : n;
  const int label = int(gl_WorkGroupID.y) * count;
  const float here = cost[label + n];
  smoothed[label + n] = 0.25 * (cost[label + (before < 0 ? n : before)] + cost[label + (after < 0 ? n : after)]) + 0.5 * here;
}
