#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/left_over.glsl"
#include "include/symmetric.glsl"
// How far the field can be trusted at a cell: of all cells with confidence c about the share c is right within half a
// voxel.
//   A' = A - kNoiseOfGradient r^2 diag(1 / spacing^2)       (removes the gradients that noise of r^2 causes)
//   SD^2 = r^2 / (N l h^2),  l the smallest eigenvalue of A', N the voxels that the narrow window averages
//                                      (Cramer-Rao bound of the least certain direction, in voxels; an axis of one cell
//                                      does not count, since nothing moves across a single slice)
//   rest = |(A + damping I)^-1 b| / h                                (the step that the narrow window still asks for)
//   g = max |u(next) - u| / distance over the six neighbours                                   (an edge of the field)
//   rho: what the coarser level left unexplained, see left_over.glsl
//   odds = kRightOdds / ((rest + kRest)^2 (g + kSteep) (rho + kLeft))
//   confidence = (1 + 1 / (1 + 4 SD^2)) / 2 odds / (1 + odds) min(1, w),  w the share of the voxels that counted
// Where the data determine nothing it is at most 1/2, however smooth the field is.
//
// binding  direction  format                        shape            unit
// 0        in         uint                          bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, under the narrow window    cells (z, y, x)
// 4        in         rgba32f: u                    cells            mm
// 5        in         rgba: . r^2 w q               cells            of the coarser level when it ended
// 6        out        rgba32f: u, confidence        cells            mm, 0 to 1
//
// One invocation: one cell. Border: a missing neighbour is left out. Precision: fp32. Race: each output written once.
// CPU oracle: oracle::confidence.
layout(set = 0, binding = 1) uniform sampler3D equations0;
layout(set = 0, binding = 2) uniform sampler3D equations1;
layout(set = 0, binding = 3) uniform sampler3D equations2;
layout(set = 0, binding = 4) uniform sampler3D field;
layout(set = 0, binding = 5) uniform sampler3D coarser;
layout(set = 0, binding = 6) uniform writeonly image3D with_confidence;
layout(push_constant) uniform Push { ConfidencePush push; };

// Smallest eigenvalue of a symmetric 3 x 3 in closed form (Smith 1961).
float smallest_eigenvalue(vec3 diagonal, vec3 mixed) {  // xx yy zz, xy xz yz
  const float mean = (diagonal.x + diagonal.y + diagonal.z) / 3.0;
  const vec3 d = diagonal - mean;
  const float spread = sqrt((dot(d, d) + 2.0 * dot(mixed, mixed)) / 6.0);
  if (spread < 1e-12 * max(mean, 1e-20)) return mean;
  const float determinant = d.x * (d.y * d.z - mixed.z * mixed.z) - mixed.x * (mixed.x * d.z - mixed.z * mixed.y) +
                            mixed.y * (mixed.x * mixed.z - d.y * mixed.y);
  const float angle = acos(clamp(0.5 * determinant / (spread * spread * spread), -1.0, 1.0)) / 3.0;
  return mean + 2.0 * spread * cos(angle + 2.0943951);  // 2 pi / 3
}

// In voxels^2.
float variance_of(vec4 e0, vec4 e1, vec4 e2) {
  vec3 diagonal = vec3(e0.w, e1.z, e2.x) - e2.y * push.noise.xyz;
  // The value of an axis of one cell: at least as certain as all others, so that it is never the smallest.
  const float others = dot(max(diagonal, vec3(0.0)), vec3(1.0));
  for (int axis = 0; axis < 3; ++axis)
    if (push.cells[axis] == 1) diagonal[axis] = others;
  const float least = max(smallest_eigenvalue(diagonal, vec3(e1.x, e1.y, e1.w)), 1e-12);
  return (e2.y + kLeastResidual * e2.z) * push.noise.w / least;
}

// Largest |u(next) - u|^2 / distance^2 over the six neighbours.
float steepness2(ivec3 cell, vec3 here) {
  float most = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = -1; side <= 1; side += 2) {
      ivec3 next = cell;
      next[axis] = clamp(cell[axis] + side, 0, push.cells[axis] - 1);
      const vec3 d = (texelFetch(field, next, 0).xyz - here) / push.cell_mm[axis];
      most = max(most, dot(d, d));
    }
  }
  return most;
}

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = texelFetch(equations0, cell, 0);
  const vec4 e1 = texelFetch(equations1, cell, 0);
  const vec4 e2 = texelFetch(equations2, cell, 0);
  const vec3 u = texelFetch(field, cell, 0).xyz;
  float confidence = 0.0;
  if (e2.z > 0.01) {
    const float determined = 0.5 + 0.5 / (1.0 + 4.0 * variance_of(e0, e1, e2));
    const float rest = length(solved(matrix_of(e0, e1, e2), push.left.z, e0.xyz)) * push.cell_mm.w;
    const float rho = push.left.w * left_over(texelFetch(coarser, cell, 0), push.left.x, push.left.y);
    const float odds = kRightOdds / ((rest + kRest) * (rest + kRest) * (sqrt(steepness2(cell, u)) + kSteep) * (rho + kLeft));
    confidence = determined * odds / (1.0 + odds) * min(1.0, e2.z);
  }
  imageStore(with_confidence, cell, vec4(u, confidence));
}
