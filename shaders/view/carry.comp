#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Computes a brick of a volume whose frame is carried by one motion for all times: at every voxel y
//   v(y) = f(X),  X = y + b(y),  dv/dy_a = df/dX_a + sum_c db_c/dy_a df/dX_c,
// b trilinear between back-tracked nodes, f and df/dX from the reference frame, the only resident one (see curve.comp);
// stored in the format in which rays read it. Also the cells that can show anything.
//   cell: shows something if some value that its interpolation can give has extinction. Such a value lies
//   between those of the cell's corners, or beyond by at most 1/8 of the differences of slopes along
//   each axis: bounded by 0.3 of the largest sum of slopes in its rows.
//
// binding  direction  format    shape             unit
// 0        in         rgba32f   nodes (z, y, x)   X - y, voxels
// 1        in         rgba32f   frame (z, y, x)   see curve.comp
// 2        in         uint      see list.comp     bricks to compute
// 3        in         uint      kTable per transfer function   the next entry from here on with extinction
// 4        in         float     kMostLevels x kTable per transfer function; level l: the largest
//                                                 extinction (1/mm) of 2^l entries from here on
// 5        out        rgba32f   volume (z, y, x)  slope in shares per mm; W in shares
// 6        out        uint      kSkipWords per brick; flags in the first, see kThin
// 7        in         uint      bricks (z, y, x)  bits of the eighths to compute, see need.comp
//
// Of a brick only the box around the eighths that are needed is computed; a brick is thin or solid only if it was
// computed whole. A workgroup is a brick, an invocation computes a row of its 9 x 9 x 9 nodes. Nodes on a common face
// are written by both bricks, with the same value: slopes of b are those of the cell of nodes that begins there. The
// frame's own slopes are carried, so nothing around the brick is read. Border: clamped to the edge. Precision: fp32.
// Race: bits are set in shared memory by atomics. CPU oracle: felt_value of tests/view/shown_value.h, which reads
// values as the hand does.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D nodes;
layout(set = 0, binding = 1) uniform sampler3D frame;
layout(set = 0, binding = 2) readonly buffer List { uint list[]; };
layout(set = 0, binding = 3) readonly buffer Next { uint next_entry[]; };
layout(set = 0, binding = 4) readonly buffer Most { float most[]; };
layout(set = 0, binding = 5) uniform writeonly image3D surface;
layout(set = 0, binding = 6) writeonly buffer Skip { uint skip[]; };
layout(set = 0, binding = 7) readonly buffer Needed { uint needed[]; };
layout(push_constant) uniform Push { BrickPush push; };

const int kBricks = 1;
const int kWide = kBrick + 1;
const int kRow = kWide, kSlice = kWide * kWide;
shared float values[kWide * kWide * kWide];
shared float steepest[kWide * kWide];  // of a row, its largest sum of slopes, shares per voxel

#include "include/brick_cells.glsl"

// b and its slopes along y and z where a row crosses a plane of nodes.
struct Column {
  vec3 b, along_y, along_z;
};

vec3 node(ivec3 at) { return texelFetch(nodes, min(at, ivec3(push.nodes.xyz) - 1), 0).xyz; }

Column column(ivec3 at, vec2 within) {
  const vec3 b00 = node(at), b10 = node(at + ivec3(0, 1, 0));
  const vec3 b01 = node(at + ivec3(0, 0, 1)), b11 = node(at + ivec3(0, 1, 1));
  const float per_voxel = 1.0 / float(kNode);
  Column c;
  c.b = mix(mix(b00, b10, within.x), mix(b01, b11, within.x), within.y);
  c.along_y = per_voxel * mix(b10 - b00, b11 - b01, within.y);
  c.along_z = per_voxel * mix(b01 - b00, b11 - b10, within.x);
  return c;
}

// First and last voxel (both included) of the box around these eighths of a brick.
void box_of(uint eighths, out ivec3 low, out ivec3 high) {
  const bvec3 has_low = notEqual(eighths & uvec3(0x55u, 0x33u, 0x0fu), uvec3(0u));
  const bvec3 has_high = notEqual(eighths & uvec3(0xaau, 0xccu, 0xf0u), uvec3(0u));
  low = mix(ivec3(kBrick / 2), ivec3(0), has_low);
  high = mix(ivec3(kBrick / 2), ivec3(kBrick), has_high);
}

void make_rows(ivec3 origin, ivec3 box_low, ivec3 box_high) {
  const vec3 size = vec3(push.size.xyz), scale = 1.0 / size, last = size - 1.0;
  const ivec2 rows = box_high.yz - box_low.yz + 1;
  int k = int(gl_LocalInvocationIndex);
  do {
    if (k < rows.x * rows.y) {
      const ivec2 yz = box_low.yz + ivec2(k % rows.x, k / rows.x);
      const int row = yz.x + kWide * yz.y;
      const bool inside = all(lessThan(origin.yz + yz, push.size.yz));
      const vec2 within = vec2(yz % kNode) / float(kNode);
      ivec3 at = ivec3(origin.x + box_low.x, origin.yz + yz) / kNode;
      Column low, high = column(at, within), step;
      float most_slope = 0.0;
      // A box begins at a node. All rows of it are equally long, so their invocations leave these loops together.
      int x = box_low.x;
      do {
        low = high;
        ++at.x;
        high = column(at, within);
        step.b = (high.b - low.b) / float(kNode);
        step.along_y = (high.along_y - low.along_y) / float(kNode);
        step.along_z = (high.along_z - low.along_z) / float(kNode);
        const int next_node = min(x + kNode, box_high.x + 1);
        float along = 0.0;
        do {
          const ivec3 voxel = origin + ivec3(x, yz);
          const vec3 from = vec3(voxel) + low.b + along * step.b;
          const vec4 read = textureLod(frame, (from + 0.5) * scale, 0.0);
          const vec3 clamped = clamp(from, vec3(0.0), last);
          const float value = read.w + 0.5 * dot(read.xyz, clamped - 0.5 * last);
          const vec3 g = mix(vec3(0.0), read.xyz, equal(clamped, from));
          const vec3 slope = g + vec3(dot(step.b, g), dot(low.along_y + along * step.along_y, g),
                                      dot(low.along_z + along * step.along_z, g));
          values[x + kWide * row] = value;
          const vec3 steep = abs(slope);
          most_slope = max(most_slope, steep.x + steep.y + steep.z);
          if (inside && voxel.x < push.size.x)
            imageStore(surface, voxel,
                       vec4(slope * push.per_mm.xyz, value - 0.5 * dot(slope, vec3(voxel) - 0.5 * last)));
          along += 1.0;
          ++x;
        } while (x < next_node);
      } while (x <= box_high.x);
      steepest[row] = most_slope;
    }
    k += 64;
  } while (k < rows.x * rows.y);
}

void main() {
  const uint place = list[3u + gl_WorkGroupID.x];
  const ivec3 origin = kBrick * brick_of(place);
  start_cells();
  const uint eighths = needed[place];
  ivec3 box_low, box_high;
  box_of(eighths, box_low, box_high);
  make_rows(origin, box_low, box_high);
  barrier();
  const int row = int(gl_LocalInvocationIndex % kBrick + kWide * (gl_LocalInvocationIndex / kBrick));
  mark_cells(0, 0, origin, box_low, box_high, 0.3 * max(max(steepest[row], steepest[row + 1]),
                                max(steepest[row + kWide], steepest[row + kWide + 1])));
  barrier();
  mark_blocks(0);
  barrier();
  write_cells(0, place, eighths == 0xffu);
}
