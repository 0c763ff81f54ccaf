#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// One step of the image pyramid: low-pass, then every second sample, along the axes that are still finer than the
// level's voxels.
//   coarse(i) = sum_k w_k fine(2 i + k), w = (1 3 3 1) / 8 for k = -1 .. 2 (Burt 1983, even kernel)
// An even kernel keeps the centre of a coarse voxel at the centre of the two voxels that it covers. The pair (1 3) is
// one linear sample at a quarter of the way, so 8 samples replace 64 taps.
//
// binding  direction  format             shape            unit
// 0        in         any, one channel   fine (z, y, x)   scaled intensity
// 1        out        any, one channel   coarse           scaled intensity
//
// One invocation: one coarse voxel. An image cut into slabs is processed slab by slab. Border: clamped. Precision: fp32
// sums. Race: each output written once. CPU oracle: oracle::downsample.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D fine;
layout(set = 0, binding = 1) uniform writeonly image3D coarse;
layout(push_constant) uniform Push { DownsamplePush push; };

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, push.coarse_size.w);
  const int end = push.ratio.w == 0 ? push.coarse_size.z : push.coarse_size.w + push.ratio.w;
  if (any(greaterThanEqual(i, ivec3(push.coarse_size.xy, min(end, push.coarse_size.z))))) return;
  const vec3 size = vec3(push.fine_size.xyz);
  const vec3 ratio = vec3(push.ratio.xyz);
  // Centre of the coarse voxel in fine texture coordinates (a voxel's centre is at + 0.5).
  const vec3 centre = ratio * (vec3(i) + 0.5) - vec3(0.0, 0.0, float(push.fine_size.w));
  const vec3 reach = 0.75 * (ratio - 1.0);  // the samples sit at 2 i - 0.25 and 2 i + 1.25
  float sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const vec3 side = 2.0 * vec3(corner & 1, corner >> 1 & 1, corner >> 2) - 1.0;
    sum += textureLod(fine, (centre + side * reach) / size, 0.0).r;
  }
  imageStore(coarse, i, vec4(sum / 8.0));
}
