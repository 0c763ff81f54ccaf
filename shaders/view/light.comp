#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// How much light reaches each cell of the light grid: of the light that comes from all directions, and of the direct
// light. It is exp(-depth) along cones, whose optical depth is read from the coarser levels the further away it lies
// (voxel cone tracing, Crassin et al. 2011). A cone takes 2^k cells of its way from one reading of level k:
//   depth(d) = sum_k 2^k D_k(x + 2 2^k d),   ambient = min(1, 2 mean_d exp(-depth(d))),   direct = exp(-depth(light))
// over the 8 directions to the corners of a cube. In front of a flat surface half of the directions are free, which
// counts as all of the light, and readings do not touch it. The direct light comes from a cone half as wide: level k - 1, read twice.
//
// binding  direction  format            shape              unit
// 0        in         ViewParameters    1
// 1-5      in         r                 cells of the levels   see light_density.comp, light_halve.comp
// 6        out        rg                cells (z, y, x)    ambient, direct: 0 to 1
//
// One invocation: one cell. Border: beyond the grid is nothing. Cells without neighbours that take light are not computed: 1.
// Precision: fp32. Race: each output written once. Tested against closed forms: tests/view/light_grid_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) uniform sampler3D level0;
layout(set = 0, binding = 2) uniform sampler3D level1;
layout(set = 0, binding = 3) uniform sampler3D level2;
layout(set = 0, binding = 4) uniform sampler3D level3;
layout(set = 0, binding = 5) uniform sampler3D level4;
layout(set = 0, binding = 6) uniform writeonly image3D reached;

// Optical depth of one edge of a cell, on a level, around a place in cells of the finest one.
float depth_at(int level, vec3 place) {
  // The number of cells along an axis is a multiple of 2^(kLightLevels - 1): all levels have the same shape.
  const vec3 at = (place + 0.5) / view.light_cells.xyz;
  float read;
  if (level == 0) read = textureLod(level0, at, 0.0).x;
  else if (level == 1) read = textureLod(level1, at, 0.0).x;
  else if (level == 2) read = textureLod(level2, at, 0.0).x;
  else if (level == 3) read = textureLod(level3, at, 0.0).x;
  else read = textureLod(level4, at, 0.0).x;
  return all(greaterThan(at, vec3(0.0))) && all(lessThan(at, vec3(1.0))) ? read : 0.0;
}

void main() {
  const ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(cell, ivec3(view.light_cells.xyz)))) return;
  const vec3 here = vec3(cell);
  vec2 light = vec2(1.0);
  if (depth_at(2, here) > 0.0) {
    float ambient = 0.0;
    for (int k = 0; k < 8; ++k) {
      const vec3 way = (vec3(k & 1, k >> 1 & 1, k >> 2) * 2.0 - 1.0) * inversesqrt(3.0);
      float depth = 0.0;
      for (int level = 0; level < kLightLevels - 1; ++level) {
        const float far = float(1 << level);
        depth += far * depth_at(level, here + 2.0 * far * way);
      }
      ambient += 0.125 * exp(-depth);
    }
    float depth = 0.0;
    for (int level = 0; level < kLightLevels; ++level) {
      const float far = float(1 << level);
      const int sharper = max(level - 1, 0);
      depth += 0.5 * far * (depth_at(sharper, here + 1.25 * far * view.light_way.xyz) +
                            depth_at(sharper, here + 1.75 * far * view.light_way.xyz));
    }
    light = vec2(min(2.0 * ambient, 1.0), exp(-depth));
  }
  imageStore(reached, cell, vec4(light, 0.0, 0.0));
}
