// The colour of opaque bodies, beside the volumes that raycast.comp draws. Needs the block `view`.

#include "include/srgb.glsl"

/// sRGB and coverage, RGBA8, of a body of this linear colour, seen along `way`.
uint shaded(vec3 colour, vec3 way, vec3 normal, float covered) {
  const vec3 towards_eye = -normalize(way);
  const vec3 light = view.light.xyz;
  const float facing = max(dot(normal, towards_eye), 0.0);
  const float diffuse = max(0.35 + 0.65 * dot(normal, light), 0.0);
  float shine = max(dot(normal, normalize(light + towards_eye)), 0.0);
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  shine *= shine;
  const vec3 lit = colour * (0.30 + 0.55 * diffuse + 0.25 * facing) + 0.22 * shine;
  return packUnorm4x8(vec4(encoded(lit), covered));
}
