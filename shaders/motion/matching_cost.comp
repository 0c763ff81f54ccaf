#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// The discrete start: what each whole-voxel displacement of a grid of choices would cost at each node, whatever lies
// between. Finds motions larger than the spacing of structures, where a gradient points to the wrong one.
//   cost(label, node) = mean over the node's voxels of min(|F(x) - M(x + label)|, cut)
//
// binding  direction  format                shape                        unit
// 0        in         rgba: gx . . F        image (z, y, x)              gx: infinite outside the mask; 1
// 1        in         rgba: . . . M         image                        1
// 2        out        float                 labels (z, y, x), nodes (z, y, x)   1
//
// One invocation: one node and one label; y of the group is the label. Border: a partner outside the image costs the
// cut; a voxel outside the mask does not count, a partner does. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::matching_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D fixed_image;
layout(set = 0, binding = 1) uniform sampler3D moving_image;
layout(set = 0, binding = 2) writeonly buffer Cost { float cost[]; };
layout(push_constant) uniform Push { MatchingPush push; };

void main() {
  const ivec3 nodes = push.nodes.xyz;
  const int count = nodes.x * nodes.y * nodes.z;
  const int n = int(gl_GlobalInvocationID.x);
  if (n >= count) return;
  const ivec3 node = ivec3(n % nodes.x, n / nodes.x % nodes.y, n / (nodes.x * nodes.y));
  const int l = int(gl_WorkGroupID.y);
  const ivec3 width = 2 * push.reach.xyz + 1;
  const ivec3 label = ivec3(l % width.x, l / width.x % width.y, l / (width.x * width.y)) - push.reach.xyz;

  const ivec3 begin = node * push.cell.xyz;
  const ivec3 end = min(begin + push.cell.xyz, push.size.xyz);
  float sum = 0.0;
  float counted = 0.0;
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const ivec3 at = ivec3(x, y, z);
        const vec4 f = texelFetch(fixed_image, at, 0);
        if (!(abs(f.x) <= kLargestGradient)) continue;
        const ivec3 partner = at + label;
        const bool outside = any(lessThan(partner, ivec3(0))) || any(greaterThanEqual(partner, push.size.xyz));
        const float m = texelFetch(moving_image, clamp(partner, ivec3(0), push.size.xyz - 1), 0).w;
        sum += outside ? push.cut.x : min(abs(f.w - m), push.cut.x);
        counted += 1.0;
      }
    }
  }
  cost[l * count + n] = counted > 0.0 ? sum / counted : 0.0;
}
