#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// One round of the coupled convex search (Heinrich, Papiez, Schnabel, Handels 2014): each listed node takes the label
// with the least cost plus a penalty on its distance from the smooth field of the round before. gauss.comp smooths
// between rounds, and the penalty (price) rises. Nodes that are not listed keep the present field.
//   label(node) = argmin over labels of cost(label, node) + price |round(b(node)) + label - u(node)|^2     (in voxels)
//   choice(node) = round(b(node)) + label + part, part the vertex of a parabola through the costs of the label and its
//   neighbours along each axis; b(node) itself for label 0.
//
// binding  direction  format               shape                                unit
// 0        in         int                  nodes (z, y, x)                      index in the list; -1: not listed
// 1        in         float                labels (z, y, x), nodes listed       1
// 2        in         rgba32f: u           nodes                                mm
// 3        in         rgba32f: b           nodes                                mm, the present field
// 4        out        rgba32f: choice      nodes                                mm
//
// One invocation: one node, all labels. Of labels of equal cost the first in scan order (x fastest, from -reach) is
// taken. Precision: fp32. Race: each output written once. CPU oracle: oracle::coupled_cost.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Places { int places[]; };
layout(set = 0, binding = 1) readonly buffer Cost { float cost[]; };
layout(set = 0, binding = 2) uniform sampler3D field;
layout(set = 0, binding = 3) uniform sampler3D base;
layout(set = 0, binding = 4) uniform writeonly image3D choice;
layout(push_constant) uniform Push { CoupledChoicePush push; };

void main() {
  const ivec3 nodes = push.nodes.xyz;
  const int number = int(gl_GlobalInvocationID.x);
  if (number >= nodes.x * nodes.y * nodes.z) return;
  const int n = places[number];
  const int count = push.nodes.w;
  const ivec3 node = ivec3(number % nodes.x, number / nodes.x % nodes.y, number / (nodes.x * nodes.y));
  const vec3 b = texelFetch(base, node, 0).xyz;
  if (n < 0) {
    imageStore(choice, node, vec4(b, 0.0));
    return;
  }
  const ivec3 reach = push.reach.xyz;
  const ivec3 width = 2 * reach + 1;
  const vec3 from = round(b / push.spacing_mm.xyz);
  const vec3 u = texelFetch(field, node, 0).xyz / push.spacing_mm.xyz - from;
  float best = 1e30;
  ivec3 winner = ivec3(0);
  int l = 0;
  for (int z = -reach.z; z <= reach.z; ++z) {
    for (int y = -reach.y; y <= reach.y; ++y) {
      for (int x = -reach.x; x <= reach.x; ++x, ++l) {
        const vec3 off = vec3(x, y, z) - u;
        const float total = cost[l * count + n] + push.spacing_mm.w * dot(off, off);
        if (total < best) {
          best = total;
          winner = ivec3(x, y, z);
        }
      }
    }
  }
  vec3 result = b;
  if (winner != ivec3(0)) {
    const ivec3 strides = ivec3(1, width.x, width.x * width.y);
    const ivec3 place = winner + reach;
    const int at = place.x + strides.y * place.y + strides.z * place.z;
    const float here = cost[at * count + n];
    vec3 part = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      if (abs(winner[axis]) == reach[axis]) continue;
      const float before = cost[(at - strides[axis]) * count + n] - here;
      const float after = cost[(at + strides[axis]) * count + n] - here;
      if (before > 0.0 && after > 0.0) part[axis] = 0.5 * (before - after) / (before + after);
    }
    result = (from + vec3(winner) + part) * push.spacing_mm.xyz;
  }
  imageStore(choice, node, vec4(result, 0.0));
}
