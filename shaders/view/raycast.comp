#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The picture: front-to-back emission and absorption along a ray per pixel (Levoy 1988; Max 1995),
//   C += T (1 - exp(-sigma ds)) c,   T *= exp(-sigma ds),
// until T is below kStop, over segments between neighbouring samples. sigma and c are the means of
// extinction (1/mm) and lit colour over all values between those of the two samples (pre-integrated
// classification, Engel et al. 2001, without the absorption inside the segment):
//   sigma = (S(v1) - S(v0)) / (v1 - v0),  S the integral of the extinction over the values.
// So thin structures and steep transfer functions are not missed between samples, and surfaces do not show the pattern
// of samples. Tissue in between takes light away, as light.comp says. Samples lie at depths t = (k + jitter) dt that do not depend on skipping, so skipping changes no segment
// that shows anything, and both eyes have the same jitter at the same pixel. The first and the last segment are cut at
// the ends of the ray.
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
//
// kVolumes of the images are used. One invocation: one pixel of one eye. Border: a volume ends half a voxel beyond its
// outermost samples, values clamped to the edge. Precision: fp32. Race: each output written once. Tested against closed
// forms: tests/view/light_test.cpp (transmittance), surface_test.cpp (places).
//
// A CPU driver runs eight neighbouring pixels in step and executes both sides of every "if", but leaves a loop when no
// pixel needs it. So code that is rarely needed is written as a loop that runs at most once.
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
// Bits. 1: there is one; 2: red and blue are swapped in it, and in the output; 4: its depths are 24-bit integers, not
// floats; 8: it has depths.
layout(constant_id = 6) const int kBackdrop = 0;
layout(constant_id = 7) const int kLit = 0;  // the light grid is read

#include "include/classified.glsl"

const float kStop = 1.0 / 256.0;
const float kAlbedo = 0.4;  // share of its colour that tissue sends on
const float kNeeded = 0.01;
const float kFar = 1e30;

// The ray in each volume's voxels, and the depths between which it is inside.
vec3 start[kVolumes];
vec3 way[kVolumes];
vec3 per_way[kVolumes];
float enters[kVolumes];
float leaves[kVolumes];
float mm_per_t[kVolumes];
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
  towards_eye[v] = -mm / mm_per_t[v];
  halfway[v] = normalize(towards_eye[v] + view.volumes[v].light.xyz);
}

// A sample: its slope, and its value as an entry of the table.
vec4 sampled(int v, float t) {
  const vec3 voxel = start[v] + t * way[v];
  return classified(v, texel(v, (voxel + 0.5) / view.volumes[v].size.xyz), voxel);
}

// Lit colour times extinction, and extinction, of one volume between two samples. reached: see light_at().
vec4 lit(int v, vec4 one, vec4 other, vec2 reached) {
  const vec4 glow = mean_between(v, one.w, other.w);
  const vec3 slope = (one.xyz + other.xyz) * view.volumes[v].stretch.xyz;
  const float square = dot(slope, slope);
  const float surface = surface_of(v, 0.25 * square);
  const vec3 normal = slope * inversesqrt(max(square, 1e-20));
  const float side = dot(normal, towards_eye[v]) > 0.0 ? 1.0 : -1.0;
  const float diffuse = max(0.3 + 0.7 * side * dot(normal, view.volumes[v].light.xyz), 0.0);
  float shine = max(side * dot(normal, halfway[v]), 0.0);
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  const vec4 how = view.volumes[v].shine;
  // The light with, and without what tissue in between keeps away.
  const float direct = how.y * diffuse;
  const float left = mix(0.5 * (reached.x + reached.y), how.x * reached.x + direct * reached.y, surface);
  const float all = mix(1.0, how.x + direct, surface);
  vec3 light = vec3(left);
  if (kLit != 0) {
    // That tissue sends a part on, in its own colour, and keeps a part of that away, and so on; two times are enough to
    // see: v + v a (1 - v) + v (a (1 - v))^2. So shadows in red tissue are red.
    // Beside a film both parts of the colour's quotient are rounding errors of the table's integrals: it is kept below 1.
    const vec3 colour = min(glow.rgb / max(glow.w, 1e-20), 1.0);
    const vec3 again = clamp(1.0 - left / max(all, 1e-6), 0.0, 1.0) * kAlbedo * colour;
    light *= 1.0 + again * (1.0 + again);
  }
  const float gloss = how.z * shine * surface * reached.x * reached.y;
  return kept_of(v, surface) * vec4(glow.rgb * light + glow.w * gloss, glow.w);
}

// How much of the light of all directions, and of the direct light, reaches the ray at t. It is read where the ray is
// one cell closer to the eye: in front of a surface, not half inside.
vec2 light_at(float t) {
  const vec3 cell = light_start + (t - light_apart) * light_way;
  const vec2 read = textureLod(light_grid, (cell + 0.5) / view.light_cells.xyz, 0.0).xy;
  return 1.0 - view.light_cells.w * (1.0 - read);
}

vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}
vec3 decoded(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
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

// The depth t of the backdrop; back_word: the same in the host's encoding.
float backdrop_depth(ivec2 size, uint out_index, out uint back_word) {
  back_word = 0u;
  float back_at = kFar;
  if ((kBackdrop & 8) != 0) {
    back_word = backdrop[uint(view.counts.x * size.x * size.y) + out_index];
    const float d = (kBackdrop & 4) != 0 ? float(back_word & 0xffffffu) / 16777215.0 : uintBitsToFloat(back_word);
    const float inverse = view.backdrop.x + view.backdrop.y * d;
    if (inverse > 1e-9) back_at = 1.0 / inverse;
  }
  return back_at;
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
  while (!any_shows && t < to) {
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
  }
  return any_shows;
}

// Extinction, and colour times extinction, per t of all volumes between two depths. before: in, the samples at the
// lower depth; out, those at the upper one.
float segment(float lower, float upper, vec2 reached, inout vec4 before[kVolumes], out vec3 glow) {
  float sigma = 0.0;
  glow = vec3(0.0);
  for (int v = 0; v < kVolumes; ++v) {
    const vec4 after = sampled(v, upper);
    vec4 found = lit(v, before[v], after, reached);
    // With several volumes: the part of the segment that lies inside this one.
    float share = 1.0;
    if (kVolumes > 1)
      share = max(min(upper, leaves[v]) - max(lower, enters[v]), 0.0) / max(upper - lower, 1e-12);
    found *= share * mm_per_t[v];
    sigma += found.w;
    glow += found.rgb;
    before[v] = after;
  }
  return sigma;
}

// The equation at the top of this file, for one segment.
void pass(float lower, float upper, float sigma, vec3 glow, inout Light light) {
  const float passes = exp(-sigma * (upper - lower));
  if (kCount != 0) {
    light.taken += uint(kVolumes);
    light.needed += sigma > 0.0 && light.through > kNeeded ? uint(kVolumes) : 0u;
  }
  const float left = light.through;
  light.colour += light.through * (1.0 - passes) / max(sigma, 1e-20) * glow;
  light.through *= passes;
  // The depth in the segment at which the transmittance is 1/2.
  if (left > 0.5 && light.through <= 0.5)
    light.depth = view.background.w / (lower + log(2.0 * left) / max(sigma, 1e-20));
}

// All segments from one depth to another.
void march(float from, float to, float dt, float jitter, inout Light light) {
  float done = -kFar;
  vec4 last_sample[kVolumes];
  // The next search begins at t; k is the sample at or before t.
  float t = from, k = floor(from / dt - jitter);
  while (t < to && light.through > kStop) {
    float end;
    bool all_thin;
    const bool any_shows = find_shown(to, dt, jitter, t, k, end, all_thin);
    float lower = max(max((k + jitter) * dt, from), done);
    bool goes_on = any_shows && t < to;
    vec4 before[kVolumes];
    // The first segment of a run has two ends and needs one more sample. It is already there if the last run ended
    // here.
    for (bool fresh = goes_on && lower != done; fresh; fresh = false) {
      for (int v = 0; v < kVolumes; ++v) last_sample[v] = sampled(v, lower);
      light.taken += kCount != 0 ? uint(kVolumes) : 0u;
    }
    for (int v = 0; v < kVolumes; ++v) before[v] = last_sample[v];
    while (goes_on) {
      // Where all volumes are thin, one segment is kStride steps long.
      const bool strides = all_thin && (k + float(kStride) + jitter) * dt < end;
      k += strides ? float(kStride) : 1.0;
      const float upper = min((k + jitter) * dt, to);
      const vec2 reached = kLit != 0 ? light_at(lower) : vec2(1.0);
      vec3 glow;
      const float sigma = segment(lower, upper, reached, before, glow);
      pass(lower, upper, sigma, glow, light);
      lower = upper;
      t = upper;
      goes_on = t < end && light.through > kStop;
    }
    for (int v = 0; v < kVolumes; ++v) last_sample[v] = before[v];
    done = any_shows ? lower : done;
  }
}

// Blends the light over what lies behind it: the background, or the host's picture.
void write(ivec2 pixel, int eye, uint out_index, Light light, uint back_word) {
  // The rest of a ray that was stopped early is taken to be like the part before.
  if (light.through <= kStop) {
    light.colour /= 1.0 - light.through;
    light.through = 0.0;
  }
  if (kBackdrop == 0) {
    const float down = clamp(view.rays[eye].first.w + float(pixel.y) * view.rays[eye].down.w, 0.0, 1.0);
    light.colour += light.through * mix(view.background.rgb, view.background_low.rgb, down);
    colour_out[out_index] = packUnorm4x8(vec4(encoded(light.colour), 1.0 - light.through));
    depth_out[out_index] = floatBitsToUint(light.depth);
  } else {
    // Where no light is absorbed the host's bytes stay unchanged.
    const vec4 back = unpackUnorm4x8(backdrop[out_index]);
    const bool swapped = (kBackdrop & 2) != 0;
    const vec3 over = encoded(light.colour + light.through * decoded(swapped ? back.bgr : back.rgb));
    const vec4 mixed = vec4(swapped ? over.bgr : over, mix(1.0, back.a, light.through));
    colour_out[out_index] = light.through == 1.0 ? backdrop[out_index] : packUnorm4x8(mixed);
    // In the backdrop's encoding; its own depth where no volume takes half of the light.
    const float d = clamp((light.depth / view.background.w - view.backdrop.x) / view.backdrop.y, 0.0, 1.0);
    const uint word = (kBackdrop & 4) != 0 ? uint(d * 16777215.0 + 0.5) : floatBitsToUint(d);
    depth_out[out_index] = light.depth > 0.0 ? word : back_word;
  }
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

  const float jitter = jitter_of(vec2(pixel));
  Light light = Light(vec3(0.0), 1.0, 0.0, 0u, 0u);
  // First in front of the thing; then, where its edge covers only part of the pixel, behind it.
  float from = begin;
  const int parts = kThings != 0 && thing_at < kFar ? 2 : 1;
  for (int part = 0; part < parts && light.through > kStop; ++part) {
    march(from, parts == 2 && part == 0 ? min(thing_at, finish) : finish, dt, jitter, light);
    if (parts == 2 && part == 0) {
      const float before = light.through;
      light.colour += light.through * thing.a * decoded(thing.rgb);
      light.through *= 1.0 - thing.a;
      if (before > 0.5 && light.through <= 0.5) light.depth = view.background.w / thing_at;
      from = max(thing_at, begin);
    }
  }
  write(pixel, eye, out_index, light, back_word);
}

// Whether the pixel is visible through the optics.
bool is_visible(ivec2 pixel, int eye, ivec2 size) {
  const ivec2 tiles = (size + 7) / 8, tile = pixel / 8;
  const uvec2 bits = visible[tile.x + tiles.x * (tile.y + tiles.y * eye)];
  const int bit = (pixel.x & 7) + 8 * (pixel.y & 7);
  return ((bit < 32 ? bits.x : bits.y) >> (bit & 31) & 1u) != 0u;
}

void main() {
  const uint l = gl_LocalInvocationIndex;
  const ivec2 pixel = ivec2(8u * gl_WorkGroupID.xy) +
                      ivec2(l & 3u | l >> 1 & 4u, l >> 2 & 1u | l >> 3 & 6u);
  const int eye = int(gl_WorkGroupID.z);
  const ivec2 size = view.counts.zw;
  if (any(greaterThanEqual(pixel, size))) return;
  const uint out_index = uint(pixel.x + size.x * (pixel.y + size.y * eye));
  if (kMasked == 0) {
    draw(pixel, eye, size, out_index);
    return;
  }
  const bool is_here = is_visible(pixel, eye, size);
  if (!is_here) {
    colour_out[out_index] = 0u;
    depth_out[out_index] = 0u;
    if (kCount != 0) {
      samples_out[2u * out_index] = 0u;
      samples_out[2u * out_index + 1u] = 0u;
    }
  }
  // A loop, so that a CPU driver leaves it where no pixel is visible.
  for (bool draws = is_here; draws; draws = false) draw(pixel, eye, size, out_index);
}
