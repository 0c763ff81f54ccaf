#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/sliding.glsl"
// Where the step for sliding borders may have work, from the solved field alone: for each brick of the result's finer
// cells the candidates that lie across a border (sliding.glsl), and the largest slope.
//
// binding  direction  format        shape                      unit
// 0        in         uint          bricks listed              packed brick coordinates, of the solved cells
// 1        in         rgba32f: u    cells (z, y, x)            mm
// 2        in/out     uint pairs    bricks of the finer cells  bit n: candidate n; bits of the largest
//                                   (z, y, x)                  |u(next) - u|^2 / distance^2 along an axis
//
// One invocation: one solved cell. Border: a candidate outside the field is ignored. Precision: fp32. Race: atomic or
// and maximum; bits of floats that are not negative have the order of the values. CPU oracle: oracle::sliding_find.
TEXELS(1, field, rgba32f);
layout(set = 0, binding = 2) buffer Found { uint found[]; };
layout(push_constant) uniform Push { SlidingFindPush push; };

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec3 u = READ(field, cell).xyz;
  float steepest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    ivec3 next = cell;
    next[axis] = min(cell[axis] + 1, push.cells[axis] - 1);
    const vec3 slope = (READ(field, next).xyz - u) / push.cell_mm[axis];
    steepest = max(steepest, dot(slope, slope));
  }
  uint candidates = 0u;
  for (int c = 0; c < 6 * kSlidingSteps; ++c) {
    const ivec3 offset = candidate_offset(c, push.step.xyz);
    const ivec3 from = cell + offset;
    if (from != clamp(from, ivec3(0), push.cells.xyz - 1)) continue;
    if (across_border(u, READ(field, from).xyz, offset, push.cell_mm.xyz, push.different.xy)) candidates |= 1u << c;
  }
  const ivec3 brick = cell * push.ratio.xyz / kBrick;
  const int number = brick.x + push.bricks.x * (brick.y + push.bricks.y * brick.z);
  if (candidates != 0u) atomicOr(found[2 * number], candidates);
  atomicMax(found[2 * number + 1], floatBitsToUint(steepest));
}
