#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/motion.h"
#include "include/bricks.glsl"
// How far the field may be trusted at a cell, from the normal equations that made it.
//   SD^2 = r^2 / (N l),  l the smallest eigenvalue of A, N the voxels that the window averages   (Cramer-Rao bound
//          of the least certain direction: flat regions and edges without corners have a small l; an axis of one cell
//          is no direction, since nothing moves across a single slice)
//   match = max(0, 1 - r^2 / (2 q)),  the local correlation that is left: 0 for unrelated images
//   confidence = match min(1, w) / (1 + SD^2 / SD_half^2),  w the share of the window's voxels that counted
//
// binding  direction  format                        shape            unit
// 0        in         uint                          bricks listed    packed brick coordinates
// 1-3      in         rgba, see normal_equations.comp, smoothed      cells (z, y, x)
// 4        in         rgba32f: u                    cells            mm
// 5        out        rgba32f: u, confidence        cells            mm, 0 to 1
//
// One invocation: one cell. Border: none. Precision: fp32. Race: 4 is read only at the own cell, so 4 and 5 may be the
// same image. CPU oracle: oracle::confidence.
layout(set = 0, binding = 1) uniform sampler3D equations0;
layout(set = 0, binding = 2) uniform sampler3D equations1;
layout(set = 0, binding = 3) uniform sampler3D equations2;
layout(set = 0, binding = 4) uniform sampler3D field;
layout(set = 0, binding = 5) uniform writeonly image3D with_confidence;
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

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec4 e0 = texelFetch(equations0, cell, 0);
  const vec4 e1 = texelFetch(equations1, cell, 0);
  const vec4 e2 = texelFetch(equations2, cell, 0);
  float confidence = 0.0;
  if (e2.z > 0.01) {
    vec3 diagonal = vec3(e0.w, e1.z, e2.x);
    // As certain as all others together, so that it is never the least.
    const float others = diagonal.x + diagonal.y + diagonal.z;
    for (int axis = 0; axis < 3; ++axis)
      if (push.cells[axis] == 1) diagonal[axis] = others;
    const float least = max(smallest_eigenvalue(diagonal, vec3(e1.x, e1.y, e1.w)), 1e-12) / e2.z;
    const float residual = e2.y / e2.z;
    const float match = push.scale.z != 0.0 ? clamp(1.0 - 0.5 * e2.y / max(e2.w, 1e-12), 0.0, 1.0) : 1.0;
    const float variance = residual * push.scale.x / least;
    confidence = match * min(1.0, e2.z) / (1.0 + variance * push.scale.y);
  }
  imageStore(with_confidence, cell, vec4(texelFetch(field, cell, 0).xyz, confidence));
}
