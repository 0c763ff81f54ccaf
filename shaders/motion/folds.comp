#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
// Finds the cells in which the field, sampled at the voxels of the image, folds: det(I + grad u) <= limit at any of the
// 8 corners of a unit cube of voxels, with the cube's three edges at that corner as differences. Or likewise at any
// corner of a cube of cells, since slopes jump at a cell's middle and a fold smaller than a voxel can lie there. A
// bound excludes most cells first: with slopes a, b, c along the three axes, |a|^2 + |b|^2 + |c|^2 < 1 means that no
// unit vector is mapped to zero, so the determinant stays positive. Slopes inside a trilinear cell are convex
// combinations of those along its edges. With push.cells.w = 0 only the cubes of cells are looked at, which is faster.
//
// binding  direction  format               shape            unit
// 0        in         uint                 bricks listed    packed brick coordinates
// 1        in         rgba32f: u           cells (z, y, x)  mm along the image axes; through a linear sampler
// 2        out        any: 1 folds, 0 not  cells
// 3        in/out     uint                 bricks listed    number of cells in it that fold
// 4        in         the image of 1, for its single texels
//
// One invocation: one cell, and the cubes whose lowest voxel lies in it. Border: field clamped. Precision: fp32.
// Race: each output written once; atomic count. CPU oracle: oracle::folds.
layout(set = 0, binding = 1) uniform sampler3D field;
layout(set = 0, binding = 2) uniform writeonly image3D flags;
layout(set = 0, binding = 3) buffer Count { uint count[]; };
TEXELS(4, field_texels, rgba32f);
layout(push_constant) uniform Push { FoldsPush push; };

const float kSafe = 0.9;

vec3 at_cell(ivec3 cell) { return READ(field_texels, clamp(cell, ivec3(0), push.cells.xyz - 1)).xyz; }

vec3 at_voxel(ivec3 voxel) {
  return textureLod(field, (vec3(voxel) + 0.5) / vec3(push.cells.xyz * push.cell.xyz), 0.0).xyz;
}

// Largest squared slopes along x, y, z over the edges between the 27 cells around this one.
vec3 largest_slopes(ivec3 cell, vec3 cell_mm) {
  vec3 u[27];
  for (int k = 0; k < 27; ++k) u[k] = at_cell(cell + ivec3(k % 3, k / 3 % 3, k / 9) - 1);
  vec3 largest = vec3(0.0);
  for (int k = 0; k < 27; ++k) {
    if (k % 3 < 2) largest.x = max(largest.x, dot(u[k + 1] - u[k], u[k + 1] - u[k]));
    if (k / 3 % 3 < 2) largest.y = max(largest.y, dot(u[k + 3] - u[k], u[k + 3] - u[k]));
    if (k / 9 < 2) largest.z = max(largest.z, dot(u[k + 9] - u[k], u[k + 9] - u[k]));
  }
  return largest / (cell_mm * cell_mm);
}

float smallest_determinant(ivec3 voxel) {
  const vec3 s = push.spacing_mm.xyz;
  vec3 u[8];
  for (int c = 0; c < 8; ++c) u[c] = at_voxel(voxel + ivec3(c & 1, c >> 1 & 1, c >> 2));
  float smallest = 1e30;
  for (int c = 0; c < 8; ++c) {
    const vec3 x = vec3(1, 0, 0) + (u[c | 1] - u[c & 6]) / s.x;
    const vec3 y = vec3(0, 1, 0) + (u[c | 2] - u[c & 5]) / s.y;
    const vec3 z = vec3(0, 0, 1) + (u[c | 4] - u[c & 3]) / s.z;
    smallest = min(smallest, dot(x, cross(y, z)));
  }
  return smallest;
}

// The same at the cell's middle, in the 8 cubes of cells that meet there.
float smallest_determinant_at_middle(ivec3 cell, vec3 cell_mm) {
  const vec3 u = at_cell(cell);
  float smallest = 1e30;
  for (int c = 0; c < 8; ++c) {
    const ivec3 side = 2 * ivec3(c & 1, c >> 1 & 1, c >> 2) - 1;
    const ivec3 next = cell + side;
    const vec3 outside = vec3(notEqual(next, clamp(next, ivec3(0), push.cells.xyz - 1)));
    // An axis of one cell has no differences and no cubes on its other side.
    if (dot(outside, vec3(greaterThan(push.cells.xyz, ivec3(1)))) > 0.0) continue;
    const vec3 x = vec3(1, 0, 0) + (at_cell(ivec3(next.x, cell.yz)) - u) / (cell_mm.x * side.x);
    const vec3 y = vec3(0, 1, 0) + (at_cell(ivec3(cell.x, next.y, cell.z)) - u) / (cell_mm.y * side.y);
    const vec3 z = vec3(0, 0, 1) + (at_cell(ivec3(cell.xy, next.z)) - u) / (cell_mm.z * side.z);
    smallest = min(smallest, dot(x, cross(y, z)));
  }
  return smallest;
}

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  const vec3 cell_mm = push.spacing_mm.xyz * vec3(push.cell.xyz);
  const vec3 slopes = largest_slopes(cell, cell_mm);
  bool folds = false;
  if (slopes.x + slopes.y + slopes.z >= kSafe) {
    folds = smallest_determinant_at_middle(cell, cell_mm) <= push.spacing_mm.w;
    const ivec3 begin = cell * push.cell.xyz;
    const int voxels = push.cells.w * push.cell.x * push.cell.y * push.cell.z;
    for (int k = 0; k < voxels && !folds; ++k) {
      const ivec3 voxel = begin + ivec3(k % push.cell.x, k / push.cell.x % push.cell.y, k / (push.cell.x * push.cell.y));
      // The last voxel of an axis begins no cube, except on an axis of one voxel: a slice can fold within itself.
      if (any(greaterThanEqual(voxel, max(push.image_size.xyz - 1, 1)))) continue;
      folds = smallest_determinant(voxel) <= push.spacing_mm.w;
    }
  }
  imageStore(flags, cell, vec4(folds ? 1.0 : 0.0));
  if (folds) atomicAdd(count[gl_WorkGroupID.x], 1u);
}
