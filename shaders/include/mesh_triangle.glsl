// A triangle of a mesh as an eye sees it, for meshes.comp and mesh_colours.comp. A ray o + t way meets the triangle a, b, c
// (from o) where
//   wa = way.(b x c), wb = way.(c x a), wc = way.(a x b) have one sign; over their sum they are the weights of the corners;
//   t = a.n / way.n,   n = (b - a) x (c - a).
// Needs the block `view`, and the buffers `vertices`, `corners`, `parts` and `items`.

struct SeenTriangle {
  MeshVertex a, b, c;
  // wa, wb, wc and 1 / t are linear in the pixel's place: first + x per_x + y per_y.
  vec4 first, per_x, per_y;
  vec3 face;       // n, world
  vec3 t, x, y;    // of the corners: depth, and place in pixels
};

vec3 placed(MeshPart part, vec3 p) {
  return vec3(dot(part.world_from_mesh[0], vec4(p, 1.0)), dot(part.world_from_mesh[1], vec4(p, 1.0)),
              dot(part.world_from_mesh[2], vec4(p, 1.0)));
}

/// Triangle `number` of an item.
SeenTriangle seen_triangle(uvec4 item, uint number) {
  const MeshPart part = parts[item.x];
  const ViewRays rays = view.rays[item.y];
  const int corner = 3 * (part.first.x + int(item.z + number));
  SeenTriangle seen;
  seen.a = vertices[part.first.y + corners[corner]];
  seen.b = vertices[part.first.y + corners[corner + 1]];
  seen.c = vertices[part.first.y + corners[corner + 2]];
  const vec3 a = placed(part, seen.a.at.xyz) - rays.origin.xyz, b = placed(part, seen.b.at.xyz) - rays.origin.xyz,
             c = placed(part, seen.c.at.xyz) - rays.origin.xyz;
  const vec3 f = rays.first.xyz, r = rays.right.xyz, d = rays.down.xyz;
  const mat3 edges = transpose(mat3(cross(b, c), cross(c, a), cross(a, b)));
  seen.face = cross(b - a, c - a);
  const float whole = 1.0 / dot(a, seen.face);
  seen.first = vec4(edges * f, whole * dot(f, seen.face));
  seen.per_x = vec4(edges * r, whole * dot(r, seen.face));
  seen.per_y = vec4(edges * d, whole * dot(d, seen.face));
  // Rows that give t, t x and t y of a place.
  const mat3 abc = mat3(a, b, c);
  const float volume = 1.0 / dot(f, cross(r, d));
  seen.t = volume * (cross(r, d) * abc);
  seen.x = volume * (cross(d, f) * abc) / seen.t;
  seen.y = volume * (cross(f, r) * abc) / seen.t;
  return seen;
}
