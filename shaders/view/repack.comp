#version 460
#extension GL_GOOGLE_include_directive : require
// Converts the picture to another image format: red and blue swapped, or the encoding removed for images whose values
// are taken as linear (IEC 61966-2-1):
//   linear = e / 12.92 for e <= 0.04045, else ((e + 0.055) / 1.055)^2.4.
// Coverage is linear in every format and is not converted.
//
// binding  direction  format  shape            unit
// 0        in         uint    pixels           R in the lowest byte, G, B encoded as sRGB; coverage
// 1        out        uint    pixels           the same for 8-bit formats; kHalf: 2 per pixel, R and
//                                              G, then B and coverage, as halves
// push: pixels of a row, rows of all eyes.
//
// One invocation: one pixel. Precision: fp32, rounded to the nearest of the format. Race: each
// output written once. CPU oracle: linear_from_srgb, tests/xr/swapchain_format_test.cpp.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer From { uint from[]; };
layout(set = 0, binding = 1) writeonly buffer To { uint to[]; };
layout(push_constant) uniform Push { ivec4 size; } push;
layout(constant_id = 0) const int kSwapped = 0;
layout(constant_id = 1) const int kLinear = 0;
layout(constant_id = 2) const int kHalf = 0;

#include "include/srgb.glsl"

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, push.size.xy))) return;
  const uint at = uint(pixel.x + push.size.x * pixel.y);
  vec4 colour = unpackUnorm4x8(from[at]);
  if (kLinear != 0) colour.rgb = decoded(colour.rgb);
  if (kSwapped != 0) colour.rgb = colour.bgr;
  if (kHalf != 0) {
    to[2u * at] = packHalf2x16(colour.rg);
    to[2u * at + 1u] = packHalf2x16(colour.ba);
  } else {
    to[at] = packUnorm4x8(colour);
  }
}
