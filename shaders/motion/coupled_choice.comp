#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// One round of the coupled convex search (Heinrich, Papiez, Schnabel, Handels 2014): each node takes the label that is
// cheapest when its distance from the smooth field of the round before has a price; the smoothing between rounds is
// gauss.comp, and the price rises until choice and smooth field agree.
//   choice(node) = argmin over labels of cost(label, node) + price |label - u(node)|^2     (in voxels)
//
// binding  direction  format               shape                               unit
// 0        in         float                labels (z, y, x), nodes (z, y, x)   1
// 1        in         rgba32f: u           nodes                               mm
// 2        out        rgba32f: choice      nodes                               mm
//
// One invocation: one node, all labels. Of labels of equal cost the first in the order of the scan (x fastest, from
// -reach) is taken. Precision: fp32. Race: each output written once. CPU oracle: oracle::coupled_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Cost { float cost[]; };
layout(set = 0, binding = 1) uniform sampler3D field;
layout(set = 0, binding = 2) uniform writeonly image3D choice;
layout(push_constant) uniform Push { CoupledChoicePush push; };

void main() {
  const ivec3 nodes = push.nodes.xyz;
  const int count = nodes.x * nodes.y * nodes.z;
  const int n = int(gl_GlobalInvocationID.x);
  if (n >= count) return;
  const ivec3 node = ivec3(n % nodes.x, n / nodes.x % nodes.y, n / (nodes.x * nodes.y));
  const ivec3 reach = push.reach.xyz;
  const ivec3 width = 2 * reach + 1;
  const vec3 u = push.reach.w != 0 ? vec3(0.0) : texelFetch(field, node, 0).xyz / push.spacing_mm.xyz;
  // In the first round a hair of a price on motion itself decides between equals: no motion wins in flat regions.
  const float price = push.reach.w != 0 ? 1e-4 : push.spacing_mm.w;
  float best = 1e30;
  vec3 winner = vec3(0.0);
  int l = 0;
  for (int z = -reach.z; z <= reach.z; ++z) {
    for (int y = -reach.y; y <= reach.y; ++y) {
      for (int x = -reach.x; x <= reach.x; ++x, ++l) {
        const vec3 label = vec3(x, y, z);
        const vec3 off = label - u;
        const float total = cost[l * count + n] + price * dot(off, off);
        if (total < best) {
          best = total;
          winner = label;
        }
      }
    }
  }
  imageStore(choice, node, vec4(winner * push.spacing_mm.xyz, 0.0));
}
