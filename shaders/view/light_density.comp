#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The extinction of a volume on the light grid: per cell the mean over four places, at every other corner of a cube half
// as wide (exact for a linear change). At each place it is the mean over the values that the volume has about it
// (pre-integrated, as along a ray, see raycast.comp), so thin films and steep transfer functions are not missed:
//   depth = edge mean( kept(x) (S(v + a) - S(v - a)) / 2a ),  a = |grad v| edge / 4
// as the optical depth of one edge of the cell. What is cut away takes no light.
//
// binding  direction  format            shape                   unit
// 0        in         ViewParameters    1
// 1        in         vec4              2 kTable per volume     see raycast.comp
// 2        in         uint              kSkipWords per brick    see raycast.comp, and 3 where kTexels is 0
// 3        in         uint              the same
// 4        in         any rgba          volume (z, y, x)        see brick.comp, carry.comp
// 5        in         r                 cells (z, y, x)         optical depth of the volumes before
// 6        out        r                 cells                   with this one's; may be the image of 5
//
// One invocation: one cell. Border: places outside the volume count as empty. Precision: fp32. Race: each cell is read
// and written by its own invocation only. Tested against closed forms: tests/view/light_grid_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) uniform samplerBuffer tables;
layout(set = 0, binding = 2) uniform usamplerBuffer skips;
layout(set = 0, binding = 3) readonly buffer SkipBuffer { uint skip_buffer[]; };
layout(set = 0, binding = 4) uniform sampler3D volume;
layout(set = 0, binding = 5) uniform sampler3D depth_before;
layout(set = 0, binding = 6) uniform writeonly image3D depth;
layout(push_constant) uniform Push { LightDensityPush push; };
layout(constant_id = 0) const int kTexels = 1;

#include "include/classified.glsl"

// Whether the cell of this voxel was computed and can show anything.
bool shows(int v, ivec3 voxel) {
  const ivec3 cell = voxel % kBrick;
  const uint word = skip_word(v, voxel / kBrick);
  // An empty brick's bits may be old.
  const uint apart = skip(word) & 0xffu;
  const uint row = skip(word + uint(kCellWord + 2 * cell.z + (cell.y >> 2)));
  return apart == 0u && (row >> uint(cell.x + 8 * (cell.y & 3)) & 1u) != 0u;
}

bool is_kept(vec3 cell) {
  bool kept = true;
  for (int p = 0; p < view.counts.y; ++p)
    kept = kept && dot(view.light_planes[p].xyz, cell) >= view.light_planes[p].w;
  return kept;
}

void main() {
  const ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(cell, push.cells.xyz))) return;
  const int v = int(push.volume.x);
  const vec3 size = view.volumes[v].size.xyz;
  const float aside_mm = 0.25 * push.volume.y;
  float sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    const vec3 way = vec3(k < 2 ? -1.0 : 1.0, (k & 1) == 0 ? -1.0 : 1.0, k == 0 || k == 3 ? -1.0 : 1.0);
    const vec3 place = vec3(cell) + 0.25 * way;
    const vec4 at = vec4(place, 1.0);
    const vec3 voxel = vec3(dot(push.voxel_from_cell[0], at), dot(push.voxel_from_cell[1], at),
                            dot(push.voxel_from_cell[2], at));
    const bool inside = all(greaterThanEqual(voxel, vec3(-0.5))) && all(lessThan(voxel, size - 0.5));
    const ivec3 nearest = clamp(ivec3(voxel), ivec3(0), ivec3(size) - 1);
    if (inside && shows(v, nearest) && is_kept(place)) {
      const vec4 here = classified(v, textureLod(volume, (voxel + 0.5) / size, 0.0), voxel);
      const float around = view.volumes[v].table.x * aside_mm * length(here.xyz);
      const float last = float(kTable) - 0.5;
      const float low = clamp(here.w - around, 0.5, last), high = clamp(here.w + around, 0.5, last);
      const float extinction = mean_between(low, high, integral(v, low), integral(v, high), glow_of(v, here.w)).w;
      const vec3 slope = here.xyz * view.volumes[v].stretch.xyz;
      sum += extinction * kept_of(v, surface_of(v, dot(slope, slope)));
    }
  }
  sum *= 0.25 * push.volume.y;
  if (push.cells.w != 0) sum += texelFetch(depth_before, cell, 0).x;
  imageStore(depth, cell, vec4(sum));
}
