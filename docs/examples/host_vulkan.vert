#version 450
// A cube without vertex buffers: 36 corners, computed from gl_VertexIndex.
layout(push_constant) uniform Push {
  mat4 clip_from_cube;
  mat4 world_from_cube;
} push;
layout(location = 0) out vec3 normal;

void main() {
  const int corner[6] = int[](0, 1, 2, 2, 1, 3);
  const int face = gl_VertexIndex / 6, axis = face >> 1;
  const float side = (face & 1) != 0 ? 1.0 : -1.0;
  const int c = corner[gl_VertexIndex % 6];
  vec3 at;
  at[axis] = side;
  at[(axis + 1) % 3] = (c & 1) != 0 ? 1.0 : -1.0;
  at[(axis + 2) % 3] = (c & 2) != 0 ? 1.0 : -1.0;
  vec3 outward = vec3(0.0);
  outward[axis] = side;
  normal = mat3(push.world_from_cube) * outward;
  gl_Position = push.clip_from_cube * vec4(at, 1.0);
}
