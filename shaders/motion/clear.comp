#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
// Clears an image to 0. A GPU's driver clears a volume slice by slice if asked to (vkCmdClearColorImage): with 100
// slices that took longer than an iteration.
//
// binding  direction  format       shape
// 0        out        any          size (z, y, x)
//
// One invocation: one texel. Race: each output written once.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform writeonly image3D image;
layout(push_constant) uniform Push { ClearPush push; };

void main() {
  const ivec3 i = ivec3(gl_GlobalInvocationID);
  if (i.x < push.size.x) imageStore(image, i, vec4(0.0));
}
