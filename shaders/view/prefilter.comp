#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Puts what the hand reads at the voxels into an image that is then read trilinearly.
//   f(i) = sum over the 27 neighbours of w(dx) w(dy) w(dz) s,  w(0) = x, w(-1) = w(1) = y
// The hand reads the cubic B-spline with the samples as coefficients, w = (1/6, 2/3, 1/6) at a
// voxel (module/scene/spline.h). A trilinear reading of f in between is up to h^2/8 f'' too high;
// the weights take part of it off in advance (see weights_of in volume_upload.cpp).
//
// binding  direction  format             shape             unit
// 0        in         float              samples (z, y, x) data
// 1        out        any, one channel   image (z, y, x)   share of the data's range
//
// One invocation: one voxel. Border: the outermost sample is repeated, as the spline has it.
// Precision: fp32, stored as the image has it. Race: each output written once.
// CPU oracle: FrameData::scalar of sampled_scalar.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Samples { float samples[]; };
layout(set = 0, binding = 1) uniform writeonly image3D frame;
layout(push_constant) uniform Push { PrefilterPush push; };

float row(int y, int z, ivec3 x) {
  const uint start = uint(push.size.x) * uint(y + push.size.y * z);
  return push.weights.x * samples[start + x.y] +
         push.weights.y * (samples[start + x.x] + samples[start + x.z]);
}

float plane(ivec3 y, int z, ivec3 x) {
  return push.weights.x * row(y.y, z, x) + push.weights.y * (row(y.x, z, x) + row(y.z, z, x));
}

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  const ivec3 last = push.size.xyz - 1;
  if (any(greaterThan(i, last))) return;
  const ivec3 before = max(i - 1, ivec3(0)), after = min(i + 1, last);
  const ivec3 x = ivec3(before.x, i.x, after.x), y = ivec3(before.y, i.y, after.y);
  const float sum = push.weights.x * plane(y, i.z, x) +
                    push.weights.y * (plane(y, before.z, x) + plane(y, after.z, x));
  imageStore(frame, i, vec4(push.weights.z * sum + push.weights.w));
}
