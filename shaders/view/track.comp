#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Back-tracks a grid of nodes, one every kNode voxels, through the motion field: solves equation (26) of Lundin
// Palmerius et al. 2008,  y + g u(y) = x,  by Newton's method with the trilinear Jacobian. Starts from the last phase;
// a step that does not reduce the residual is halved.
//
// binding  direction  format    shape            unit
// 0        in         rgba32f   field (z, y, x)  u in voxels of the volume; w: 1, or 0 = unusable
// 1        in         rgba32f   nodes (z, y, x)  y - x of the last phase, voxels
// 2        out        rgba32f   the same image   y - x; w: 1 = found, 0 = frozen
// 3        in out     uint      1                number of frozen nodes
// 4        in         uint      bricks (z, y, x) 0 = no one reads the nodes of this brick; push.phase.z = 1:
//                                                the brick is not computed (need.comp)
//
// A motion for all times is tracked with g = 1, since its field is computed for the time. A node may be needed long
// after it was last tracked, so if no solution is found, the search starts once more from x - g u(x). A step shorter
// than kShort is the last one: the remaining residual is about its square times the field's curvature, or its length
// times the change of slope at a cell's face, too small to be visible.
//
// If no solution is found within kSteps, or the map is folded there (det(I + g du/dx) <= 0), the node keeps its former
// value: it is frozen, like the hand's point.
//
// One invocation: one node. Border: the field's samples are clamped to the edge. Precision: fp32; the residual is below
// 1e-3 voxels where w = 1. Race: an invocation reads and writes only its own node; frozen nodes are counted by an
// atomic.
// CPU oracle: back_track of module/haptics.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D field;
layout(set = 0, binding = 1) uniform sampler3D last;
layout(set = 0, binding = 2) uniform writeonly image3D nodes;
layout(set = 0, binding = 3) buffer Frozen { uint frozen[]; };
layout(set = 0, binding = 4) readonly buffer Near { uint near[]; };
layout(push_constant) uniform Push { TrackPush push; };

const int kSteps = 12;
const float kShort = 0.05;  // voxels

struct Reading {
  vec3 u;
  mat3 slope;  // column j: du / d(field index j)
};

Reading read(vec3 index) {
  const vec3 top = vec3(push.field_size.xyz - 1);
  const vec3 inside = clamp(index, vec3(0.0), top);
  const ivec3 low = ivec3(min(inside, max(top - 1.0, 0.0)));
  const ivec3 high = min(low + 1, push.field_size.xyz - 1);
  const vec3 w = inside - vec3(low);
  const vec3 a = texelFetch(field, low, 0).xyz;
  const vec3 b = texelFetch(field, ivec3(high.x, low.yz), 0).xyz;
  const vec3 c = texelFetch(field, ivec3(low.x, high.y, low.z), 0).xyz;
  const vec3 d = texelFetch(field, ivec3(high.xy, low.z), 0).xyz;
  const vec3 e = texelFetch(field, ivec3(low.xy, high.z), 0).xyz;
  const vec3 f = texelFetch(field, ivec3(high.x, low.y, high.z), 0).xyz;
  const vec3 g = texelFetch(field, ivec3(low.x, high.yz), 0).xyz;
  const vec3 h = texelFetch(field, high, 0).xyz;
  const vec3 unclamped = vec3(equal(inside, index));
  Reading r;
  const vec3 ab = mix(a, b, w.x), cd = mix(c, d, w.x), ef = mix(e, f, w.x), gh = mix(g, h, w.x);
  const vec3 front = mix(ab, cd, w.y), back = mix(ef, gh, w.y);
  r.u = mix(front, back, w.z);
  r.slope[0] = unclamped.x * mix(mix(b - a, d - c, w.y), mix(f - e, h - g, w.y), w.z);
  r.slope[1] = unclamped.y * mix(cd - ab, gh - ef, w.z);
  r.slope[2] = unclamped.z * (back - front);
  return r;
}

vec3 field_index(vec3 voxel) {
  const vec4 v = vec4(voxel, 1.0);
  return vec3(dot(push.field_from[0], v), dot(push.field_from[1], v), dot(push.field_from[2], v));
}

// Solves y + g u(y) = x, starting from y. True if it was solved without a fold there; y is the best value found.
bool solve(vec3 x, inout vec3 y) {
  const float g = push.phase.x;
  const mat3 turn = transpose(mat3(push.field_from[0].xyz, push.field_from[1].xyz, push.field_from[2].xyz));

  vec3 best = y, step = vec3(0.0), at = y;
  float best_miss = 3.0e38;
  bool unfolded = false;
  // One evaluation per round; if it is no better than the best one, the step that led there is halved.
  for (int round = 0; round < kSteps && best_miss > push.phase.y; ++round) {
    const Reading r = read(field_index(at));
    const vec3 off = at + g * r.u - x;
    const float miss = length(off);
    if (miss < best_miss) {
      best_miss = miss;
      best = at;
      mat3 m = g * (r.slope * turn);
      m[0].x += 1.0;
      m[1].y += 1.0;
      m[2].z += 1.0;
      const float det = determinant(m);
      unfolded = det > 0.0;
      step = det > 1e-4 ? -(inverse(m) * off) : -off;
      const bool last_step = push.phase.z != 0.0 && det > 1e-4 && length(step) < kShort;
      best += last_step ? step : vec3(0.0);
      best_miss = last_step ? 0.0 : best_miss;
    } else {
      step *= 0.5;
    }
    at = best + step;
  }
  y = best;
  return best_miss <= push.phase.y && unfolded;
}

void track(ivec3 node) {
  const vec3 x = float(kNode) * vec3(node);
  const vec4 before = push.nodes.w != 0 ? texelFetch(last, node, 0) : vec4(0.0);
  vec3 y = x + before.xyz;
  bool found = solve(x, y);
  if (!found && push.phase.z != 0.0) {
    y = x - push.phase.x * read(field_index(x)).u;
    found = solve(x, y);
  }
  if (!found) atomicAdd(frozen[0], 1u);
  imageStore(nodes, node, found ? vec4(y - x, 1.0) : vec4(before.xyz, 0.0));
}

void main() {
  const ivec3 node = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(node, push.nodes.xyz))) return;
  const ivec3 top = push.bricks.xyz - 1;
  const ivec3 brick = min(node * kNode / kBrick, top);
  bool needed = near[uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z))] != 0u;
  // A computed brick reads its own nodes and those of the bricks after it; push.phase.w = 1: also the last nodes of the
  // bricks before it.
  if (push.phase.z != 0.0) {
    const ivec3 here = node * kNode / kBrick;
    const int beyond = push.phase.w != 0.0 ? 1 : 0;
    for (int z = here.z - 1; z <= here.z + beyond; ++z)
      for (int y = here.y - 1; y <= here.y + beyond; ++y)
        for (int x = here.x - 1; x <= here.x + beyond; ++x) {
          const ivec3 other = clamp(ivec3(x, y, z), ivec3(0), top);
          needed = needed || near[uint(other.x + push.bricks.x * (other.y + push.bricks.y * other.z))] != 0u;
        }
  }
  if (needed) track(node);
}
