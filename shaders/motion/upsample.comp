#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// Interpolates the field of one level to the cells of the next.
//   to(i) = from(scale i + offset), trilinear
//
// binding  direction  format         shape                  unit
// 0        in         rgba32f: u     from cells (z, y, x)   mm along the image axes
// 1, 2     out        rgba32f: u     to cells               mm
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::upsample.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D from;
layout(set = 0, binding = 1) uniform writeonly image3D to;
layout(set = 0, binding = 2) uniform writeonly image3D to_as_well;
layout(push_constant) uniform Push { UpsamplePush push; };

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.to_cells.xyz))) return;
  const vec3 at = (push.scale.xyz * vec3(i) + push.offset.xyz + 0.5) / vec3(push.from_cells.xyz);
  const vec4 u = textureLod(from, at, 0.0);
  imageStore(to, i, u);
  imageStore(to_as_well, i, u);
}
