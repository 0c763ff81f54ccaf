#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// A brick of the volume as it is at the phase g: equations (23) to (25) of Lundin Palmerius et al.
// 2008 at every voxel,
//   v(x) = (1 - w) f0(y) + w f1(y + u(y)),   y + g u(y) = x,   w = g, or 0 if values are not blended,
// with the slope that rays shade by, and which of its cells can show anything.
// y - x is trilinear between back-tracked nodes, and u(y) = (x - y) / g needs no second look at the
// field. An error e of y cancels to first order: it enters as (1 - g) e f0' - (1 - g) e f1', and both
// frames show the same material.
//   slope = central difference, per mm along the axes of the voxels
//   cell: shows something if some value between its least and greatest corner has extinction. A
//   trilinear value lies between those of its cell's corners, so nothing is missed.
//
// binding  direction  format             shape              unit
// 0        in         rgba32f            nodes (z, y, x)    y - x, voxels
// 1        in         any, one channel   frame (z, y, x)    share of the range
// 2        in         any, one channel   next frame         share of the range
// 3        in         uint               see list.comp      bricks to make
// 4        in         uint               kTable per look    the next entry from here on with extinction
// 5        in         float              kMostLevels x kTable per look; level l: the most extinction
//                                        (1/mm) of 2^l entries from here on
// 6        out        any rgba           volume (z, y, x)   slope in shares per mm, share
// 7        out        uint               kSkipWords per brick; flags in the first, see kThin
//
// A group is a brick. It makes values one voxel around its 9 x 9 x 9 nodes, so that no other brick
// has to be there; nodes on a common face are written by both bricks, with the same value.
// Border: held. Precision: fp32, stored as the image has it. Race: bits are joined in shared memory
// by atomics. CPU oracle: felt_value of tests/view/shown_value.h, the hand's own reading.
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
layout(constant_id = 0) const int kMoves = 1;   // nodes are looked at
layout(constant_id = 1) const int kBlends = 1;  // the next frame is looked at

const int kWide = kBrick + 3;  // values from one before the first node to one after the last
shared float values[kWide * kWide * kWide];
shared uint cells[2 * kBrick];
shared uint blocks[4];  // any cell of it, two words; every cell of it, two words
shared uint entries[2];  // least and greatest of the brick

float value_at(vec3 voxel, vec3 back) {
  const vec3 scale = 1.0 / vec3(push.size.xyz);
  const vec3 y = voxel + 0.5 + back;
  float value = push.frames.x * textureLod(frame, y * scale, 0.0).x;
  if (kBlends != 0)
    value += push.frames.y * textureLod(next_frame, (y - push.frames.w * back) * scale, 0.0).x;
  return value;
}

// Row by row: y - x is linear along x between nodes, so it is looked up at nodes only.
void make_values(ivec3 origin) {
  const vec3 per_node = 1.0 / push.nodes.xyz;
  for (int row = int(gl_LocalInvocationIndex); row < kWide * kWide; row += 64) {
    const ivec2 yz = ivec2(row % kWide, row / kWide) - 1;
    const vec3 voxel = vec3(origin + ivec3(-1, yz));
    vec3 back = vec3(0.0), low = vec3(0.0), step = vec3(0.0);
    vec3 at = (vec3(float(origin.x) / float(kNode), voxel.yz / float(kNode)) + 0.5) * per_node;
    vec3 high = vec3(0.0);
    if (kMoves != 0) {
      low = textureLod(nodes, at - vec3(per_node.x, 0.0, 0.0), 0.0).xyz;
      high = textureLod(nodes, at, 0.0).xyz;
      step = (high - low) / float(kNode);
      back = high - step;
    }
    for (int x = 0; x < kWide; ++x) {
      values[x + kWide * row] = value_at(voxel + vec3(x, 0.0, 0.0), back);
      back += step;
      // x = 1 is the node at the brick's origin; a new one comes every kNode.
      for (bool is_node = kMoves != 0 && x % kNode == 0; is_node; is_node = false) {
        at.x += per_node.x;
        low = high;
        high = textureLod(nodes, at, 0.0).xyz;
        step = (high - low) / float(kNode);
        back = low;
      }
    }
  }
}

void write_surface(ivec3 origin) {
  const int kNodes = kBrick + 1;
  for (int row = int(gl_LocalInvocationIndex); row < kNodes * kNodes; row += 64) {
    const ivec2 yz = ivec2(row % kNodes, row / kNodes);
    const int here = 1 + kWide * (yz.x + 1 + kWide * (yz.y + 1));
    const bool inside = all(lessThan(origin.yz + yz, push.size.yz));
    float before = values[here - 1], value = values[here];
    for (int x = 0; x < kNodes; ++x) {
      const int at = here + x;
      const float after = values[at + 1];
      const vec3 slope = 0.5 * push.per_mm.xyz *
                         vec3(after - before, values[at + kWide] - values[at - kWide],
                              values[at + kWide * kWide] - values[at - kWide * kWide]);
      if (inside && origin.x + x < push.size.x)
        imageStore(surface, origin + ivec3(x, yz), vec4(slope, value));
      before = value;
      value = after;
    }
  }
}

uint entry(float value, float aside) {
  return uint(clamp(push.table.x * value + push.table.y + aside, 0.0, push.table.w));
}

void mark_cells(ivec3 origin) {
  const ivec2 yz = ivec2(gl_LocalInvocationIndex % kBrick, gl_LocalInvocationIndex / kBrick);
  const int here = 1 + kWide * (yz.x + 1 + kWide * (yz.y + 1));
  const bool inside = all(lessThan(origin.yz + yz, push.size.yz));
  uint row_bits = 0u, least = ~0u, greatest = 0u;
  vec2 range = vec2(1e30, -1e30);
  for (int x = 0; x <= kBrick; ++x) {
    const int at = here + x;
    const vec4 face = vec4(values[at], values[at + kWide], values[at + kWide * kWide],
                           values[at + kWide + kWide * kWide]);
    const float low = min(min(face.x, face.y), min(face.z, face.w));
    const float high = max(max(face.x, face.y), max(face.z, face.w));
    // One entry more to either side: rounding of the trilinear value may pass its cell's corners.
    const uint from = entry(min(low, range.x), -1.0), to = entry(max(high, range.y), 1.0);
    const bool is_cell = x > 0 && inside && origin.x + x - 1 < push.size.x;
    const bool shows = is_cell && next_entry[uint(push.table.z) + from] <= to;
    row_bits |= (shows ? 1u : 0u) << uint(max(x - 1, 0));
    least = is_cell ? min(least, from) : least;
    greatest = is_cell ? max(greatest, to) : greatest;
    range = vec2(low, high);
  }
  if (inside) {
    atomicOr(cells[2 * yz.y + (yz.x >> 2)], row_bits << uint(8 * (yz.x & 3)));
    atomicMin(entries[0], least);
    atomicMax(entries[1], greatest);
  }
}

// Cells beyond the volume's last one are never looked at: they may keep a block from being full.
void mark_blocks() {
  const int lane = int(gl_LocalInvocationIndex);
  const ivec3 block = ivec3(lane & 3, lane >> 2 & 3, lane >> 4);
  const uint pair = 3u << uint(2 * block.x + 16 * (block.y & 1));
  const uint rows = pair | pair << 8;
  const int word = 4 * block.z + (block.y >> 1);
  const uint near_cells = cells[word] & rows, far_cells = cells[word + 2] & rows;
  const uint bit = 1u << uint(lane & 31);
  if ((near_cells | far_cells) != 0u) atomicOr(blocks[lane >> 5], bit);
  if (near_cells == rows && far_cells == rows) atomicOr(blocks[2 + (lane >> 5)], bit);
}

void main() {
  const uint lane = gl_LocalInvocationIndex;
  if (lane < uint(2 * kBrick)) cells[lane] = 0u;
  if (lane < 4u) blocks[lane] = 0u;
  if (lane < 2u) entries[lane] = lane == 0u ? ~0u : 0u;
  const uint place = list[3u + gl_WorkGroupID.x];
  const ivec3 bricks = push.bricks.xyz;
  const ivec3 brick = ivec3(place % uint(bricks.x), place / uint(bricks.x) % uint(bricks.y),
                            place / uint(bricks.x * bricks.y));
  make_values(kBrick * brick);
  barrier();
  write_surface(kBrick * brick);
  mark_cells(kBrick * brick);
  barrier();
  mark_blocks();
  barrier();
  const uint word = uint(push.bricks.w) + uint(kSkipWords) * place;
  if (lane < uint(2 * kBrick)) skip[word + uint(kCellWord) + lane] = cells[lane];
  if (lane < 4u) skip[word + uint(kBlockWord) + lane] = blocks[lane];
  if (lane == 0u) {
    const uint span = entries[1] - min(entries[0], entries[1]) + 1u;
    const uint level = uint(findMSB(span));
    const uint table = uint(push.table.z) * uint(kMostLevels) + level * uint(kTable);
    const float densest = max(most[table + entries[0]], most[table + entries[1] + 1u - (1u << level)]);
    const bool full = (blocks[2] & blocks[3]) == 0xffffffffu;
    skip[word] = densest <= push.frames.z ? kThin : full ? kSolid : 0u;
  }
}
