#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "module/view/eye.h"

namespace palpate {

/// Which pixels of a picture the optics of a headset let through. What it says is hidden is not
/// marched: rays there cost nothing, and the pixels are 0.
struct VisiblePixels {
  PictureSize size;
  int eyes = 0;
  /// Eye after eye, row after row, a word for each 8 x 8 pixels: bit x + 8 y is set where the pixel
  /// is seen.
  std::vector<uint64_t> tiles;
  bool visible(int eye, int x, int y) const;
};

/// What of the plane z = -1 of an eye its optics hide: three indices per triangle.
struct HiddenTriangles {
  std::span<const glm::vec2> vertices;
  std::span<const uint32_t> indices;
};

/// The pixels of pictures of these eyes outside of what is hidden from each. A pixel is hidden if
/// its centre and those of its eight neighbours are, those beyond the picture's edge left aside: so
/// that enlarging the picture mixes nothing black into what is seen. Indices must be below the
/// number of vertices.
VisiblePixels visible_pixels(std::span<const Eye> eyes, std::span<const HiddenTriangles> hidden,
                             PictureSize size);

}  // namespace palpate
