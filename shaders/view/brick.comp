#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Computes a brick of the volume at the phase g: equations (23) to (25) of Lundin Palmerius et al. 2008 at every voxel,
//   v(x) = (1 - w) f0(y) + w f1(y + u(y)),   y + g u(y) = x,   w = g, or 0 if values are not blended,
// with the slope for shading, and the cells of the brick that can show anything.
// y - x is trilinear between back-tracked nodes, and u(y) = (x - y) / g needs no second read of the field. An error e
// of y cancels to first order: it enters as (1 - g) e f0' - (1 - g) e f1', and both frames show the same material.
//   slope = central difference, per mm along the axes of the voxels
//   cell: shows something if some value between its least and greatest corner has extinction. A
//   trilinear value lies between those of its cell's corners, so nothing is missed.
//
// binding  direction  format             shape              unit
// 0        in         rgba32f            nodes (z, y, x)    y - x, voxels
// 1        in         any, one channel   frame (z, y, x)    share of the range
// 2        in         any, one channel   next frame         share of the range
// 3        in         uint               see list.comp      groups of bricks to compute
// 4        in         uint               kTable per transfer function   the next entry from here on with extinction
// 5        in         float              kMostLevels x kTable per transfer function; level l: the largest
//                                        extinction (1/mm) of 2^l entries from here on
// 6        out        any rgba           volume (z, y, x)   slope in shares per mm, share
// 7        out        uint               kSkipWords per brick; flags in the first, see kThin
//
// A workgroup makes a group of bricks. It computes values up to one voxel around their nodes, so it does not depend on
// other groups; nodes on a common face are written by both, with the same value. Border: clamped to the edge.
// Precision: fp32, stored in the image's format. Race: bits are set in shared memory by atomics. CPU oracle: felt_value
// of tests/view/shown_value.h, which reads values as the hand does.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D nodes;
layout(set = 0, binding = 1) uniform sampler3D frame;
layout(set = 0, binding = 2) uniform sampler3D next_frame;
layout(set = 0, binding = 3) readonly buffer List { uint list[]; };
layout(set = 0, binding = 4) readonly buffer Next { uint next_entry[]; };
layout(set = 0, binding = 5) readonly buffer Most { float most[]; };
layout(set = 0, binding = 6) uniform writeonly image3D surface;
layout(set = 0, binding = 7) writeonly buffer Skip { uint skip[]; };
layout(push_constant) uniform Push { BrickPush push; };
layout(constant_id = 0) const int kMoves = 1;  // nodes are read
layout(constant_id = 1) const int kBlends = 1;  // the next frame is read
layout(constant_id = 2) const int kGroup = 1;  // bricks that a workgroup makes, along x and y

const int kBricks = kGroup * kGroup;
const ivec3 kEdge = kBrick * ivec3(kGroup, kGroup, 1);  // of a group, in voxels
const ivec3 kWide = kEdge + 3;  // values from one before the first node to one after the last
const int kRow = kWide.x, kSlice = kWide.x * kWide.y;
shared float values[kWide.x * kWide.y * kWide.z];

#include "include/brick_cells.glsl"

float value_at(vec3 voxel, vec3 back) {
  const vec3 scale = 1.0 / vec3(push.size.xyz);
  const vec3 y = voxel + 0.5 + back;
  float value = push.frames.x * textureLod(frame, y * scale, 0.0).x;
  if (kBlends != 0)
    value += push.frames.y * textureLod(next_frame, (y - push.frames.w * back) * scale, 0.0).x;
  return value;
}

// Values from `at` on, `count` along a row; back: y - x at the first one, which changes by step.
void make_run(int at, int count, inout vec3 voxel, inout vec3 back, vec3 step) {
  for (int x = 0; x < count; ++x) {
    values[at + x] = value_at(voxel, back);
    voxel.x += 1.0;
    back += step;
  }
}

// Row by row: y - x is linear along x between nodes, so only nodes are read. A row begins one voxel before a node.
void make_values(ivec3 origin) {
  const vec3 per_node = 1.0 / push.nodes.xyz;
  int row = int(gl_LocalInvocationIndex);
  do {
    if (row < kWide.y * kWide.z) {
      const ivec2 yz = ivec2(row % kWide.y, row / kWide.y) - 1;
      vec3 voxel = vec3(origin + ivec3(-1, yz));
      int at = kRow * row;
      if (kMoves == 0) {
        vec3 back = vec3(0.0);
        make_run(at, kWide.x, voxel, back, vec3(0.0));
      } else {
        vec3 place = (vec3(float(origin.x) / float(kNode), voxel.yz / float(kNode)) + 0.5) * per_node;
        vec3 low = textureLod(nodes, place - vec3(per_node.x, 0.0, 0.0), 0.0).xyz;
        vec3 high = textureLod(nodes, place, 0.0).xyz;
        vec3 step = (high - low) / float(kNode), back = high - step;
        make_run(at, 1, voxel, back, step);
        ++at;
        int node = 0;
        do {
          place.x += per_node.x;
          low = high;
          high = textureLod(nodes, place, 0.0).xyz;
          step = (high - low) / float(kNode);
          back = low;
          make_run(at, kNode, voxel, back, step);
          at += kNode;
          ++node;
        } while (node < kEdge.x / kNode);
        low = high;
        place.x += per_node.x;
        step = (textureLod(nodes, place, 0.0).xyz - low) / float(kNode);
        back = low;
        make_run(at, 2, voxel, back, step);
      }
    }
    row += 64;
  } while (row < kWide.y * kWide.z);
}

void write_surface(ivec3 origin) {
  const ivec3 kNodes = kEdge + 1;
  int row = int(gl_LocalInvocationIndex);
  do {
    if (row < kNodes.y * kNodes.z) {
      const ivec2 yz = ivec2(row % kNodes.y, row / kNodes.y);
      const int here = 1 + kRow * (yz.x + 1) + kSlice * (yz.y + 1);
      const bool inside = all(lessThan(origin.yz + yz, push.size.yz));
      float before = values[here - 1], value = values[here];
      for (int x = 0; x < kNodes.x; ++x) {
        const int at = here + x;
        const float after = values[at + 1];
        const vec3 slope =
            0.5 * push.per_mm.xyz *
            vec3(after - before, values[at + kRow] - values[at - kRow], values[at + kSlice] - values[at - kSlice]);
        if (inside && origin.x + x < push.size.x)
          imageStore(surface, origin + ivec3(x, yz), vec4(slope, value));
        before = value;
        value = after;
      }
    }
    row += 64;
  } while (row < kNodes.y * kNodes.z);
}

void main() {
  const ivec3 groups = (push.bricks.xyz + ivec3(kGroup - 1, kGroup - 1, 0)) / ivec3(kGroup, kGroup, 1);
  const int place = int(list[3u + gl_WorkGroupID.x]);
  const ivec3 group = ivec3(place % groups.x, place / groups.x % groups.y, place / (groups.x * groups.y));
  const ivec3 origin = kEdge * group;
  start_cells();
  make_values(origin);
  barrier();
  write_surface(origin);
  for (int b = 0; b < kBricks; ++b) {
    const ivec3 low = kBrick * ivec3(b % kGroup, b / kGroup, 0);
    mark_cells(b, 1 + low.x + kRow * (1 + low.y) + kSlice, origin + low, ivec3(0), ivec3(kBrick), 0.0);
  }
  barrier();
  for (int b = 0; b < kBricks; ++b) mark_blocks(b);
  barrier();
  for (int b = 0; b < kBricks; ++b) {
    const ivec3 brick = ivec3(kGroup, kGroup, 1) * group + ivec3(b % kGroup, b / kGroup, 0);
    if (all(lessThan(brick, push.bricks.xyz)))
      write_cells(b, uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z)), true);
  }
}
