#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Prepares a frame that one motion carries for trilinear reading: at each voxel i the slope g_i of the value that the
// hand reads, per voxel, and
//   W_i = f_i - 1/2 g_i . i.
// Interpolated trilinearly at x, W and g give
//   f(x) = W + 1/2 g . x = sum_i w_i (f_i + 1/2 g_i . (x - i))
// which is exact for quadratic f, where a trilinear f has an error of up to h^2/8 f'' on each axis: thin bone is drawn
// where it is felt, for one dot product and no more reads. x counts from the middle of the volume, to keep rounding
// small.
//
// binding  direction  format   shape             unit
// 0        in         r32f     samples (z, y, x) data
// 1        out        rgba32f  image (z, y, x)   g, W, as shares of the data's range
//
// f and g are smoothed as in prefilter.comp; g is the B-spline's own derivative where samples are
// smoothed, else a central difference.
// One invocation: kPrefilterRun voxels along x. Border: the outermost sample is repeated.
// Precision: fp32. Race: each output written once. CPU oracle: FrameData::scalar of sampled_scalar.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform sampler3D samples;
layout(set = 0, binding = 1) uniform writeonly image3D curved;
layout(push_constant) uniform Push { PrefilterPush push; };

// The smoothed value and the slope of a row along y.
vec2 row(int x, ivec3 y, int z) {
  const float before = texelFetch(samples, ivec3(x, y.x, z), 0).x;
  const float here = texelFetch(samples, ivec3(x, y.y, z), 0).x;
  const float after = texelFetch(samples, ivec3(x, y.z, z), 0).x;
  return vec2(push.weights.x * here + push.weights.y * (before + after), 0.5 * (after - before));
}

// The value of a plane of constant x, smoothed over y and z, and its slopes along y and z.
vec3 plane(int x, ivec3 y, ivec3 z) {
  const int clamped = clamp(x, 0, push.size.x - 1);
  const vec2 a = row(clamped, y, z.x), b = row(clamped, y, z.y), c = row(clamped, y, z.z);
  const vec2 sum = push.weights.x * b + push.weights.y * (a + c);
  return vec3(sum, 0.5 * (c.x - a.x));
}

void main() {
  const ivec3 last = push.size.xyz - 1;
  const int first = kPrefilterRun * int(gl_GlobalInvocationID.x);
  const ivec2 at = ivec2(gl_GlobalInvocationID.yz);
  if (first > last.x || any(greaterThan(at, last.yz))) return;
  const ivec3 y = ivec3(max(at.x - 1, 0), at.x, min(at.x + 1, last.y));
  const ivec3 z = ivec3(max(at.y - 1, 0), at.y, min(at.y + 1, last.z));
  vec3 before = plane(first - 1, y, z), here = plane(first, y, z);
  for (int x = first; x < min(first + kPrefilterRun, last.x + 1); ++x) {
    const vec3 after = plane(x + 1, y, z);
    const vec3 sum = push.weights.x * here + push.weights.y * (before + after);
    const vec3 slope = push.weights.z * vec3(0.5 * (after.x - before.x), sum.yz);
    const float value = push.weights.z * sum.x + push.weights.w;
    const vec3 place = vec3(x, at) - 0.5 * vec3(last);
    imageStore(curved, ivec3(x, at), vec4(slope, value - 0.5 * dot(slope, place)));
    before = here;
    here = after;
  }
}
