#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Draws opaque bodies into the depth and colour that the ray caster reads. Each body is the union of all spheres
// between two, with centre and radius blended (a round cone). It is convex, so a ray is inside between its first and
// last intersection with the two end spheres and the cone between them:
//   a2 (|p - a|^2 l2 - y^2) = (ra l2 - y rr)^2,   l2 = |b - a|^2, y = (p - a).(b - a),
//   rr = ra - rb, a2 = l2 - rr^2,   where 0 < y - ra rr < a2.
// Bodies are drawn half a pixel too thick; the coverage of the pixel by the true body follows from how deep the middle
// of the ray's part inside lies.
//
// binding  direction  format             shape                unit
// 0        in         ViewParameters     1
// 1        in         ViewThing          things               world, m
// 2        in         uvec4              items                thing, eye, x | y << 16, w | h << 16
// 3        in out     uint               eyes x h x w         bits of the depth t, m; ~0 none
// 4        in out     uint               the same             colour, sRGB, and coverage, RGBA8; 0 none
//
// A workgroup is an item: a rectangle of at most 64 x 64 pixels of one eye; its invocations share the pixels. kPass 0:
// the nearest depth, by an atomic minimum on the bits, which have the order of positive floats. 1: the colour, where
// the depth is the nearest one, to 1e-6 of it. Where several bodies are, as where edges of a box meet, that with the
// most coverage remains, then that with the most blue, green, red: an atomic maximum on the bits. So the order of
// invocations changes nothing. Precision: fp32.
// Checked against the formula of a round cone: tests/view/scene_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) readonly buffer Things { ViewThing things[]; };
layout(set = 0, binding = 2) readonly buffer Items { uvec4 items[]; };
layout(set = 0, binding = 3) buffer Depth { uint depth[]; };
layout(set = 0, binding = 4) buffer Colour { uint colour[]; };
layout(constant_id = 0) const int kPass = 0;

const float kNone = 3e38;

void meet_sphere(vec3 way, vec3 centre, float radius, inout float enters, inout float leaves) {
  const float b = dot(way, centre), c = dot(centre, centre) - radius * radius, a = dot(way, way);
  const float under = b * b - a * c;
  if (under < 0.0) return;
  const float root = sqrt(under);
  enters = min(enters, (b - root) / a);
  leaves = max(leaves, (b + root) / a);
}

/// Depths between which a ray from the origin is inside the body with the ends a and b.
void meet(vec3 way, vec3 a, float ra, vec3 b, float rb, out float enters, out float leaves) {
  enters = kNone;
  leaves = -kNone;
  meet_sphere(way, a, ra, enters, leaves);
  meet_sphere(way, b, rb, enters, leaves);
  const vec3 axis = b - a;
  const float rr = ra - rb, l2 = dot(axis, axis), a2 = l2 - rr * rr;
  if (a2 <= 0.0) return;
  const float y0 = -dot(a, axis), y1 = dot(way, axis);
  const float aa = a2 * (dot(way, way) * l2 - y1 * y1) - rr * rr * y1 * y1;
  const float bb = a2 * (-dot(way, a) * l2 - y0 * y1) + rr * y1 * (ra * l2 - y0 * rr);
  const float over = ra * l2 - y0 * rr;
  const float cc = a2 * (dot(a, a) * l2 - y0 * y0) - over * over;
  const float under = bb * bb - aa * cc;
  if (under < 0.0 || abs(aa) < 1e-30) return;
  const float root = sqrt(under);
  for (int side = -1; side <= 1; side += 2) {
    const float t = (-bb + float(side) * root) / aa;
    const float contact = y0 + t * y1 - ra * rr;
    if (contact > 0.0 && contact < a2) {
      enters = min(enters, t);
      leaves = max(leaves, t);
    }
  }
}

/// Centre (xyz) and radius (w) of the sphere of the body that comes nearest to p.
vec4 nearest_sphere(vec3 p, vec3 a, float ra, vec3 b, float rb) {
  const vec3 axis = b - a;
  const float l = length(axis);
  if (l < 1e-9) return vec4(a, max(ra, rb));
  const float k = (ra - rb) / l;
  if (abs(k) >= 1.0) return ra > rb ? vec4(a, ra) : vec4(b, rb);
  const float z = dot(p - a, axis) / l;
  const float aside = sqrt(max(dot(p - a, p - a) - z * z, 0.0));
  const float h = clamp((z - aside * k * inversesqrt(1.0 - k * k)) / l, 0.0, 1.0);
  return vec4(a + h * axis, mix(ra, rb, h));
}

#include "include/lit_thing.glsl"

void main() {
  const uvec4 item = items[gl_WorkGroupID.x];
  const ViewThing thing = things[item.x];
  const ViewRays rays = view.rays[item.y];
  const ivec2 corner = ivec2(item.z & 0xffffu, item.z >> 16);
  const ivec2 size = ivec2(item.w & 0xffffu, item.w >> 16);
  const vec3 a = thing.from.xyz - rays.origin.xyz, b = thing.to.xyz - rays.origin.xyz;
  const float pixel_per_t = length(rays.right.xyz);
  const float near = view.background.w;
  for (int i = int(gl_LocalInvocationIndex); i < size.x * size.y; i += 64) {
    const ivec2 pixel = corner + ivec2(i % size.x, i / size.x);
    const vec3 way = rays.first.xyz + float(pixel.x) * rays.right.xyz + float(pixel.y) * rays.down.xyz;
    // Half a pixel at the depth of the middle, a sufficient approximation for the width of an edge.
    const float apart = 0.5 * pixel_per_t * max(dot(0.5 * (a + b), way) / dot(way, way), near);
    float enters, leaves;
    meet(way, a, thing.from.w + apart, b, thing.to.w + apart, enters, leaves);
    const bool met = enters < leaves && leaves > near;
    const float t = max(enters, near);
    const vec3 middle = 0.5 * (enters + leaves) * way;
    const vec4 inner = nearest_sphere(middle, a, thing.from.w, b, thing.to.w);
    const float deep = inner.w - length(middle - inner.xyz);
    const float covered = clamp(0.5 + deep / (2.0 * apart), 0.0, 1.0);
    if (!met || covered < 0.03) continue;
    const uint place = uint(pixel.x + view.counts.z * (pixel.y + view.counts.w * int(item.y)));
    if (kPass == 0) {
      atomicMin(depth[place], floatBitsToUint(t));
    } else if (t <= uintBitsToFloat(depth[place]) * (1.0 + 1e-6)) {
      const vec3 at = t * way;
      const vec4 sphere = nearest_sphere(at, a, thing.from.w, b, thing.to.w);
      const vec3 outward = at - sphere.xyz;
      const vec3 normal = outward * inversesqrt(max(dot(outward, outward), 1e-20));
      atomicMax(colour[place], shaded(thing.colour.rgb, way, normal, covered));
    }
  }
}
