#include "module/view/visible_pixels.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr int kTile = 8;
constexpr int kWord = 64;
constexpr double kEdge = 1e-6;  // pixels: triangles that share an edge leave no gap

int tiles_along(int pixels) {
  return (pixels + kTile - 1) / kTile;
}

/// Rows of bits, a set one is hidden. Beyond the width all are.
class Hidden {
 public:
  explicit Hidden(PictureSize size)
      : size_(size), words_((size.width + kWord - 1) / kWord), bits_(words_ * size.height, 0) {
    for (int y = 0; y < size.height && size.width % kWord != 0; ++y)
      bits_[at(words_ - 1, y)] = ~uint64_t{0} << size.width % kWord;
  }

  void fill(int y, int from, int to) {
    for (int word = from / kWord; word <= to / kWord; ++word) {
      const int low = std::max(from - kWord * word, 0), high = std::min(to - kWord * word, 63);
      bits_[at(word, y)] |= (~uint64_t{0} >> (63 - high)) & (~uint64_t{0} << low);
    }
  }

  /// All pixels of a triangle whose corners are given in pixels.
  void cover(const glm::dvec2 (&corners)[3]) {
    double low = 1e300, high = -1e300;
    for (const glm::dvec2& c : corners) low = std::min(low, c.y), high = std::max(high, c.y);
    if (!(high >= -kEdge) || !(low <= size_.height)) return;
    const int first = int(std::ceil(std::max(low - kEdge, 0.0)));
    const int last = int(std::floor(std::min(high + kEdge, size_.height - 1.0)));
    for (int y = first; y <= last; ++y) {
      double from = 1e300, to = -1e300;
      for (int e = 0; e < 3; ++e) {
        const glm::dvec2 a = corners[e], b = corners[(e + 1) % 3];
        const double row = std::clamp(double(y), low, high);
        if (row < std::min(a.y, b.y) || row > std::max(a.y, b.y)) continue;
        // A level edge lies in its row with both ends; the others end in them.
        const double t = a.y == b.y ? 0.0 : (row - a.y) / (b.y - a.y);
        const double x = a.x + t * (b.x - a.x);
        from = std::min({from, x, a.y == b.y ? b.x : x});
        to = std::max({to, x, a.y == b.y ? b.x : x});
      }
      const int left = int(std::ceil(std::clamp(from - kEdge, 0.0, double(size_.width))));
      const int right = int(std::floor(std::clamp(to + kEdge, -1.0, size_.width - 1.0)));
      if (left <= right) fill(y, left, right);
    }
  }

  /// Hidden with all that lies around it.
  Hidden shrunk() const {
    Hidden result = *this;
    for (int y = 0; y < size_.height; ++y)
      for (int word = 0; word < words_; ++word) {
        uint64_t all = aside(word, y);
        if (y > 0) all &= aside(word, y - 1);
        if (y + 1 < size_.height) all &= aside(word, y + 1);
        result.bits_[at(word, y)] = all;
      }
    return result;
  }

  uint64_t byte(int tile, int y) const {
    return bits_[at(tile * kTile / kWord, y)] >> tile * kTile % kWord & 0xffU;
  }

 private:
  size_t at(int word, int y) const { return size_t(y) * size_t(words_) + size_t(word); }
  /// A word of which each bit is hidden with its neighbours in the row.
  uint64_t aside(int word, int y) const {
    const uint64_t here = bits_[at(word, y)];
    const uint64_t before = word > 0 ? bits_[at(word - 1, y)] : ~uint64_t{0};
    const uint64_t after = word + 1 < words_ ? bits_[at(word + 1, y)] : ~uint64_t{0};
    return here & (here << 1 | before >> 63) & (here >> 1 | after << 63);
  }

  PictureSize size_;
  int words_;
  std::vector<uint64_t> bits_;
};

Hidden hidden_from(const Eye& eye, const HiddenTriangles& triangles, PictureSize size) {
  Hidden hidden(size);
  const double per_x = size.width / (eye.tan_right - eye.tan_left);
  const double per_y = size.height / (eye.tan_up - eye.tan_down);
  for (size_t i = 0; i + 2 < triangles.indices.size(); i += 3) {
    glm::dvec2 corners[3];
    for (size_t c = 0; c < 3; ++c) {
      const glm::dvec2 place = triangles.vertices[triangles.indices[i + c]];
      corners[c] = {(place.x - eye.tan_left) * per_x - 0.5, (eye.tan_up - place.y) * per_y - 0.5};
    }
    hidden.cover(corners);
  }
  return hidden.shrunk();
}

}  // namespace

bool VisiblePixels::visible(int eye, int x, int y) const {
  const int across = tiles_along(size.width), down = tiles_along(size.height);
  const uint64_t tile = tiles[size_t(x / kTile + across * (y / kTile + down * eye))];
  return (tile >> (x % kTile + kTile * (y % kTile)) & 1U) != 0;
}

VisiblePixels visible_pixels(std::span<const Eye> eyes, std::span<const HiddenTriangles> hidden,
                             PictureSize size) {
  assert(eyes.size() == hidden.size() && "each eye has its own hidden triangles");
  VisiblePixels visible{size, int(eyes.size()), {}};
  const int across = tiles_along(size.width), down = tiles_along(size.height);
  visible.tiles.reserve(eyes.size() * size_t(across) * size_t(down));
  for (size_t e = 0; e < eyes.size(); ++e) {
    const Hidden pixels = hidden_from(eyes[e], hidden[e], size);
    for (int row = 0; row < down; ++row)
      for (int tile = 0; tile < across; ++tile) {
        uint64_t word = 0;
        for (int y = 0; y < std::min(kTile, size.height - kTile * row); ++y)
          word |= (~pixels.byte(tile, kTile * row + y) & 0xffU) << kTile * y;
        visible.tiles.push_back(word);
      }
  }
  return visible;
}

}  // namespace palpate
