#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/symmetric.glsl"
// How far the field is off at a cell: standard deviations along the local image gradient and across it. Confidence
// follows from them: of all cells with confidence c about the share c is right within half a voxel.
//   A' = A - kNoiseOfGradient r^2 diag(1 / spacing^2)       (removes the gradients that noise of r^2 causes)
//   SD^2(l) = min(r^2 / (N l h^2), kUnknown),  l an eigenvalue of A', N the voxels that the narrow window averages
//                                      (Cramer-Rao bound of a direction, in voxels^2; an axis of one cell is as certain
//                                      as all others together, since nothing moves across a single slice)
//   rest = min(|(A + (kRestDamping / h)^2 I)^-1 b| / h, 1)           (the step that the narrow window still asks for)
//   g = max |u(next) - u| / distance over the six neighbours                                   (an edge of the field)
//   base = h (rest + kRest)^0.4 (g + kSteep)^0.8 / max(w, kLeastShare),  w <= 1 the share of the voxels that counted
//   along = kAlong base (SD^2(largest l) + kCertain)^(1/4),  across = kAcross base (SD^2(smallest l) + kCertain)^(1/4)
//   and both at least kGuess h sqrt(SD^2(largest l) / kUnknown): where nothing is seen in any direction the field is a
//   guess, however smooth it is, and confidence at most a half
//   radius = kErrorRadius sqrt(along^2 + 2 across^2)                                 (the error is smaller at 95 % of cells)
//   confidence = 1 / (1 + (2 radius / h)^kErrorTail / 19)
// The same distribution of the error gives both: P(|error| < t) = 1 / (1 + (radius / t)^kErrorTail / 19), 0.95 for t = radius.
//
// binding  direction  format                        shape            unit
// 0        in         uint                          bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, under the narrow window    cells (z, y, x)
// 4        in         rgba32f: u                    cells            mm
// 5        out        rgba32f: u, confidence        cells            mm, 0 to 1
// 6        out        rgba: along across 0 0        cells            mm
//
// Where nothing counted, confidence is 0 and the deviations are those of nothing known. One invocation: one cell. Border: a
// missing neighbour is left out. Precision: fp32. Race: each output written once. CPU oracle: oracle::deviation.
layout(set = 0, binding = 1) uniform sampler3D equations0;
layout(set = 0, binding = 2) uniform sampler3D equations1;
layout(set = 0, binding = 3) uniform sampler3D equations2;
layout(set = 0, binding = 4) uniform sampler3D field;
layout(set = 0, binding = 5) uniform writeonly image3D with_confidence;
layout(set = 0, binding = 6) uniform writeonly image3D deviation;
layout(push_constant) uniform Push { ConfidencePush push; };

// Largest and smallest eigenvalue of a symmetric 3 x 3 in closed form (Smith 1961).
vec2 eigenvalues(vec3 diagonal, vec3 mixed) {  // xx yy zz, xy xz yz
  const float mean = (diagonal.x + diagonal.y + diagonal.z) / 3.0;
  const vec3 d = diagonal - mean;
  const float spread = sqrt((dot(d, d) + 2.0 * dot(mixed, mixed)) / 6.0);
  if (spread < 1e-12 * max(mean, 1e-20)) return vec2(mean);
  const float determinant = d.x * (d.y * d.z - mixed.z * mixed.z) - mixed.x * (mixed.x * d.z - mixed.z * mixed.y) +
                            mixed.y * (mixed.x * mixed.z - d.y * mixed.y);
  const float angle = acos(clamp(0.5 * determinant / (spread * spread * spread), -1.0, 1.0)) / 3.0;
  return mean + 2.0 * spread * cos(angle + vec2(0.0, 2.0943951));  // 2 pi / 3
}

// SD^2 of the largest and the smallest eigenvalue, in voxels^2.
vec2 variances_of(vec4 e0, vec4 e1, vec4 e2) {
  vec3 diagonal = vec3(e0.w, e1.z, e2.x) - e2.y * push.noise.xyz;
  // The value of an axis of one cell: at least as certain as all others, so that it is never the smallest.
  const float others = dot(max(diagonal, vec3(0.0)), vec3(1.0));
  for (int axis = 0; axis < 3; ++axis)
    if (push.cells[axis] == 1) diagonal[axis] = others;
  const vec2 l = max(eigenvalues(diagonal, vec3(e1.x, e1.y, e1.w)), vec2(1e-12));
  return min((e2.y + kLeastResidual * e2.z) * push.noise.w / l, vec2(kUnknown));
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
  const bool counted = e2.z > kCounts;
  const float per_mm = push.cell_mm.w;
  const float damping = kRestDamping * kRestDamping * per_mm * per_mm;
  vec2 variances = vec2(kUnknown);
  float rest = 1.0;
  if (counted) {
    variances = variances_of(e0, e1, e2);
    // Where rounding has left a matrix without an inverse this is not a number, or too large: nothing is known then.
    const float step = length(solved(matrix_of(e0, e1, e2), damping, e0.xyz)) * per_mm;
    if (step < 1.0) rest = step;
  }
  const float steep = sqrt(steepness2(cell, u)) + kSteep;
  const float base = pow((rest + kRest) * steep * steep, 0.4) / clamp(e2.z, kLeastShare, 1.0);
  const float guess = kGuess * sqrt(variances.x / kUnknown);
  const vec2 sd = max(vec2(kAlong, kAcross) * base * sqrt(sqrt(variances + kCertain)), vec2(guess));  // in voxels
  const float radius = kErrorRadius * sqrt(sd.x * sd.x + 2.0 * sd.y * sd.y);
  const float confidence = counted ? 1.0 / (1.0 + pow(2.0 * radius, kErrorTail) / 19.0) : 0.0;
  imageStore(with_confidence, cell, vec4(u, confidence));
  imageStore(deviation, cell, vec4(sd / per_mm, 0.0, 0.0));
}
