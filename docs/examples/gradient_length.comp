#version 460
#extension GL_GOOGLE_include_directive : require
#include "gradient_length.h"
// The length of a volume's gradient at each voxel.
//   g(i) = |(f(i + e_c) - f(i - e_c)) / (2 h_c)|, h: spacing, e_c: one voxel along axis c
// The central difference, whose error is O(h^2) (any text on numerical analysis).
//
// binding  direction  format              shape      unit
// 0        in         any, one channel    (z, y, x)  value
// 1        out        any, one channel    the same   value per mm
//
// One invocation: one voxel. Border: clamped to the edge. Precision: fp32. No race: each output is written once.
// CPU oracle: tests/vulkan/gradient_length_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D values;
layout(set = 0, binding = 1) uniform writeonly image3D lengths;
layout(push_constant) uniform Push { GradientLengthPush push; };

float value_at(ivec3 i) {
  return texelFetch(values, clamp(i, ivec3(0), push.size.xyz - 1), 0).r;
}

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.size.xyz))) return;
  const vec3 difference = vec3(value_at(i + ivec3(1, 0, 0)) - value_at(i - ivec3(1, 0, 0)),
                               value_at(i + ivec3(0, 1, 0)) - value_at(i - ivec3(0, 1, 0)),
                               value_at(i + ivec3(0, 0, 1)) - value_at(i - ivec3(0, 0, 1)));
  imageStore(lengths, i, vec4(length(difference / (2.0 * push.spacing_mm.xyz))));
}
