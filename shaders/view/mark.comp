#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Marks the bricks into which, at the phase g, something visible moves. Every part of the frame with extinction for
// some value between its least and greatest marks the bricks that its box, moved by g times the bounds of u, touches.
//
// The bounds of u are those of the part's motion to the next frame or, for a volume that one motion carries (kCarried),
// those of the field at this time: tight bounds, and cheap, since only visible parts are computed. Beyond the border u
// is clamped to the edge.
//
// binding  direction  format      shape            unit
// 0        in         PartRange   parts (z, y, x)  see ranges.comp
// 1        in         uint        kTable per transfer function   the next entry from here on with extinction
// 2        out        uint        bricks (z, y, x) 1 = marked; kCarried: a bit for each eighth that is,
//                                                  x + 2 y + 4 z; cleared before
// 3        in         rgba32f     field (z, y, x)  u in voxels of the volume (if kCarried)
//
// One invocation: one part. Precision: fp32; boxes and values are widened by more than the rounding errors. Race: bits
// are only ever set. CPU oracle: none; skipping is tested as a whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Parts { PartRange parts[]; };
layout(set = 0, binding = 1) readonly buffer Next { uint next_entry[]; };
layout(set = 0, binding = 2) buffer Marks { uint marks[]; };
layout(set = 0, binding = 3) uniform sampler3D field;
layout(push_constant) uniform Push { MarkPush push; };
layout(constant_id = 0) const int kCarried = 0;

// Largest error of y - x between nodes, where it is taken as linear, in voxels, and of values, as a share of their
// range: the bound must hold for the picture as it is computed.
const float kAside = 0.1;
const float kOver = 0.02;

// A trilinear u lies between the values at its cell's corners: the corners of all cells that the part touches bound it.
void bound_u(vec3 start, out vec3 least_u, out vec3 most_u) {
  vec3 middle, half_size;
  for (int row = 0; row < 3; ++row) {
    middle[row] = dot(push.field_from[row], vec4(start + 0.5 * float(kPart), 1.0));
    half_size[row] = dot(abs(push.field_from[row].xyz), vec3(0.5 * float(kPart)));
  }
  const ivec3 top = push.field_size.xyz - 1;
  const ivec3 first = clamp(ivec3(floor(middle - half_size)), ivec3(0), top);
  const ivec3 last = clamp(ivec3(ceil(middle + half_size)), ivec3(0), top);
  least_u = vec3(1e30);
  most_u = vec3(-1e30);
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x) {
        const vec3 u = texelFetch(field, ivec3(x, y, z), 0).xyz;
        least_u = min(least_u, u);
        most_u = max(most_u, u);
      }
}

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
  if (next_entry[uint(push.table.z) + from] <= to) {
    const vec3 start = float(kPart) * vec3(part);
    vec3 least_u = parts[place].least_u.xyz, most_u = parts[place].most_u.xyz;
    if (kCarried != 0) bound_u(start, least_u, most_u);
    vec3 box_low = start + push.phase.x * least_u - kAside * push.phase.z;
    vec3 box_high = start + float(kPart) + push.phase.x * most_u + kAside * push.phase.z;
    if (kCarried != 0) {
      box_low = mix(box_low, vec3(0.0), equal(part, ivec3(0)));
      box_high = mix(box_high, vec3(kBrick * push.bricks.xyz), equal(part, push.parts.xyz - 1));
    }
    // For carried volumes a bit is set for each eighth of a brick.
    const int along = kCarried != 0 ? 2 : 1;
    const float edge = float(kBrick / along);
    const ivec3 top = along * push.bricks.xyz - 1;
    const ivec3 first = clamp(ivec3(floor(box_low / edge)), ivec3(0), top);
    const ivec3 last = clamp(ivec3(ceil(box_high / edge)) - 1, ivec3(0), top);
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) {
          const ivec3 brick = ivec3(x, y, z) / along, eighth = ivec3(x, y, z) % along;
          atomicOr(marks[uint(brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z))],
                   1u << uint(eighth.x + 2 * eighth.y + 4 * eighth.z));
        }
  }
}
