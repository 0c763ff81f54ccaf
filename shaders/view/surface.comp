#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// What rays read: value and slope in one texel, and which blocks of a brick can show anything.
//   slope = central difference of the values, per mm along the axes of the voxels
//   block of 2 x 2 x 2 cells: occupied if some value between its least and its greatest one has
//   extinction. A trilinear value lies between those of its cell's corners, so nothing is missed.
//
// binding  direction  format             shape             unit
// 0        in         float              volume (z, y, x)  share of the range
// 1        in         uint               kTable per look   the next entry from here on with extinction
// 2        out        any rgba           volume (z, y, x)  share per mm, share per mm, share per mm, share
// 3        out        uint               kSkipWords per brick; words 1 and 2: a bit per block,
//                                        x + 4 y + 16 z, from the lowest
//
// A group is a brick, an invocation a row of its cells along x. Border: held. Precision: fp32,
// stored as the image has it. Race: bits of a brick are joined in shared memory by atomics.
// CPU oracle: occupancy of tests/view/skip_test.cpp.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) readonly buffer Values { float values[]; };
layout(set = 0, binding = 1) readonly buffer Next { uint next_entry[]; };
layout(set = 0, binding = 2) uniform writeonly image3D surface;
layout(set = 0, binding = 3) writeonly buffer Skip { uint skip[]; };
layout(push_constant) uniform Push { SurfacePush push; };

shared uint bits[2];

uint row(int y, int z) {
  const ivec3 last = push.size.xyz - 1;
  return uint(push.size.x) * uint(clamp(y, 0, last.y) + push.size.y * clamp(z, 0, last.z));
}

uint entry(float value, float aside) {
  return uint(clamp(push.table.x * value + push.table.y + aside, 0.0, push.table.w));
}

void main() {
  const uint lane = gl_LocalInvocationIndex;
  if (lane < 2u) bits[lane] = 0u;
  barrier();

  const ivec3 brick = ivec3(gl_WorkGroupID);
  const ivec3 start = kBrick * brick + ivec3(0, gl_LocalInvocationID.xy);
  const ivec3 last = push.size.xyz - 1;
  const uint here = row(start.y, start.z);
  const uint up = row(start.y + 1, start.z), down = row(start.y - 1, start.z);
  const uint front = row(start.y, start.z + 1), back = row(start.y, start.z - 1);
  const uint beyond = row(start.y + 1, start.z + 1);
  const bool inside = all(lessThanEqual(start.yz, last.yz));

  float before = values[here + uint(clamp(start.x - 1, 0, last.x))];
  uint at = uint(min(start.x, last.x));
  float value = values[here + at];
  float a = values[up + at], b = values[front + at], c = values[beyond + at];
  float low = min(min(value, a), min(b, c)), high = max(max(value, a), max(b, c));
  uint row_bits = 0u;
  for (int k = 0; k < kBrick; ++k) {
    const int x = start.x + k;
    const uint onward = uint(min(x + 1, last.x));
    const float after = values[here + onward];
    const vec3 slope = 0.5 * push.per_mm.xyz *
                       vec3(after - before, a - values[down + at], b - values[back + at]);
    if (inside && x <= last.x) imageStore(surface, ivec3(x, start.yz), vec4(slope, value));
    a = values[up + onward];
    b = values[front + onward];
    c = values[beyond + onward];
    const float next_low = min(min(after, a), min(b, c)), next_high = max(max(after, a), max(b, c));
    // One entry more to either side: rounding of the trilinear value may pass its cell's corners.
    const uint from = entry(min(low, next_low), -1.0), to = entry(max(high, next_high), 1.0);
    const bool shows = next_entry[uint(push.table.z) + from] <= to;
    row_bits |= (shows && x <= last.x ? 1u : 0u) << uint(k / 2);
    before = value;
    value = after;
    low = next_low;
    high = next_high;
    at = onward;
  }
  if (inside) {
    const uvec2 block = gl_LocalInvocationID.xy / 2u;
    atomicOr(bits[block.y / 2u], row_bits << (4u * block.x + 16u * (block.y & 1u)));
  }
  barrier();
  const uint word = uint(push.bricks.w + kSkipWords * (brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z)));
  if (lane < 2u) skip[word + 1u + lane] = bits[lane];
}
