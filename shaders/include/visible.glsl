// Whether a pixel is visible through the optics. Needs visible.
bool is_visible(ivec2 pixel, int eye, ivec2 size) {
  const ivec2 tiles = (size + 7) / 8, tile = pixel / 8;
  const uvec2 bits = visible[tile.x + tiles.x * (tile.y + tiles.y * eye)];
  const int bit = (pixel.x & 7) + 8 * (pixel.y & 7);
  return ((bit < 32 ? bits.x : bits.y) >> (bit & 31) & 1u) != 0u;
}
