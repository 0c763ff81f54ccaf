#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// The colours of meshes, where meshes.comp has found a triangle to be the nearest body.
//
// binding  direction  format             shape                unit
// 0        in         ViewParameters     1
// 1        in         MeshVertex         vertices             mesh, m
// 2        in         uint               triangles x 3        indices, from the mesh's first vertex
// 3        in         MeshPart           parts
// 4        in         uvec4              items                as in meshes.comp
// 5        in         uint               texels               sRGB, RGBA8; each level half the size of the last
// 6        in         uint               eyes x h x w         1 + 64 item + triangle of the item; 0 none
// 7        in out     uint               the same             colour, sRGB, and coverage, RGBA8; 0 none
//
// An invocation is a pixel of an eye (z). Of several bodies at one depth that with the most blue, green, red remains, as in
// things.comp. Precision: fp32.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) readonly buffer Vertices { MeshVertex vertices[]; };
layout(set = 0, binding = 2) readonly buffer Triangles { uint corners[]; };
layout(set = 0, binding = 3) readonly buffer Parts { MeshPart parts[]; };
layout(set = 0, binding = 4) readonly buffer Items { uvec4 items[]; };
layout(set = 0, binding = 5) readonly buffer Texels { uint texels[]; };
layout(set = 0, binding = 6) readonly buffer Nearest { uint nearest[]; };
layout(set = 0, binding = 7) buffer Colour { uint colour[]; };

#include "include/lit_thing.glsl"
#include "include/mesh_triangle.glsl"

/// A normal in the world, of any length; of a mirrored mesh it points inwards.
vec3 turned(MeshPart part, vec3 n) {
  const vec3 x = part.world_from_mesh[0].xyz, y = part.world_from_mesh[1].xyz, z = part.world_from_mesh[2].xyz;
  return vec3(dot(cross(y, z), n), dot(cross(z, x), n), dot(cross(x, y), n));
}

vec3 linear_texel(int first, ivec2 size, ivec2 at) {
  at = at - size * ivec2(floor(vec2(at) / vec2(size)));
  return decoded(unpackUnorm4x8(texels[first + at.x + size.x * at.y]).rgb);
}

/// The texture's colour, from the level whose texels are about as large as the pixel.
vec3 textured(ivec4 texture_at, vec2 at, int level) {
  int first = texture_at.x;
  ivec2 size = texture_at.yz;
  for (int l = 0; l < level; ++l) {
    first += size.x * size.y;
    size = max(size / 2, ivec2(1));
  }
  const vec2 p = fract(at) * vec2(size) - 0.5;
  const ivec2 low = ivec2(floor(p));
  const vec2 w = p - vec2(low);
  return mix(mix(linear_texel(first, size, low), linear_texel(first, size, low + ivec2(1, 0)), w.x),
             mix(linear_texel(first, size, low + ivec2(0, 1)), linear_texel(first, size, low + ivec2(1, 1)), w.x), w.y);
}

/// By the areas of the triangle in the texture and in the picture.
int level_of(SeenTriangle seen, ivec4 texture_at) {
  const vec2 u = seen.b.texture.xy - seen.a.texture.xy, v = seen.c.texture.xy - seen.a.texture.xy;
  const float texels_covered = abs(u.x * v.y - u.y * v.x) * float(texture_at.y) * float(texture_at.z);
  const float pixels_covered =
      abs((seen.x.y - seen.x.x) * (seen.y.z - seen.y.x) - (seen.x.z - seen.x.x) * (seen.y.y - seen.y.x));
  const float level = 0.5 * log2(max(texels_covered, 1e-12) / max(pixels_covered, 1e-12));
  return clamp(int(level + 0.5), 0, texture_at.w - 1);
}

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  const int eye = int(gl_WorkGroupID.z);
  if (pixel.x >= view.counts.z || pixel.y >= view.counts.w) return;
  const uint place = uint(pixel.x + view.counts.z * (pixel.y + view.counts.w * eye));
  const uint found = nearest[place];
  if (found > 0u) {
    const uvec4 item = items[(found - 1u) / 64u];
    const SeenTriangle seen = seen_triangle(item, (found - 1u) % 64u);
    const MeshPart part = parts[item.x];
    const vec3 w = (seen.first + float(pixel.x) * seen.per_x + float(pixel.y) * seen.per_y).xyz;
    const vec3 share = w / (w.x + w.y + w.z);
    const ViewRays rays = view.rays[eye];
    const vec3 way = rays.first.xyz + float(pixel.x) * rays.right.xyz + float(pixel.y) * rays.down.xyz;
    vec3 normal = turned(part, share.x * seen.a.normal.xyz + share.y * seen.b.normal.xyz + share.z * seen.c.normal.xyz);
    if (dot(normal, normal) < 1e-30) normal = seen.face;
    normal *= inversesqrt(max(dot(normal, normal), 1e-30));
    if (dot(normal, way) > 0.0) normal = -normal;
    vec3 own = part.colour.rgb;
    if (part.texture.y > 0)
      own *= textured(part.texture,
                      share.x * seen.a.texture.xy + share.y * seen.b.texture.xy + share.z * seen.c.texture.xy,
                      level_of(seen, part.texture));
    colour[place] = max(colour[place], shaded(own, way, normal, 1.0));
  }
}
