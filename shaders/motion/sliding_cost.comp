#version 460
#extension GL_GOOGLE_include_directive : require
#include "include/read.glsl"
#include "interface/motion.h"
#include "include/bricks.glsl"
#include "include/sliding.glsl"
// How badly the intensities of the frames match if a cell has its own motion, or that of one of the candidates:
//   cost = mean over the cell's voxels of min(1, (a F(x) + b - M(x + v))^2 / limit^2)
//   a = (E[F M] - E[F] E[M] + f^2) / (E[F^2] - E[F]^2 + f^2),  b = E[M] - a E[F]             (the local gain)
// v is the motion of the candidate's cell. Intensities are not locally normalised: with a normalisation window that
// covers both sides of a sliding border, each side matches better if it is moved along with the other.
//
// binding  direction  format                          shape            unit
// 0        in         uint                            bricks listed    packed brick coordinates
// 1        in         any, one channel: F             image (z, y, x)  scaled intensity
// 2        in         any, one channel: M             image            scaled intensity
// 3        in         rgba32f: u                      cells (z, y, x)  mm along the image axes
// 4        in         rgba32f: E[F] E[M] E[F^2] E[FM] coarser cells    see sliding_moments.comp, smoothed
// 5        in         rgba: gx . . .                  image            gx: infinite outside the mask
// 6        out        rgba: cost                      cells            1; of candidates first .. first + 3, or of the
//                                                                      cell's own motion in all four where first < 0
//
// Where costs are not summed over neighbours (kAlone), a cell without a candidate across a border (sliding.glsl) needs
// no cost and has 0.
//
// One invocation: one cell, which moves as a whole. Border: a voxel outside the mask, or whose own partner lies more
// than half a voxel outside the image, costs 0 for every candidate; a candidate's partner outside costs 1. Cells
// outside the field: clamped to the edge. Precision: fp32. Race: each output written once. CPU oracle:
// oracle::sliding_cost.
TEXELS(1, fixed_image, r16f);
layout(set = 0, binding = 2) uniform sampler3D moving_image;
TEXELS(3, field, rgba32f);
layout(set = 0, binding = 4) uniform sampler3D means;
TEXELS(5, packed_image, rgba16f);
layout(set = 0, binding = 6) uniform writeonly image3D costs;
layout(push_constant) uniform Push { SlidingCostPush push; };
layout(constant_id = 0) const int kOwn = 0;
layout(constant_id = 1) const int kAlone = 0;

// Whether any of the candidates that this dispatch compares lies across a border.
bool may_take(ivec3 cell) {
  const vec3 u = READ(field, cell).xyz;
  const vec3 cell_mm = push.spacing_mm.xyz * vec3(push.cell.xyz);
  const int first = max(push.step.w, 0);
  const int end = kOwn != 0 ? 6 * kSlidingSteps : first + 4;
  for (int c = first; c < end; ++c) {
    const ivec3 offset = candidate_offset(c, push.step.xyz);
    const ivec3 from = cell + offset;
    if (from != clamp(from, ivec3(0), push.cells.xyz - 1)) continue;
    if (across_border(u, READ(field, from).xyz, offset, cell_mm, push.different.xy)) return true;
  }
  return false;
}

bool inside(vec3 partner) {
  return all(greaterThanEqual(partner, vec3(-0.5))) && all(lessThanEqual(partner, vec3(push.size.xyz) - 0.5));
}

float unlike(float f, vec3 partner) {
  const float d = f - textureLod(moving_image, (partner + 0.5) / vec3(push.size.xyz), 0.0).r;
  return inside(partner) ? min(1.0, d * d * push.spacing_mm.w) : 1.0;
}

void main() {
  const ivec3 cell = brick_cell();
  if (beyond(cell, push.cells.xyz)) return;
  if (kAlone != 0 && !may_take(cell)) {
    imageStore(costs, cell, vec4(0.0));
    return;
  }
  const vec3 place = (vec3(cell) + 0.5) * vec3(push.cell.xyz) / vec3(push.coarse.xyz);
  const vec4 e = textureLod(means, place, 0.0);
  const float gain = (e.w - e.x * e.y + push.noise.x) / (max(e.z - e.x * e.x, 0.0) + push.noise.x);
  const float offset = e.y - gain * e.x;
  const vec3 per_mm = 1.0 / push.spacing_mm.xyz;
  const vec3 own = READ(field, cell).xyz * per_mm;
  vec3 v[4];
  if (kOwn == 0) {
    for (int c = 0; c < 4; ++c) {
      const ivec3 from = cell + candidate_offset(push.step.w + c, push.step.xyz);
      v[c] = READ(field, clamp(from, ivec3(0), push.cells.xyz - 1)).xyz * per_mm;
    }
  }
  const ivec3 begin = cell * push.cell.xyz;
  const ivec3 end = min(begin + push.cell.xyz, push.size.xyz);
  vec4 sum = vec4(0.0);
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const ivec3 at = ivec3(x, y, z);
        if (!inside(vec3(at) + own) || !(abs(READ(packed_image, at).x) <= kLargestGradient)) continue;
        const float f = gain * READ(fixed_image, at).r + offset;
        if (kOwn != 0) {
          sum += vec4(unlike(f, vec3(at) + own));
        } else {
          for (int c = 0; c < 4; ++c) sum[c] += unlike(f, vec3(at) + v[c]);
        }
      }
    }
  }
  imageStore(costs, cell, sum / float(push.cell.x * push.cell.y * push.cell.z));
}
