// The lattice of pixels of which rays are drawn first: every second one along both axes. Where the picture is smooth
// between them, pixels there are interpolated (between.comp). Needs view, lattice.

uint point_place(ivec2 point, int eye) {
  const ivec2 points = (view.counts.zw + 1) / 2;
  return uint(point.x + points.x * (point.y + points.y * eye));
}

vec4 shown_of_point(uvec4 packed) {
  return vec4(unpackUnorm2x16(packed.x), unpackUnorm2x16(packed.y));
}

// shown: sRGB over the background, or of the volumes' light alone over a backdrop; w: transmittance. depth: near / t, 0
// without surface. cut: a thing, the backdrop, or the optics end the ray, so pixels around it are to be drawn.
uvec4 packed_point(vec4 shown, float depth, bool cut) {
  return uvec4(packUnorm2x16(shown.xy), packUnorm2x16(shown.zw), floatBitsToUint(depth), cut ? 1u : 0u);
}

// A pixel of an eye in one word, for lists.
uint item_of(ivec2 pixel, int eye) {
  return uint(pixel.x) | uint(pixel.y) << kItemBits | uint(eye) << 2 * kItemBits;
}

ivec2 pixel_of_item(uint item) {
  return ivec2(item, item >> kItemBits) & (1 << kItemBits) - 1;
}

int eye_of_item(uint item) {
  return int(item >> 2 * kItemBits);
}
