#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/left_over.glsl"
#include "include/symmetric.glsl"
// The Gauss-Newton step of two windows: the step of the wide window, plus the share s of what the narrow window adds to
// it. s follows from the difference that the coarser level left. The step is composed with the field.
//   rho = max(0, r^2 - W (w - q)) / (2 q + flat w)                        (the difference left there, beyond noise)
//   s = smoothstep(low, high, rho) smoothstep(kSteepest, kGentle, det),  l = mix(l_0, l_1, s)                 (damping)
//   d_w = (A_w + l I)^-1 b_w,  d = d_w + max(s, c) (A_n + l I)^-1 (b_n - A_n d_w),  |d_w|, |d| <= limit
//   w(x) = v(x + d) + d                                                   (compositive update, Vercauteren 2009)
// det is the smaller one of det(I + dv/dx) with forward and with backward differences: where the field is about to
// fold, s is 0. Where a share c was chosen (window_share.comp), the narrow window adds its step with the larger one of s
// and c. There c falls to 0 where most voxels under the narrow window do not count, as at the border of what both frames
// show.
// The weight of the total variation changes by the share `more`: 0 where s is 0; where s is 1 it becomes `strong`,
// reduced where the narrow window's step is well determined.
//   T = N g / (r_n^2 - g),  g = b_n . (A_n + l I)^-1 b_n                  (what a step explains, in units of its noise)
//   more = s (strong / (1 + T / T_half) - 1)
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, under the wide window    cells (z, y, x)
// 4-6      in         rgba, the same under the narrow window                    cells
// 7        in         rgba32f: vx vy vz .  cells            mm along the image axes
// 8        in         rgba: c r^2 w q      cells            c if it was chosen; of the coarser level when it ended
// 9        out        rgba32f: w, more     cells            mm, 1
// 10       in         the image of 7, for its single texels
//
// One invocation: one cell. Border: clamped. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::update_two.
TEXELS(1, wide0, rgba16f);
TEXELS(2, wide1, rgba16f);
TEXELS(3, wide2, rgba16f);
TEXELS(4, narrow0, rgba16f);
TEXELS(5, narrow1, rgba16f);
TEXELS(6, narrow2, rgba16f);
layout(set = 0, binding = 7) uniform sampler3D field;
TEXELS(8, coarser, rgba16f);
layout(set = 0, binding = 9) uniform writeonly image3D composed;
TEXELS(10, field_texels, rgba32f);
layout(push_constant) uniform Push { UpdateTwoPush push; };

// det(I + dv/dx) from the differences to the neighbours `step` cells away along each axis; beyond the border the
// difference is 0.
float determinant_of(ivec3 cell, int step) {
  const vec3 here = READ(field_texels, cell).xyz;
  mat3 m = mat3(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    ivec3 aside = cell;
    aside[axis] = clamp(cell[axis] + step, 0, push.cells[axis] - 1);
    m[axis] += (READ(field_texels, aside).xyz - here) / (float(step) * push.cell_mm[axis]);
  }
  return determinant(m);
}

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 left = READ(coarser, cell);
  const float rho = left_over(left, push.share.z, push.share.w);
  const float det = min(determinant_of(cell, 1), determinant_of(cell, -1));
  const float flat_enough = smoothstep(kSteepest, kGentle, det);
  const float s = smoothstep(push.share.x, push.share.y, rho) * flat_enough;
  const float damping = mix(push.step.x, push.step.y, s);

  const vec4 w0 = READ(wide0, cell);
  const Symmetric a_wide = matrix_of(w0, READ(wide1, cell), READ(wide2, cell));
  vec3 d = shortened(solved(a_wide, damping, w0.xyz), push.step.z);

  const vec4 n0 = READ(narrow0, cell);
  const vec4 n2 = READ(narrow2, cell);
  const float chosen = push.filter_weight.w > 0.0 ? left.x * flat_enough * smoothstep(kFew, kMost, n2.z) : 0.0;
  const Symmetric a_narrow = matrix_of(n0, READ(narrow1, cell), n2);
  d += max(s, chosen) * solved(a_narrow, damping, n0.xyz - times(a_narrow, d));
  d = shortened(d, push.step.z);

  const float gain = dot(n0.xyz, solved(a_narrow, damping, n0.xyz));
  const float noise = max(n2.y - gain, 1e-3 * n2.y + 1e-8);
  const float evidence = push.filter_weight.z * n2.z * gain / noise;
  const float more = s * (push.filter_weight.x / (1.0 + evidence / push.filter_weight.y) - 1.0);

  const vec3 at = (vec3(cell) + 0.5 + d / push.cell_mm.xyz) / vec3(push.cells.xyz);
  imageStore(composed, cell, vec4(textureLod(field, at, 0.0).xyz + d, more));
}
