#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/push.glsl"
// The discrete start: the cost of every whole-voxel displacement from the present field at the listed nodes. Finds
// motions larger than the spacing of structures, where a gradient points to the wrong structure.
//   cost(label, node) = mean over the node's voxels of min(|F(x) - M(x + round(u(node)) + label)|, cut)    (in voxels)
//
// binding  direction  format                shape                        unit
// 0        in         uint                  nodes listed                 index of the node, x fastest
// 1        in         rgba: gx . . F        image (z, y, x)              gx: infinite outside the mask; 1
// 2        in         rgba: . . . M         image                        1
// 3        in         rgba32f: u            nodes (z, y, x)              mm along the image axes
// 4        out        float                 labels (z, y, x), nodes listed   1
//
// One invocation: one node and one label; the y index of the workgroup is the label. Border: a partner outside the
// image costs the cut. Voxels outside the mask do not count; partners outside it do. Precision: fp32. Race: each output
// written once. CPU oracle: oracle::matching_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer List { uint listed[]; };
TEXELS(1, fixed_image, rgba16f);
TEXELS(2, moving_image, rgba16f);
layout(set = 0, binding = 3) uniform sampler3D base;
layout(set = 0, binding = 4) writeonly buffer Cost { float cost[]; };
PUSH_CONSTANTS(MatchingPush);

void main() {
  push = push_constants;
  const ivec3 nodes = push.nodes.xyz;
  const int count = push.nodes.w;
  const int n = int(gl_GlobalInvocationID.x);
  if (n >= count) return;
  const int number = int(listed[n]);
  const ivec3 node = ivec3(number % nodes.x, number / nodes.x % nodes.y, number / (nodes.x * nodes.y));
  const int l = int(gl_WorkGroupID.y);
  const ivec3 width = 2 * push.reach.xyz + 1;
  const ivec3 label = ivec3(l % width.x, l / width.x % width.y, l / (width.x * width.y)) - push.reach.xyz;
  const ivec3 shift = label + ivec3(round(texelFetch(base, node, 0).xyz / push.spacing_mm.xyz));

  const ivec3 begin = node * push.cell.xyz;
  const ivec3 end = min(begin + push.cell.xyz, push.size.xyz);
  float sum = 0.0;
  float counted = 0.0;
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const ivec3 at = ivec3(x, y, z);
        const vec4 f = READ(fixed_image, at);
        if (!(abs(f.x) <= kLargestGradient)) continue;
        const ivec3 partner = at + shift;
        const bool outside = any(lessThan(partner, ivec3(0))) || any(greaterThanEqual(partner, push.size.xyz));
        const float m = READ(moving_image, clamp(partner, ivec3(0), push.size.xyz - 1)).w;
        sum += outside ? push.spacing_mm.w : min(abs(f.w - m), push.spacing_mm.w);
        counted += 1.0;
      }
    }
  }
  cost[l * count + n] = counted > 0.0 ? sum / counted : 0.0;
}
