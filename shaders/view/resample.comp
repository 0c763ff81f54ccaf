#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The volume as it is at the phase g, at every voxel: equations (23) to (25) of Lundin Palmerius et
// al. 2008,
//   v(x) = (1 - g) f0(y) + g f1(y + u(y)),   y + g u(y) = x.
// y - x is trilinear between back-tracked nodes, and u(y) = (x - y) / g needs no second look at the
// field. An error e of y cancels to first order: it enters as (1 - g) e f0' - (1 - g) e f1', and
// both frames show the same material.
//
// binding  direction  format             shape             unit
// 0        in         rgba32f            nodes (z, y, x)   y - x, voxels
// 1        in         any, one channel   frame (z, y, x)   share of the range
// 2        in         any, one channel   next frame        share of the range
// 3        out        float              volume (z, y, x)  share of the range
//
// One invocation: one voxel. Border: held. Precision: fp32. Race: each output written once.
// CPU oracle: shown_value of tests/view/shown_value.h, the hand's own reading.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform sampler3D nodes;
layout(set = 0, binding = 1) uniform sampler3D frame;
layout(set = 0, binding = 2) uniform sampler3D next_frame;
layout(set = 0, binding = 3) writeonly buffer Values { float values[]; };
layout(push_constant) uniform Push { ResamplePush push; };

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(i, push.size.xyz))) return;
  const float g = push.nodes.w;
  const vec3 scale = 1.0 / vec3(push.size.xyz);
  const vec3 back =
      g > 0.0 ? textureLod(nodes, (vec3(i) / float(kNode) + 0.5) / push.nodes.xyz, 0.0).xyz
              : vec3(0.0);
  const vec3 y = vec3(i) + 0.5 + back;
  float value = push.frames.x * textureLod(frame, y * scale, 0.0).x;
  if (push.frames.y > 0.0) {
    const vec3 onward = y - back / max(g, 1e-4);
    value += push.frames.y * textureLod(next_frame, onward * scale, 0.0).x;
  }
  values[uint(i.x) + uint(push.size.x) * uint(i.y + push.size.y * i.z)] = value;
}
