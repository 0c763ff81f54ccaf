#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The picture: front-to-back emission and absorption along a ray per pixel (Levoy 1988; Max 1995),
//   C += T (1 - exp(-sigma ds)) c,   T *= exp(-sigma ds),
// until T is below kStop, over the halves of segments between neighbouring samples. sigma and c are the means of
// extinction (1/mm) and lit colour over all values between those at the ends (pre-integrated classification, Engel et
// al. 2001, without the absorption inside):
//   sigma = (S(v1) - S(v0)) / (v1 - v0),  S the integral of the extinction over the values.
// So thin structures and steep transfer functions are not missed between samples. In a segment's middle the value is
// that of the cubic with the values and slopes of both ends (Hermite). Where the two halves in their order give another
// light than the whole segment at once, as at a surface, the segment is drawn anew in short ones, so that a surface does
// not show the pattern of samples. Tissue in between takes light away, as light.comp says. Samples lie at depths
// t = (k + jitter) dt that do not depend on skipping, so skipping changes no segment that shows anything, and both eyes
// have the same jitter at the same pixel. The first and the last segment are cut at the ends of the ray.
//
// binding  direction  format            shape                   unit
// 0        in         ViewParameters    1
// 1        in         vec4              2 kTable per volume     linear colour, extinction 1/mm; then
//                                                               integrals of extinction times colour
//                                                               and of extinction, over entries
// 2        in         uint              kSkipWords per brick    see brick.comp and distance.comp
// 3        in         uint              eyes x height x width   bits of the depth t of things, m; ~0 none
// 4        in         uint              the same                their colour, sRGB, and coverage, RGBA8
// 5        out        uint              the same                colour, sRGB, RGBA8
// 6        out        uint              the same                bits of near / depth, 0 without surface; with a
//                                                               backdrop a depth in its encoding
// 7        out        uint              2 per pixel             samples taken and needed (if kCount)
// 8..15    in         any rgba          volumes (z, y, x)       see brick.comp, carry.comp
// 16       in         uvec2             tiles of 8 x 8 pixels   bit x + 8 y: the pixel is visible (if kMasked)
// 17       in         uint              as 2                    the same buffer, read where kTexels is 0: the
//                                                               device has too few texels for it
// 18       in         uint              2 eyes x h x w          a host's picture: colours, encoded, RGBA8, then
//                                                               depths (if kBackdrop); rays end there
// 19       in         rg                cells (z, y, x)         how much light reaches a place, see light.comp
//                                                               (if kLit)
// 20       out        uvec4             eyes x half h x half w  see lattice.glsl (rays of the lattice)
// 21       in         uint              4 + pixels              see between.comp (rays of the list)
//
// kVolumes of the images are used. One invocation: one pixel of one eye. Border: a volume ends half a voxel beyond its
// outermost samples, values clamped to the edge. Precision: fp32. Race: each output written once. Tested against closed
// forms: tests/view/light_test.cpp (transmittance), surface_test.cpp (places).
//
// A CPU driver runs eight neighbouring pixels in step, executes both sides of every "if", and leaves a loop only at its
// end. A loop that is left by a test at its start runs through its body once more, for none of them. So loops are tested
// at their end, with their body in an "if" of a condition that may be false from the start. What is used after such a
// loop must be changed in that "if": what is changed outside of it goes on changing for pixels that have left the loop,
// as long as a neighbour is in it.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) uniform samplerBuffer tables;
layout(set = 0, binding = 2) uniform usamplerBuffer skips;
layout(set = 0, binding = 3) readonly buffer ThingDepth { uint thing_depth[]; };
layout(set = 0, binding = 4) readonly buffer ThingColour { uint thing_colour[]; };
layout(set = 0, binding = 5) writeonly buffer Colour { uint colour_out[]; };
layout(set = 0, binding = 6) writeonly buffer Depth { uint depth_out[]; };
layout(set = 0, binding = 7) writeonly buffer Samples { uint samples_out[]; };
layout(set = 0, binding = 8) uniform sampler3D volume0;
layout(set = 0, binding = 9) uniform sampler3D volume1;
layout(set = 0, binding = 10) uniform sampler3D volume2;
layout(set = 0, binding = 11) uniform sampler3D volume3;
layout(set = 0, binding = 12) uniform sampler3D volume4;
layout(set = 0, binding = 13) uniform sampler3D volume5;
layout(set = 0, binding = 14) uniform sampler3D volume6;
layout(set = 0, binding = 15) uniform sampler3D volume7;
layout(set = 0, binding = 16) readonly buffer Visible { uvec2 visible[]; };
layout(set = 0, binding = 17) readonly buffer SkipBuffer { uint skip_buffer[]; };
layout(set = 0, binding = 18) readonly buffer Backdrop { uint backdrop[]; };
layout(set = 0, binding = 19) uniform sampler3D light_grid;
layout(constant_id = 0) const int kVolumes = 1;
layout(constant_id = 1) const int kThings = 1;
layout(constant_id = 2) const int kSkip = 1;
layout(constant_id = 3) const int kCount = 0;
layout(constant_id = 4) const int kMasked = 0;
layout(constant_id = 5) const int kTexels = 1;
layout(constant_id = 6) const int kBackdrop = 0;  // see backdrop.glsl
layout(constant_id = 7) const int kLit = 0;  // the light grid is read
layout(constant_id = 8) const int kRefines = 1;  // segments are halved, and drawn anew where that matters
layout(set = 0, binding = 20) writeonly buffer Lattice { uvec4 lattice[]; };
layout(set = 0, binding = 21) readonly buffer List { uint list[]; };
// Not a constant: the kernel would be compiled three times.
layout(push_constant) uniform Push { RaycastPush push; };

#include "include/classified.glsl"
#include "include/srgb.glsl"
#include "include/backdrop.glsl"
#include "include/lattice.glsl"
#include "include/visible.glsl"

const float kStop = 1.0 / 256.0;
const float kAlbedo = 0.4;  // share of its colour that tissue sends on
const float kNeeded = 0.01;
// A segment is drawn anew in so many parts if the order of its values changes its light by more than this. With half a
// sample per voxel nine real volumes and the heart phantom have 47 to 56 dB against eight samples per voxel.
const float kFineError = 0.002;
const int kFineParts = 4;
const vec3 kBrightness = vec3(0.3, 0.5, 0.2);  // weights of red, green and blue

// The ray in each volume's voxels, and the depths between which it is inside.
vec3 start[kVolumes];
vec3 way[kVolumes];
vec3 per_way[kVolumes];
float enters[kVolumes];
float leaves[kVolumes];
float mm_per_t[kVolumes];
vec3 entries_way[kVolumes];  // change of the value's entry per t, for a slope of 1 along each axis
vec3 towards_eye[kVolumes];
vec3 halfway[kVolumes];
// The ray in cells of the light grid, and the depth that one cell takes.
vec3 light_start;
vec3 light_way;
float light_apart;

vec4 texel(int v, vec3 at) {
  if (v == 0) return textureLod(volume0, at, 0.0);
  if (v == 1) return textureLod(volume1, at, 0.0);
  if (v == 2) return textureLod(volume2, at, 0.0);
  if (v == 3) return textureLod(volume3, at, 0.0);
  if (v == 4) return textureLod(volume4, at, 0.0);
  if (v == 5) return textureLod(volume5, at, 0.0);
  if (v == 6) return textureLod(volume6, at, 0.0);
  return textureLod(volume7, at, 0.0);
}

// Whether the volume can show anything at t, whether it is thin there, and up to which depth both hold. A solid brick
// counts as showing something everywhere: soft ones may have empty cells.
bool occupied(int v, float t, out float end, out bool thin) {
  const ivec3 voxel = clamp(ivec3(start[v] + t * way[v]), ivec3(0), ivec3(view.volumes[v].size.xyz) - 1);
  const ivec3 brick = voxel >> 3;
  const uint word = skip_word(v, brick);
  const uint head = skip(word);
  const ivec3 block = voxel >> 1 & 3, cell = voxel & 7;
  const uint block_word = word + uint(block.z >> 1);
  const uint block_bit = uint(block.x + 4 * block.y + 16 * (block.z & 1));
  const bool any_cell = (skip(block_word + uint(kBlockWord)) >> block_bit & 1u) != 0u;
  const bool every_cell = (skip(block_word + uint(kFullBlockWord)) >> block_bit & 1u) != 0u;
  const uint row = skip(word + uint(kCellWord + 2 * cell.z + (cell.y >> 2)));
  const bool shows = (row >> uint(cell.x + 8 * (cell.y & 3)) & 1u) != 0u;
  // The box in which this holds: the bricks around an empty, solid or thin one, a block, or a cell.
  const int apart = int(head & 0xffu), solid = int(head >> 8 & 0xffu), not_thin = int(head >> 16);
  const bool whole = (apart | solid | not_thin) > 0;
  // For thin bricks one less: a segment that ends beyond them must end in a brick that was computed.
  const int reach = max(apart > 0 ? apart : max(solid, not_thin - 1), 1);
  const int edge = any_cell && !every_cell ? 1 : 2;
  const ivec3 part = voxel & ~(edge - 1);
  const ivec3 low = whole ? (brick - reach + 1) << 3 : part;
  const ivec3 high = whole ? (brick + reach) << 3 : part + edge;
  thin = not_thin > 0;
  const vec3 border = mix(vec3(low), vec3(high), greaterThan(way[v], vec3(0.0)));
  const vec3 exits = (border - start[v]) * per_way[v];
  end = min(min(exits.x, exits.y), exits.z);
  const bool before = t < enters[v], after = t >= leaves[v];
  if (before) end = enters[v];
  if (after) end = kFar;
  thin = thin || before || after;
  return (shows || solid > 0 || not_thin > 0 && apart == 0) && !before && !after;
}

void set_out(int v, int eye, vec2 pixel) {
  const ViewRays rays = view.volumes[v].rays[eye];
  start[v] = rays.origin.xyz;
  way[v] = rays.first.xyz + pixel.x * rays.right.xyz + pixel.y * rays.down.xyz;
  // Never 0, which would give 0 / 0 at a border.
  way[v] = mix(way[v], vec3(1e-12), lessThan(abs(way[v]), vec3(1e-12)));
  per_way[v] = 1.0 / way[v];
  const vec3 a = (-0.5 - start[v]) * per_way[v];
  const vec3 b = (view.volumes[v].size.xyz - 0.5 - start[v]) * per_way[v];
  const vec3 low = min(a, b), high = max(a, b);
  enters[v] = max(max(low.x, low.y), low.z);
  leaves[v] = min(min(high.x, high.y), high.z);
  const vec3 mm = way[v] * view.volumes[v].spacing_mm.xyz;
  mm_per_t[v] = length(mm);
  entries_way[v] = view.volumes[v].table.x * mm;
  towards_eye[v] = -mm / mm_per_t[v];
  halfway[v] = normalize(towards_eye[v] + view.volumes[v].light.xyz);
}

// How a part of a volume is lit.
struct Shade {
  float left, all;  // the light with, and without what tissue in between keeps away
  float gloss;      // what is added to the colour
  float kept;       // share of the extinction that stays
};

// A volume at a depth.
struct Sample {
  vec3 slope;
  float entry;  // of the table: its value
  vec4 up_to;   // the integrals up to that entry
  Shade shade;
};

// How much of the light of all directions, and of the direct light, reaches the ray at t. It is read where the ray is
// one cell closer to the eye: in front of a surface, not half inside.
vec2 light_at(float t) {
  const vec3 cell = light_start + (t - light_apart) * light_way;
  const vec2 read = textureLod(light_grid, (cell + 0.5) / view.light_cells.xyz, 0.0).xy;
  return 1.0 - view.light_cells.w * (1.0 - read);
}

// How a volume is lit where it has this slope. reached: see light_at().
Shade shade_of(int v, vec3 slope, vec2 reached) {
  const vec3 stretched = slope * view.volumes[v].stretch.xyz;
  const float square = dot(stretched, stretched);
  const float surface = surface_of(v, square);
  const vec3 normal = stretched * inversesqrt(max(square, 1e-20));
  const float side = dot(normal, towards_eye[v]) > 0.0 ? 1.0 : -1.0;
  const float diffuse = max(0.3 + 0.7 * side * dot(normal, view.volumes[v].light.xyz), 0.0);
  float shine = max(side * dot(normal, halfway[v]), 0.0);
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  const vec4 how = view.volumes[v].shine;
  const float direct = how.y * diffuse;
  return Shade(mix(0.5 * (reached.x + reached.y), how.x * reached.x + direct * reached.y, surface),
               mix(1.0, how.x + direct, surface), how.z * shine * surface * reached.x * reached.y, kept_of(v, surface));
}

// share: 0 is the first one, 1 the other.
Shade between(Shade one, Shade other, float share) {
  return Shade(mix(one.left, other.left, share), mix(one.all, other.all, share), mix(one.gloss, other.gloss, share),
               mix(one.kept, other.kept, share));
}

Sample sampled(int v, float t, vec2 reached) {
  const vec3 voxel = start[v] + t * way[v];
  const vec4 read = classified(v, texel(v, (voxel + 0.5) / view.volumes[v].size.xyz), voxel);
  return Sample(read.xyz, read.w, integral(v, read.w), shade_of(v, read.xyz, reached));
}

// What tissue of this colour times extinction sends on of the light that it keeps from what lies behind it. It sends on a
// part, in its own colour, and keeps a part of that away, and so on. Two times are enough to see:
//   v + v a (1 - v) + v (a (1 - v))^2.
// So shadows in red tissue are red.
vec3 sent_on(vec4 glow, Shade shade) {
  if (kLit == 0) return vec3(1.0);
  // Beside a film both parts of the colour's quotient are rounding errors of the table's integrals: it is kept below 1.
  const vec3 colour = min(glow.rgb / max(glow.w, 1e-20), 1.0);
  const vec3 again = clamp(1.0 - shade.left / max(shade.all, 1e-6), 0.0, 1.0) * kAlbedo * colour;
  return 1.0 + again * (1.0 + again);
}

// Lit colour times extinction, and extinction, from colour times extinction.
vec4 lit(vec4 glow, Shade shade, vec3 tint) {
  return shade.kept * vec4(glow.rgb * shade.left * tint + glow.w * shade.gloss, glow.w);
}

// Interleaved gradient noise (Jimenez 2014): differs between neighbours, constant in time.
float jitter_of(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// The part of the ray in front of the eye and on the kept side of all planes, as depths t.
void find_kept(ivec2 pixel, int eye, out float first, out float last) {
  const ViewRays world = view.rays[eye];
  const vec3 direction = world.first.xyz + float(pixel.x) * world.right.xyz + float(pixel.y) * world.down.xyz;
  first = view.background.w;
  last = kFar;
  for (int p = 0; p < view.counts.y; ++p) {
    const float ahead = dot(view.planes[p].xyz, direction);
    const float here = dot(view.planes[p].xyz, world.origin.xyz) - view.planes[p].w;
    const float crossing = -here / (abs(ahead) > 1e-9 ? ahead : 1e-9);
    if (ahead > 1e-9) first = max(first, crossing);
    if (ahead < -1e-9) last = min(last, crossing);
    if (abs(ahead) <= 1e-9 && here < 0.0) last = -kFar;
  }
}

// Sets the ray up in all volumes: where the first begins and the last ends, and dt, the smallest of their steps.
void set_out_in_all(ivec2 pixel, int eye, float first, float last, out float dt, out float begin, out float finish) {
  dt = kFar;
  begin = kFar;
  finish = -kFar;
  const ViewRays light = view.light_rays[eye];
  light_start = light.origin.xyz;
  light_way = light.first.xyz + float(pixel.x) * light.right.xyz + float(pixel.y) * light.down.xyz;
  light_apart = kLit != 0 ? inversesqrt(dot(light_way, light_way)) : 0.0;
  for (int v = 0; v < kVolumes; ++v) {
    set_out(v, eye, vec2(pixel));
    enters[v] = max(enters[v], first);
    leaves[v] = min(leaves[v], last);
    dt = min(dt, 1.0 / (mm_per_t[v] * view.volumes[v].spacing_mm.w));
    if (enters[v] < leaves[v]) {
      begin = min(begin, enters[v]);
      finish = max(finish, leaves[v]);
    } else {
      enters[v] = kFar;
      leaves[v] = kFar;
    }
  }
}

// The depth t of the thing in this pixel; kFar without one, or if it lies behind the backdrop.
float thing_depth_at(uint out_index, float back_at, out vec4 thing) {
  thing = vec4(0.0);
  float thing_at = kFar;
  if (kThings != 0) {
    const uint depth_bits = thing_depth[out_index];
    if (depth_bits != ~0u && (kBackdrop == 0 || uintBitsToFloat(depth_bits) < back_at)) {
      thing_at = uintBitsToFloat(depth_bits);
      thing = unpackUnorm4x8(thing_colour[out_index]);
    }
  }
  return thing_at;
}

// The light that reaches the eye.
struct Light {
  vec3 colour;
  float through;  // transmittance so far
  float depth;  // near / t, t where the transmittance is 1/2; 0 if it stays above
  uint taken, needed;  // samples
};

// Moves t forward to where any volume may show something, at most to `to`; k is the sample at or before t. Returns
// whether there is anything; `end`: the depth up to which this and all_thin hold.
bool find_shown(float to, float dt, float jitter, inout float t, inout float k, out float end, out bool all_thin) {
  end = to;
  bool any_shows = kSkip == 0;
  all_thin = kSkip != 0;
  // Neighbouring pixels wait for each other here, so that they take their samples together.
  bool searches = !any_shows && t < to;
  do {
    if (searches) {
      end = to;
      all_thin = true;
      for (int v = 0; v < kVolumes; ++v) {
        float until;
        bool thin;
        any_shows = occupied(v, t, until, thin) || any_shows;
        all_thin = all_thin && thin;
        end = min(end, until);
      }
      // A little beyond the border, so that rounding does not find the same box again; far away this is less than the
      // distance of two floats.
      if (!any_shows) {
        const float at = max(end, t);
        t = max(at + 1e-3 * dt, uintBitsToFloat(floatBitsToUint(at) + 1u));
        k = max(k, floor(t / dt - jitter));
      }
      searches = !any_shows && t < to;
    }
  } while (searches);
  return any_shows;
}

// A segment between two samples: colour times extinction, and extinction, per t of all volumes.
struct Segment {
  vec4 halves[2];
  // Brightness times extinction without shadows, which must not decide where samples are taken.
  float plain[2];
  vec2 whole;  // the same, and extinction, as if all its values lay everywhere in it
};

// In between the value is the cubic with the values and slopes of both samples (Hermite).
Segment segment(float lower, float upper, Sample before[kVolumes], out Sample after[kVolumes]) {
  Segment all = Segment(vec4[2](vec4(0.0), vec4(0.0)), float[2](0.0, 0.0), vec2(0.0));
  const vec2 reached = kLit != 0 ? light_at(upper) : vec2(1.0);
  for (int v = 0; v < kVolumes; ++v) {
    const Sample one = before[v], other = sampled(v, upper, reached);
    after[v] = other;
    // With several volumes: the part of the segment that lies inside this one.
    float share = mm_per_t[v];
    if (kVolumes > 1)
      share *= max(min(upper, leaves[v]) - max(lower, enters[v]), 0.0) / max(upper - lower, 1e-12);
    const float bend = kRefines != 0 ? dot(one.slope - other.slope, entries_way[v]) : 0.0;
    const float middle = 0.5 * (one.entry + other.entry) + 0.125 * (upper - lower) * bend;
    const float entry = clamp(middle, 0.5, float(kTable) - 0.5);
    const vec4 near = glow_of(v, entry);
    const vec4 glow = mean_between(one.entry, other.entry, one.up_to, other.up_to, near);
    const Shade shade = between(one.shade, other.shade, 0.5);
    const vec3 tint = sent_on(glow, shade);
    if (kRefines == 0) {
      all.halves[0] += share * lit(glow, shade, tint);
      continue;
    }
    all.whole += share * shade.kept * vec2(shade.all * dot(glow.rgb, kBrightness), glow.w);
    const vec4 up_to = integral(v, entry);
    for (int h = 0; h < 2; ++h) {
      const Shade its = between(one.shade, other.shade, h == 0 ? 0.25 : 0.75);
      const vec4 its_glow = h == 0 ? mean_between(one.entry, entry, one.up_to, up_to, near)
                                   : mean_between(entry, other.entry, up_to, other.up_to, near);
      all.halves[h] += share * lit(its_glow, its, tint);
      all.plain[h] += share * its.kept * its.all * dot(its_glow.rgb, kBrightness);
    }
  }
  return all;
}

// The equation at the top of this file, for a part of the ray that is `apart` long: its light; w: what passes it.
vec4 light_of(vec4 glow, float apart) {
  const float passes = exp(-glow.w * apart);
  return vec4((1.0 - passes) / max(glow.w, 1e-20) * glow.rgb, passes);
}

// Adds a segment's halves, unless the order of its values changes the light by more than kFineError and it may be drawn
// anew; returns whether that is so.
bool pass(float lower, float upper, Segment part, bool may_again, inout Light light) {
  // One half is all where they are not told apart.
  const float half_way = (kRefines != 0 ? 0.5 : 1.0) * (upper - lower);
  const vec4 first = light_of(part.halves[0], half_way), second = light_of(part.halves[1], half_way);
  const vec4 both = vec4(first.rgb + first.w * second.rgb, first.w * second.w);
  // Its error: the difference that the order of its values makes, without shadows.
  const float plain_first = (1.0 - first.w) / max(part.halves[0].w, 1e-20) * part.plain[0];
  const float plain_second = (1.0 - second.w) / max(part.halves[1].w, 1e-20) * part.plain[1];
  const float passes = exp(-part.whole.y * (upper - lower));
  const float plain = (1.0 - passes) / max(part.whole.y, 1e-20) * part.whole.x;
  const float off = max(abs(plain_first + first.w * plain_second - plain), abs(both.w - passes));
  const bool again = kRefines != 0 && may_again && light.through * off > kFineError;
  if (kCount != 0) {
    light.taken += uint(kVolumes);
    light.needed += part.halves[0].w + part.halves[1].w > 0.0 && light.through > kNeeded ? uint(kVolumes) : 0u;
  }
  const float left = light.through;
  light.colour += again ? vec3(0.0) : left * both.rgb;
  light.through *= again ? 1.0 : both.w;
  // The depth in the segment at which the transmittance is 1/2.
  if (left > 0.5 && light.through <= 0.5) {
    const float at_half = left * first.w;
    const bool in_first = at_half <= 0.5;
    const float sigma = in_first ? part.halves[0].w : part.halves[1].w;
    const float begins = in_first ? lower : lower + half_way;
    light.depth = view.background.w / (begins + log(2.0 * (in_first ? left : at_half)) / max(sigma, 1e-20));
  }
  return again;
}

// All segments from one depth to another.
void march(float from, float to, float dt, float jitter, inout Light light) {
  float done = -kFar;
  Sample last[kVolumes];
  // The next search begins at t; k is the sample at or before t.
  float t = from, k = floor(from / dt - jitter);
  // Up to fine_to segments are short, and sample k is the next one.
  float fine_to = -kFar, fine_step = 0.0;
  do {
    float end;
    bool all_thin;
    const bool any_shows = find_shown(to, dt, jitter, t, k, end, all_thin);
    float lower = max(max((k + jitter) * dt, from), done);
    bool goes_on = any_shows && t < to && light.through > kStop;
    Sample before[kVolumes];
    // The first segment of a run has two ends and needs one more sample. It is already there if the last run ended
    // here.
    if (goes_on && lower != done) {
      const vec2 reached = kLit != 0 ? light_at(lower) : vec2(1.0);
      for (int v = 0; v < kVolumes; ++v) last[v] = sampled(v, lower, reached);
      light.taken += kCount != 0 ? uint(kVolumes) : 0u;
    }
    for (int v = 0; v < kVolumes; ++v) before[v] = last[v];
    do {
      if (goes_on) {
        // Where all volumes are thin, one segment is kStride steps long.
        const bool fine = lower < fine_to;
        const bool strides = !fine && all_thin && (k + float(kStride) + jitter) * dt < end;
        k += fine ? 0.0 : strides ? float(kStride) : 1.0;
        const float next = fine ? fine_to : min((k + jitter) * dt, to);
        const float upper = fine && lower + 1.5 * fine_step < next ? lower + fine_step : next;
        Sample after[kVolumes];
        const Segment part = segment(lower, upper, before, after);
        const bool again = pass(lower, upper, part, !fine && upper - lower > 0.2 * dt, light);
        fine_to = again ? upper : fine_to;
        fine_step = again ? (upper - lower) / float(kFineParts) : fine_step;
        if (!again)
          for (int v = 0; v < kVolumes; ++v) before[v] = after[v];
        lower = again ? lower : upper;
        t = lower;
        goes_on = (t < end || t < fine_to) && light.through > kStop;
      }
    } while (goes_on);
    for (int v = 0; v < kVolumes; ++v) last[v] = before[v];
    done = any_shows ? lower : done;
  } while (t < to && light.through > kStop);
}

// Blends the light over what lies behind it: the background, or the host's picture.
void write(ivec2 pixel, int eye, uint out_index, Light light, bool is_cut, uint back_word) {
  // The rest of a ray that was stopped early is taken to be like the part before.
  if (light.through <= kStop) {
    light.colour /= 1.0 - light.through;
    light.through = 0.0;
  }
  vec3 shown;
  if (kBackdrop == 0) {
    const float down = clamp(view.rays[eye].first.w + float(pixel.y) * view.rays[eye].down.w, 0.0, 1.0);
    shown = encoded(light.colour + light.through * mix(view.background.rgb, view.background_low.rgb, down));
    colour_out[out_index] = packUnorm4x8(vec4(shown, 1.0 - light.through));
    depth_out[out_index] = floatBitsToUint(light.depth);
  } else {
    write_over(out_index, light.colour, light.through, light.depth, back_word);
    if (push.rays.x == kRaysOfLattice) shown = encoded(light.colour);
  }
  if (push.rays.x == kRaysOfLattice) lattice[point_place(pixel / 2, eye)] = packed_point(vec4(shown, light.through), light.depth, is_cut);
  if (kCount != 0) {
    samples_out[2u * out_index] = light.taken;
    samples_out[2u * out_index + 1u] = light.needed;
  }
}

void draw(ivec2 pixel, int eye, ivec2 size, uint out_index) {
  float first, last, dt, begin, finish;
  find_kept(pixel, eye, first, last);
  set_out_in_all(pixel, eye, first, last, dt, begin, finish);
  uint back_word;
  const float back_at = backdrop_depth(size, out_index, back_word);
  finish = min(finish, back_at);
  vec4 thing;
  const float thing_at = thing_depth_at(out_index, back_at, thing);

  const float jitter = fract(jitter_of(vec2(pixel)) + view.light.w);
  Light light = Light(vec3(0.0), 1.0, 0.0, 0u, 0u);
  // First in front of the thing; then, where its edge covers only part of the pixel, behind it.
  float from = begin;
  const int parts = kThings != 0 && thing_at < kFar ? 2 : 1;
  int part = 0;
  bool goes_on = begin < finish || thing_at < kFar;
  do {
    if (goes_on) {
      march(from, parts == 2 && part == 0 ? min(thing_at, finish) : finish, dt, jitter, light);
      if (parts == 2 && part == 0) {
        const float before = light.through;
        light.colour += light.through * thing.a * decoded(thing.rgb);
        light.through *= 1.0 - thing.a;
        if (before > 0.5 && light.through <= 0.5) light.depth = view.background.w / thing_at;
        from = max(thing_at, begin);
      }
    }
    ++part;
    goes_on = part < parts && light.through > kStop;
  } while (goes_on);
  write(pixel, eye, out_index, light, thing_at < kFar || back_at < view.background_low.w, back_word);
}

// The pixel and eye of an invocation; false if there is none.
bool find_pixel(out ivec2 pixel, out int eye) {
  if (push.rays.x == kRaysOfList) {
    const uint place = gl_LocalInvocationIndex + 64u * (gl_WorkGroupID.x + uint(kMostListGroups) * gl_WorkGroupID.y);
    const uint item = place < list[3] ? list[4u + place] : 0u;
    pixel = pixel_of_item(item);
    eye = eye_of_item(item);
    return place < list[3];
  }
  const uint l = gl_LocalInvocationIndex;
  pixel = ivec2(8u * gl_WorkGroupID.xy) + ivec2(l & 3u | l >> 1 & 4u, l >> 2 & 1u | l >> 3 & 6u);
  if (push.rays.x == kRaysOfLattice) pixel *= 2;
  eye = int(gl_WorkGroupID.z);
  return all(lessThan(pixel, view.counts.zw));
}

void main() {
  ivec2 pixel;
  int eye;
  if (!find_pixel(pixel, eye)) return;
  const ivec2 size = view.counts.zw;
  const uint out_index = uint(pixel.x + size.x * (pixel.y + size.y * eye));
  if (kMasked == 0) {
    draw(pixel, eye, size, out_index);
    return;
  }
  const bool is_here = is_visible(pixel, eye, size);
  if (!is_here) {
    colour_out[out_index] = 0u;
    depth_out[out_index] = 0u;
    if (push.rays.x == kRaysOfLattice) lattice[point_place(pixel / 2, eye)] = packed_point(vec4(0.0), 0.0, true);
    if (kCount != 0) {
      samples_out[2u * out_index] = 0u;
      samples_out[2u * out_index + 1u] = 0u;
    }
  }
  if (is_here) draw(pixel, eye, size, out_index);
}
