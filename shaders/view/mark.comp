#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Marks the bricks into which, at the phase g, something moves that the look shows: every part of
// the frame whose values between least and greatest have extinction marks the bricks that its box,
// moved by g times the bounds of u, touches.
//
// binding  direction  format      shape            unit
// 0        in         PartRange   parts (z, y, x)  see ranges.comp
// 1        in         uint        kTable per look  the next entry from here on with extinction
// 2        out        uint        bricks (z, y, x) 1 = marked; cleared before
//
// One invocation: one part. Precision: fp32; boxes and values are widened by more than it rounds.
// Race: bricks are only ever set. CPU oracle: none; skipping is tested whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Parts { PartRange parts[]; };
layout(set = 0, binding = 1) readonly buffer Next { uint next_entry[]; };
layout(set = 0, binding = 2) buffer Marks { uint marks[]; };
layout(push_constant) uniform Push { MarkPush push; };

// Nodes between which y - x is linear are this far from the truth at most, voxels, and values by
// as much of their range: the picture shows what it computes, not the bound.
const float kAside = 0.1;
const float kOver = 0.02;

void main() {
  const ivec3 part = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(part, push.parts.xyz))) return;
  const uint place = uint(part.x + push.parts.x * (part.y + push.parts.y * part.z));
  const vec4 range = parts[place].values;
  const float share = push.phase.y;
  float low = mix(range.x, range.z, share), high = mix(range.y, range.w, share);
  const float over = kOver * (high - low);
  const uint from = uint(clamp(push.table.x * (low - over) + push.table.y - 1.0, 0.0, push.table.w));
  const uint to = uint(clamp(push.table.x * (high + over) + push.table.y + 1.0, 0.0, push.table.w));
  bool shows = next_entry[uint(push.table.z) + from] <= to;
  while (shows) {
    const vec3 start = float(kPart) * vec3(part);
    const vec3 box_low = start + push.phase.x * parts[place].least_u.xyz - kAside * push.phase.z;
    const vec3 box_high = start + float(kPart) + push.phase.x * parts[place].most_u.xyz + kAside * push.phase.z;
    const ivec3 first = clamp(ivec3(floor(box_low / float(kBrick))), ivec3(0), push.bricks.xyz - 1);
    const ivec3 last = clamp(ivec3(ceil(box_high / float(kBrick))) - 1, ivec3(0), push.bricks.xyz - 1);
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
          atomicOr(marks[uint(x + push.bricks.x * (y + push.bricks.y * z))], 1u);
    shows = false;
  }
}
