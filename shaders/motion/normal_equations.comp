#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/push.glsl"
#include "include/bricks.glsl"
// The data term: per cell of the field the mean, over the cell's voxels, of the normal equations of optical flow at
// the current field (Lucas & Kanade 1981, with the symmetric gradient of Benhimane & Malis 2004).
//   r = F(x) - M(x + u),  g = (grad F(x) + grad M(x + u)) / 2,  b = r g,  A = g g^T
// and g = grad F(x) alone where the partner x + u lies outside the mask: grad M is infinite there, M is not
// (pack.comp).
//
// binding  direction  format                       shape              unit
// 0        in         uint                         bricks listed      packed brick coordinates
// 1        in         rgba: gx gy gz F             fixed slab         1/mm, 1
// 2        in         rgba: gx gy gz M             moving slab        1/mm, 1
// 3        in         rgba: ux uy uz .             cells (z, y, x)    mm along the image axes
// 4        out        rgba: bx by bz Axx           cells              1/mm, 1/mm^2
// 5        out        rgba: Axy Axz Ayy Ayz        cells              1/mm^2
// 6        out        rgba: Azz r^2 w q            cells              1/mm^2, 1, 1 (share of voxels that counted),
//                                                                     1: q = (F^2 + M^2) / 2, the structure
// 7-9      in         the images of 4-6, to add to
//
// One invocation: one cell. It keeps the 27 field values around it (9 for a cell one voxel deep) in registers and
// interpolates them axis by axis: reading the field trilinearly at each voxel would cost more than reading the image.
// Half of the voxels: with a colour, 0 or 1, only those of one colour of the 3-D checkerboard are read, with twice the
// weight. Alternating from iteration to iteration halves the cost and, under the window, loses almost nothing. Images
// cut into slabs: one dispatch per pair of slabs adds the voxels that this pair computes to the output. Border: a voxel
// does not count if its partner lies more than half a voxel outside the moving image, or if it lies outside the mask.
// Precision: fp32 sums. Race: each output written once. CPU oracle: oracle::normal_equations.
layout(constant_id = 0) const int kCellX = 2;
layout(constant_id = 1) const int kCellY = 2;
layout(constant_id = 2) const int kCellZ = 2;
TEXELS(1, fixed_image, rgba16f);
layout(set = 0, binding = 2) uniform sampler3D moving_image;
TEXELS(3, field, rgba32f);
layout(set = 0, binding = 4) uniform writeonly image3D equations0;
layout(set = 0, binding = 5) uniform writeonly image3D equations1;
layout(set = 0, binding = 6) uniform writeonly image3D equations2;
TEXELS(7, so_far0, rgba16f);
TEXELS(8, so_far1, rgba16f);
TEXELS(9, so_far2, rgba16f);
PUSH_CONSTANTS(NormalEquationsPush);

// Weights of the cell before, the cell itself and the cell after, for voxel `o` of a cell of `n` voxels.
vec3 weights(int o, int n) {
  const float t = (float(o) + 0.5) / float(n) - 0.5;
  return vec3(max(-t, 0.0), 1.0 - abs(t), max(t, 0.0));
}

void main() {
  push = push_constants;
  const ivec3 cell = brick_cell();
  const ivec3 cells = push.cells.xyz;
  if (beyond(cell, cells)) return;
  const ivec3 size = ivec3(kCellX, kCellY, kCellZ);
  const ivec3 begin = cell * size;
  // Outside of the fixed slab there is nothing to add; the first pair of slabs writes all cells.
  if (begin.z >= push.fixed_slab.z || begin.z + kCellZ <= push.fixed_slab.y) {
    if (push.moving_slab.w != 0) return;
    imageStore(equations0, cell, vec4(0.0));
    imageStore(equations1, cell, vec4(0.0));
    imageStore(equations2, cell, vec4(0.0));
    return;
  }
  const ivec3 last = cells - 1;

  vec3 u[27];
  for (int k = 0; k < 27; ++k) {
    // Along an axis with one voxel per cell the weights of the neighbours are 0, and they are not read.
    ivec3 step = ivec3(k % 3, k / 3 % 3, k / 9) - 1;
    if (size.x == 1) step.x = 0;
    if (size.y == 1) step.y = 0;
    if (size.z == 1) step.z = 0;
    u[k] = READ(field, clamp(cell + step, ivec3(0), last)).xyz;
  }

  vec3 b = vec3(0.0);
  vec3 diagonal = vec3(0.0);  // Axx Ayy Azz
  vec3 mixed = vec3(0.0);     // Axy Axz Ayz
  float residual = 0.0;
  float counted = 0.0;
  float structure = 0.0;
  const vec3 per_mm = 1.0 / push.spacing_mm.xyz;
  const vec3 moving_size = vec3(push.moving_size.xyz);
  for (int oz = 0; oz < kCellZ; ++oz) {
    const vec3 wz = weights(oz, kCellZ);
    const int z = begin.z + oz;
    if (z < push.fixed_slab.y || z >= push.fixed_slab.z) continue;
    vec3 plane[9];
    for (int k = 0; k < 9; ++k) plane[k] = wz.x * u[k] + wz.y * u[k + 9] + wz.z * u[k + 18];
    for (int oy = 0; oy < kCellY; ++oy) {
      const vec3 wy = weights(oy, kCellY);
      const vec3 left = wy.x * plane[0] + wy.y * plane[3] + wy.z * plane[6];
      const vec3 middle = wy.x * plane[1] + wy.y * plane[4] + wy.z * plane[7];
      const vec3 right = wy.x * plane[2] + wy.y * plane[5] + wy.z * plane[8];
      const int colour = push.cells.w;
      const int first = colour < 0 ? 0 : (begin.x + begin.y + oy + z + colour) & 1;
      for (int ox = first; ox < kCellX; ox += colour < 0 ? 1 : 2) {
        const vec3 wx = weights(ox, kCellX);
        const ivec3 x = ivec3(begin.xy + ivec2(ox, oy), z);
        const vec4 f = READ(fixed_image, ivec3(min(x.xy, push.fixed_size.xy - 1), z - push.fixed_size.w));
        const vec3 partner = vec3(x) + per_mm * (wx.x * left + wx.y * middle + wx.z * right);
        const vec3 at = vec3(partner.xy, partner.z - float(push.moving_size.w)) + 0.5;
        const vec4 m = textureLod(moving_image, at / vec3(moving_size.xy, float(push.moving_slab.x)), 0.0);
        const float floor_z = floor(partner.z);
        const bool counts = all(lessThan(x.xy, push.fixed_size.xy)) && abs(f.x) <= kLargestGradient &&
                            all(greaterThanEqual(partner, vec3(-0.5))) &&
                            all(lessThanEqual(partner, moving_size - 0.5)) && floor_z >= float(push.moving_slab.y) &&
                            floor_z < float(push.moving_slab.z);
        const float w = counts ? 1.0 : 0.0;
        const vec3 both = abs(m.x) <= kLargestGradient ? 0.5 * (f.xyz + m.xyz) : f.xyz;
        const vec3 g = counts ? both : vec3(0.0);
        const float r = counts ? f.w - m.w : 0.0;
        b += r * g;
        diagonal += g * g;
        mixed += g.xxy * g.yzz;
        residual += r * r;
        counted += w;
        structure += counts ? 0.5 * (f.w * f.w + m.w * m.w) : 0.0;
      }
    }
  }
  const float per_voxel = (push.cells.w < 0 ? 1.0 : 2.0) / float(kCellX * kCellY * kCellZ);
  vec4 e0 = per_voxel * vec4(b, diagonal.x);
  vec4 e1 = per_voxel * vec4(mixed.xy, diagonal.y, mixed.z);
  vec4 e2 = per_voxel * vec4(diagonal.z, residual, counted, structure);
  if (push.moving_slab.w != 0) {
    e0 += READ(so_far0, cell);
    e1 += READ(so_far1, cell);
    e2 += READ(so_far2, cell);
  }
  imageStore(equations0, cell, e0);
  imageStore(equations1, cell, e1);
  imageStore(equations2, cell, e2);
}
