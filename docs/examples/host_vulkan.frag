#version 450
layout(location = 0) in vec3 normal;
layout(location = 0) out vec4 colour;

void main() {
  const float light = 0.35 + 0.65 * max(dot(normalize(normal), normalize(vec3(-0.35, 0.65, 0.67))), 0.0);
  colour = vec4(light * vec3(0.05, 0.45, 0.75), 1.0);
}
