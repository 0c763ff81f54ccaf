#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/left_out.glsl"
// The normal equations without a part of the cells, for a fit that is to predict that part.
//   e(i) <- 0 where i belongs to the part, else e(i)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp       cells (z, y, x)
// 4-6      out        the same             cells
//
// One invocation: one cell. Precision: as stored. Race: each output written once. CPU oracle: oracle::leave_out.
layout(set = 0, binding = 1) uniform sampler3D all0;
layout(set = 0, binding = 2) uniform sampler3D all1;
layout(set = 0, binding = 3) uniform sampler3D all2;
layout(set = 0, binding = 4) uniform writeonly image3D left0;
layout(set = 0, binding = 5) uniform writeonly image3D left1;
layout(set = 0, binding = 6) uniform writeonly image3D left2;
layout(push_constant) uniform Push { LeaveOutPush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const float kept = is_left_out(cell, push.cells.w) ? 0.0 : 1.0;
  imageStore(left0, cell, kept * texelFetch(all0, cell, 0));
  imageStore(left1, cell, kept * texelFetch(all1, cell, 0));
  imageStore(left2, cell, kept * texelFetch(all2, cell, 0));
}
