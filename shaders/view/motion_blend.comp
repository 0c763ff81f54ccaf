#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// On the way from one motion to a better one: (1 - share) of the field before and `share` of the field after, on the
// samples of the latter.
//
// binding  direction  format   shape                        unit
// 0        in         rgba32f  field (z, y, x)              after: u in voxels of the volume
// 1        in         rgba32f  another field (z, y, x)      before: the same; read trilinear, its border clamped
// 2        out        rgba32f  field (z, y, x)              u in voxels of the volume; w: 1
//
// One invocation: one sample. Precision: fp32; a GPU's texture unit has 256 steps between the samples of `before`. Race:
// each output written once. CPU oracle: SequenceSnapshot::blend_from.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D after;
layout(set = 0, binding = 1) uniform sampler3D before;
layout(set = 0, binding = 2) uniform writeonly image3D field;
layout(push_constant) uniform Push { MotionBlendPush push; };

void main() {
  const ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, push.size.xyz))) return;
  const vec4 here = vec4(at, 1.0);
  const vec3 index = vec3(dot(push.before_from[0], here), dot(push.before_from[1], here), dot(push.before_from[2], here));
  const vec3 u_before = textureLod(before, (index + 0.5) / vec3(textureSize(before, 0)), 0.0).xyz;
  imageStore(field, at, vec4(mix(u_before, texelFetch(after, at, 0).xyz, push.share.x), 1.0));
}
