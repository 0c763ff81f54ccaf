#version 460
#extension GL_GOOGLE_include_directive : require
#include "interface/view.h"
// Finds where the triangles of meshes are the nearest of all bodies (things.comp).
//
// binding  direction  format             shape                unit
// 0        in         ViewParameters     1
// 1        in         MeshVertex         vertices             mesh, m
// 2        in         uint               triangles x 3        indices, from the mesh's first vertex
// 3        in         MeshPart           parts
// 4        in         uvec4              items                part, eye, first triangle of the part, triangles
// 5        in out     uint               eyes x h x w         bits of the depth t, m; ~0 none
// 6        in out     uint               the same             1 + 64 item + triangle of the item; 0 none
//
// A workgroup is an item: up to 64 triangles of a part. An invocation goes through the pixels of the box around its
// triangle. kPass 0: the nearest depth, by an atomic minimum on the bits, which have the order of positive floats. 1: the
// triangle, where its depth is the nearest, to 1e-6 of it; of several the last one, so that the order of invocations
// changes nothing. A pixel is covered if its middle is. Triangles of which a corner is nearer than the nearest depth are
// left out. Precision: fp32.
// Checked against a search of all triangles: tests/view/mesh_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform Parameters { ViewParameters view; };
layout(set = 0, binding = 1) readonly buffer Vertices { MeshVertex vertices[]; };
layout(set = 0, binding = 2) readonly buffer Triangles { uint corners[]; };
layout(set = 0, binding = 3) readonly buffer Parts { MeshPart parts[]; };
layout(set = 0, binding = 4) readonly buffer Items { uvec4 items[]; };
layout(set = 0, binding = 5) buffer Depth { uint depth[]; };
layout(set = 0, binding = 6) buffer Nearest { uint nearest[]; };
layout(constant_id = 0) const int kPass = 0;

#include "include/mesh_triangle.glsl"

void main() {
  const uvec4 item = items[gl_WorkGroupID.x];
  if (gl_LocalInvocationIndex >= item.w) return;
  const SeenTriangle seen = seen_triangle(item, gl_LocalInvocationIndex);
  const float near = view.background.w;
  if (min(seen.t.x, min(seen.t.y, seen.t.z)) < near) return;
  // Clamped before the cast: what is far aside has no pixel number that fits an int.
  const vec2 low = vec2(min(seen.x.x, min(seen.x.y, seen.x.z)), min(seen.y.x, min(seen.y.y, seen.y.z)));
  const vec2 high = vec2(max(seen.x.x, max(seen.x.y, seen.x.z)), max(seen.y.x, max(seen.y.y, seen.y.z)));
  const ivec2 first = ivec2(ceil(max(low, vec2(0.0)))), last = ivec2(floor(min(high, vec2(view.counts.zw) - 1.0)));
  const uint own = 1u + 64u * gl_WorkGroupID.x + gl_LocalInvocationIndex;
  for (int y = first.y; y <= last.y; ++y)
    for (int x = first.x; x <= last.x; ++x) {
      const vec4 w = seen.first + float(x) * seen.per_x + float(y) * seen.per_y;
      const float t = 1.0 / w.w;
      // The edge that two triangles share belongs to both.
      const bool inside = (min(w.x, min(w.y, w.z)) >= 0.0 || max(w.x, max(w.y, w.z)) <= 0.0) && t >= near;
      const uint place = uint(x + view.counts.z * (y + view.counts.w * int(item.y)));
      if (inside) {
        if (kPass == 0)
          atomicMin(depth[place], floatBitsToUint(t));
        else if (t <= uintBitsToFloat(depth[place]) * (1.0 + 1e-6))
          atomicMax(nearest[place], own);
      }
    }
}
