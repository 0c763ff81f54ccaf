#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Bounds of what a part of 4 x 4 x 4 cells of a frame shows on its way to the next frame: of its values, of its values
// in the next frame, and of its displacement. Computed once per frame and field.
//
// binding  direction  format             shape             unit
// 0        in         any, one channel   frame (z, y, x)   share of the range
// 1        in         any, one channel   next frame        share of the range
// 2        in         rgba32f            field (z, y, x)   u in voxels of the volume
// 3        out        PartRange          parts (z, y, x)
//
// kCurved: for the reference frame of a motion for all times, read as in curve.comp. Interpolated values exceed those
// at voxels by at most 1/8 of the differences of slopes along each axis, and those of a computed brick by as much
// again: a quarter is added. There is no next frame, and u is read for the present time (mark.comp).
//
// A trilinear value lies between the values at its cell's corners, so the corners of all cells that the part touches
// bound it; the same holds for u. One invocation: one part. Border: clamped to the edge. Precision: fp32. Race: each
// output written once. CPU oracle: none; skipping is tested as a whole.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D frame;
layout(set = 0, binding = 1) uniform sampler3D next_frame;
layout(set = 0, binding = 2) uniform sampler3D field;
layout(set = 0, binding = 3) writeonly buffer Parts { PartRange parts[]; };
layout(push_constant) uniform Push { RangesPush push; };
layout(constant_id = 0) const int kCurved = 0;

// First and last sample at the corners of the cells that the box from low to high touches.
void corners(vec3 low, vec3 high, ivec3 size, out ivec3 first, out ivec3 last) {
  first = clamp(ivec3(floor(low)), ivec3(0), size - 1);
  last = clamp(ivec3(ceil(high)), ivec3(0), size - 1);
}

void main() {
  const ivec3 part = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(part, push.parts.xyz))) return;
  const vec3 low = float(kPart) * vec3(part), high = low + float(kPart);
  ivec3 first, last;
  vec3 least_u = vec3(0.0), most_u = vec3(0.0);
  if (push.size.w != 0) {
    vec3 middle, half_size;
    for (int row = 0; row < 3; ++row) {
      middle[row] = dot(push.field_from[row], vec4(0.5 * (low + high), 1.0));
      half_size[row] = dot(abs(push.field_from[row].xyz), 0.5 * (high - low));
    }
    corners(middle - half_size, middle + half_size, push.field_size.xyz, first, last);
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
  vec4 range = vec4(1e30, -1e30, 1e30, -1e30);
  vec3 least_slope = vec3(1e30), most_slope = vec3(-1e30);
  corners(low, high, push.size.xyz, first, last);
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x) {
        const vec4 read = texelFetch(frame, ivec3(x, y, z), 0);
        float value = read.x;
        if (kCurved != 0) {
          value = read.w + 0.5 * dot(read.xyz, vec3(x, y, z) - 0.5 * vec3(push.size.xyz - 1));
          least_slope = min(least_slope, read.xyz);
          most_slope = max(most_slope, read.xyz);
        }
        range.xy = vec2(min(range.x, value), max(range.y, value));
      }
  const uint place = uint(part.x + push.parts.x * (part.y + push.parts.y * part.z));
  if (kCurved != 0) {
    const vec3 over = 0.25 * (most_slope - least_slope);
    range.x -= over.x + over.y + over.z;
    range.y += over.x + over.y + over.z;
    parts[place] = PartRange(range.xyxy, vec4(0.0), vec4(0.0));
    return;
  }
  corners(low + least_u, high + most_u, push.size.xyz, first, last);
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x) {
        const float value = texelFetch(next_frame, ivec3(x, y, z), 0).x;
        range.zw = vec2(min(range.z, value), max(range.w, value));
      }
  parts[place].values = range;
  parts[place].least_u = vec4(least_u, 0.0);
  parts[place].most_u = vec4(most_u, 0.0);
}
