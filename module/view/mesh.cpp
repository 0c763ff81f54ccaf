#include "module/view/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "module/scene/look.h"

namespace palpate {
namespace {

/// Of four texels, as light.
uint32_t mean_of(const std::array<uint32_t, 4>& texels) {
  static const auto kLight = [] {
    std::array<double, 256> light{};
    for (size_t v = 0; v < 256; ++v) light[v] = linear_from_srgb(double(v) / 255.0);
    return light;
  }();
  uint32_t mean = 0xff000000U;
  for (int shift = 0; shift < 24; shift += 8) {
    double sum = 0.0;
    for (const uint32_t texel : texels) sum += kLight[texel >> shift & 0xffU];
    // The byte whose light is nearest.
    const auto above = std::lower_bound(kLight.begin(), kLight.end(), sum / 4.0);
    auto byte = uint32_t(std::min(above - kLight.begin(), std::ptrdiff_t(255)));
    if (byte > 0 && sum / 4.0 - kLight[byte - 1] < kLight[byte] - sum / 4.0) --byte;
    mean |= byte << shift;
  }
  return mean;
}

}  // namespace

std::shared_ptr<const MeshTexture> mesh_texture(int width, int height,
                                                std::vector<uint32_t> pixels) {
  auto made = std::make_shared<MeshTexture>(MeshTexture{width, height, 1, std::move(pixels)});
  std::vector<uint32_t>& all = made->texels;
  for (size_t last = 0; width > 1 || height > 1; ++made->levels) {
    const int half_width = std::max(width / 2, 1), half_height = std::max(height / 2, 1);
    for (int y = 0; y < half_height; ++y)
      for (int x = 0; x < half_width; ++x) {
        const auto at = [&](int dx, int dy) {
          return all[last + size_t(std::min(2 * x + dx, width - 1)) +
                     size_t(width) * size_t(std::min(2 * y + dy, height - 1))];
        };
        all.push_back(mean_of({at(0, 0), at(1, 0), at(0, 1), at(1, 1)}));
      }
    last += size_t(width) * size_t(height);
    width = half_width;
    height = half_height;
  }
  return made;
}

}  // namespace palpate
