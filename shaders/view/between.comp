#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The pixels between points of the lattice: three for each point, to the right of it, below, and both. Where the picture
// is smooth around them they are interpolated by cubics (Catmull-Rom), that between four points as the mean along both
// diagonals. Others are listed, and their rays are drawn. It is smooth where each of the four points around a pixel is
// near the mean of its neighbours, along both axes and both diagonals. So a slope is smooth, an edge or a line is not.
//
// binding  direction  format          shape                     unit
// 0        in         ViewParameters  1
// 1        in         uvec4           eyes x half h x half w    see lattice.glsl
// 2        inout      uint            4 + pixels                groups to dispatch along x, y and z; number of pixels;
//                                                               then pixels, see lattice.glsl
// 3        in         uint            eyes x height x width     bits of the depth t of things, m; ~0 none
// 4        in         uvec2           tiles of 8 x 8 pixels     as in raycast.comp, as are:
// 5        in         uint            2 eyes x h x w            backdrop
// 6        out        uint            eyes x height x width     colour
// 7        out        uint            the same                  depth
//
// One invocation: one point. Border: neighbours outside are those on the border; pixels beyond the last points are
// listed. Race: places in the list by atomics; their order does not matter. Tested as a whole: tests/view/ray_lattice_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) readonly buffer Lattice { uvec4 lattice[]; };
layout(set = 0, binding = 2) buffer List { uint list[]; };
layout(set = 0, binding = 3) readonly buffer ThingDepth { uint thing_depth[]; };
layout(set = 0, binding = 4) readonly buffer Visible { uvec2 visible[]; };
layout(set = 0, binding = 5) readonly buffer Backdrop { uint backdrop[]; };
layout(set = 0, binding = 6) writeonly buffer Colour { uint colour_out[]; };
layout(set = 0, binding = 7) writeonly buffer Depth { uint depth_out[]; };
layout(constant_id = 0) const int kThings = 1;
layout(constant_id = 1) const int kMasked = 0;
layout(constant_id = 2) const int kBackdrop = 0;  // see backdrop.glsl
#include "include/srgb.glsl"
#include "include/backdrop.glsl"
#include "include/lattice.glsl"
#include "include/visible.glsl"

shared uint listed, first;

// The points around a cell, from the one before the cell's along both axes on; x runs first.
vec4 shown[16];
float depth[16];

bool read_points(ivec2 point, ivec2 points, int eye) {
  bool cut = false;
  for (int k = 0; k < 16; ++k) {
    const uvec4 packed = lattice[point_place(clamp(point + ivec2(k & 3, k >> 2) - 1, ivec2(0), points - 1), eye)];
    shown[k] = shown_of_point(packed);
    depth[k] = uintBitsToFloat(packed.z);
    cut = cut || packed.w != 0u;
  }
  return !cut;
}

// In units of smooth_below: brightness and transmittance, and 1 / depth where there is a surface at all three.
float off(int before, int here, int after) {
  const vec4 d = abs(shown[before] - 2.0 * shown[here] + shown[after]);
  const float least = min(min(depth[before], depth[here]), depth[after]);
  const float jump = abs(depth[before] - 2.0 * depth[here] + depth[after]);
  return max(max(max(d.x, d.y), max(d.z, d.w)), least > 0.0 ? jump / depth[here] : 0.0);
}

bool is_smooth(int eye) {
  float most = 0.0;
  for (int y = 1; y <= 2; ++y)
    for (int x = 1; x <= 2; ++x) {
      const int k = x + 4 * y;
      most = max(most, max(max(off(k - 1, k, k + 1), off(k - 4, k, k + 4)), max(off(k - 5, k, k + 5), off(k - 3, k, k + 3))));
    }
  return most < view.smooth_below[eye];
}

// In the middle between two of four points on a line.
vec4 cubic(int a, int b, int c, int d) {
  return clamp((9.0 * (shown[b] + shown[c]) - shown[a] - shown[d]) / 16.0, 0.0, 1.0);
}

// The mean of those that have a depth.
float depth_between(int a, int b) {
  return depth[a] > 0.0 && depth[b] > 0.0 ? 0.5 * (depth[a] + depth[b]) : max(depth[a], depth[b]);
}

void write(uint out_index, vec4 its, float its_depth, uint back_word) {
  const float surface = its.w > 0.5 ? 0.0 : its_depth;
  if (kBackdrop == 0) {
    colour_out[out_index] = packUnorm4x8(vec4(its.rgb, 1.0 - its.w));
    depth_out[out_index] = floatBitsToUint(surface);
  } else {
    write_over(out_index, decoded(its.rgb), its.w, surface, back_word);
  }
}

// Interpolates the pixel on this side of a point, or returns that its ray is to be drawn.
bool is_drawn(ivec2 pixel, int eye, bool smooth_here, vec4 its, float its_depth) {
  const ivec2 size = view.counts.zw;
  if (any(greaterThanEqual(pixel, size))) return false;
  const uint out_index = uint(pixel.x + size.x * (pixel.y + size.y * eye));
  uint back_word;
  const float back_at = backdrop_depth(size, out_index, back_word);
  bool drawn = !smooth_here || back_at < view.background_low.w;
  if (kThings != 0) drawn = drawn || thing_depth[out_index] != ~0u;
  if (kMasked != 0) drawn = drawn || !is_visible(pixel, eye, size);
  if (!drawn) write(out_index, its, its_depth, back_word);
  return drawn;
}

void main() {
  const uint l = gl_LocalInvocationIndex;
  const ivec2 point = ivec2(8u * gl_WorkGroupID.xy) + ivec2(l & 3u | l >> 1 & 4u, l >> 2 & 1u | l >> 3 & 6u);
  const ivec2 pixel = 2 * point, points = (view.counts.zw + 1) / 2;
  const int eye = int(gl_WorkGroupID.z);
  if (l == 0u) listed = 0u;
  bvec3 drawn = bvec3(false);
  if (all(lessThan(point, points))) {
    const bool uncut = read_points(point, points, eye);
    const bool smooth_here = uncut && is_smooth(eye) && all(lessThan(point + 1, points));
    drawn.x = is_drawn(pixel + ivec2(1, 0), eye, smooth_here, cubic(4, 5, 6, 7), depth_between(5, 6));
    drawn.y = is_drawn(pixel + ivec2(0, 1), eye, smooth_here, cubic(1, 5, 9, 13), depth_between(5, 9));
    drawn.z = is_drawn(pixel + 1, eye, smooth_here, 0.5 * (cubic(0, 5, 10, 15) + cubic(3, 6, 9, 12)),
                       0.5 * (depth_between(5, 10) + depth_between(6, 9)));
  }
  barrier();
  const uint number = uint(drawn.x) + uint(drawn.y) + uint(drawn.z);
  uint place = number > 0u ? atomicAdd(listed, number) : 0u;
  barrier();
  // A place in the list for all of the workgroup, and as many groups as the list has by now.
  if (l == 0u && listed > 0u) {
    first = atomicAdd(list[3], listed);
    const uint groups = (first + listed + 63u) / 64u;
    atomicMax(list[0], min(groups, uint(kMostListGroups)));
    atomicMax(list[1], (groups + uint(kMostListGroups) - 1u) / uint(kMostListGroups));
  }
  barrier();
  place += 4u + first;
  if (drawn.x) list[place++] = item_of(pixel + ivec2(1, 0), eye);
  if (drawn.y) list[place++] = item_of(pixel + ivec2(0, 1), eye);
  if (drawn.z) list[place++] = item_of(pixel + 1, eye);
}
