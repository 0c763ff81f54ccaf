#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Writes the values that the hand reads at the voxels into an image that is then interpolated trilinearly.
//   f(i) = sum over the 27 neighbours of w(dx) w(dy) w(dz) s,  w(0) = x, w(-1) = w(1) = y
// The hand reads the cubic B-spline with the samples as coefficients, w = (1/6, 2/3, 1/6) at a voxel
// (module/scene/spline.h). Trilinear interpolation of f between voxels is up to h^2/8 f'' too high; the weights correct
// part of this in advance (see weights_of in volume_upload.cpp).
//
// binding  direction  format             shape             unit
// 0        in         r32f               samples (z, y, x) data
// 1        out        any, one channel   image (z, y, x)   share of the data's range
//
// One invocation: kPrefilterRun voxels along x, so that each sum over y and z is computed once and used three times.
// Border: the outermost sample is repeated, as for the spline. Precision: fp32, stored in the image's format. Race: each
// output written once. CPU oracle: FrameData::scalar of sampled_scalar.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform sampler3D samples;
layout(set = 0, binding = 1) uniform writeonly image3D frame;
layout(push_constant) uniform Push { PrefilterPush push; };

float row(int x, ivec3 y, int z) {
  return push.weights.x * texelFetch(samples, ivec3(x, y.y, z), 0).x +
         push.weights.y * (texelFetch(samples, ivec3(x, y.x, z), 0).x +
                           texelFetch(samples, ivec3(x, y.z, z), 0).x);
}

float plane(int x, ivec3 y, ivec3 z) {
  const int clamped = clamp(x, 0, push.size.x - 1);
  return push.weights.x * row(clamped, y, z.y) +
         push.weights.y * (row(clamped, y, z.x) + row(clamped, y, z.z));
}

void main() {
  const ivec3 last = push.size.xyz - 1;
  const int first = kPrefilterRun * int(gl_GlobalInvocationID.x);
  const ivec2 at = ivec2(gl_GlobalInvocationID.yz);
  if (first > last.x || any(greaterThan(at, last.yz))) return;
  const ivec3 y = ivec3(max(at.x - 1, 0), at.x, min(at.x + 1, last.y));
  const ivec3 z = ivec3(max(at.y - 1, 0), at.y, min(at.y + 1, last.z));
  float before = plane(first - 1, y, z), here = plane(first, y, z);
  for (int x = first; x < min(first + kPrefilterRun, last.x + 1); ++x) {
    const float after = plane(x + 1, y, z);
    const float sum = push.weights.x * here + push.weights.y * (before + after);
    imageStore(frame, ivec3(x, at), vec4(push.weights.z * sum + push.weights.w));
    before = here;
    here = after;
  }
}
