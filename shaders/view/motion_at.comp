#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The motion of a whole sequence at one time, from its summands:  u(x) = sum_n weight[n] summand[n](x). The weights
// are those of TimeBasis::at (compute/volume/sequence_motion.h), which alone knows how a motion depends on time.
//
// binding  direction  format   shape                  unit
// 0        in         vec4     kMostTerms             x: weight; y: which term
// 1        in         rgba32f  terms x field (z,y,x)  u in voxels of the volume
// 2        out        rgba32f  field (z, y, x)        u in voxels of the volume; w: 1
// 3        in         vec4     as 1                   the same buffer, read where kTexels is 0: the device has
//                                                     too few texels for it; else any buffer, not read
//
// One invocation: one sample. Precision: fp32. Race: each output written once.
// CPU oracle: SequenceMap::displacement.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Weights { vec4 weights[kMostTerms]; };
layout(set = 0, binding = 1) uniform samplerBuffer terms;
layout(set = 0, binding = 2) uniform writeonly image3D field;
layout(set = 0, binding = 3) readonly buffer TermBuffer { vec4 term_buffer[]; };
layout(constant_id = 0) const int kTexels = 1;
layout(push_constant) uniform Push { MotionAtPush push; };

vec3 term(int i) { return kTexels != 0 ? texelFetch(terms, i).xyz : term_buffer[i].xyz; }

void main() {
  const ivec3 at = ivec3(gl_GlobalInvocationID), size = push.size.xyz;
  if (any(greaterThanEqual(at, size))) return;
  const int sample_place = at.x + size.x * (at.y + size.y * at.z), count = size.x * size.y * size.z;
  vec3 u = vec3(0.0);
  for (int n = 0; n < push.size.w; ++n)
    u += weights[n].x * term(sample_place + count * int(weights[n].y));
  imageStore(field, at, vec4(u, 1.0));
}
