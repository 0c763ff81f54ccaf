#include <algorithm>
#include <cmath>

#include "shaders/interface/motion.h"
#include "tests/motion/oracle/oracle.h"

namespace palpate::oracle {

std::array<Tap, 8> trilinear_taps(glm::dvec3 index) {
  const glm::dvec3 low = glm::floor(index);
  const glm::dvec3 t = index - low;
  std::array<Tap, 8> taps{};
  for (int c = 0; c < 8; ++c) {
    const glm::ivec3 side(c & 1, c >> 1 & 1, c >> 2);
    taps[size_t(c)].index = glm::ivec3(low) + side;
    taps[size_t(c)].weight = 1.0;
    for (int a = 0; a < 3; ++a) taps[size_t(c)].weight *= side[a] ? t[a] : 1.0 - t[a];
  }
  return taps;
}

glm::ivec3 cells_of(glm::ivec3 size, glm::ivec3 cell) {
  return (size + cell - 1) / cell;
}

glm::dvec3 cell_index(glm::dvec3 i, glm::ivec3 cell) {
  return (i + 0.5) / glm::dvec3(cell) - 0.5;
}

bool inside_mask(const glm::dvec4& texel) {
  return std::isfinite(texel.x);
}

Scalars downsample(const Scalars& fine, glm::ivec3 ratio) {
  constexpr std::array<double, 4> kBurt = {1.0 / 8.0, 3.0 / 8.0, 3.0 / 8.0, 1.0 / 8.0};
  // Weight of the fine sample ratio * i + k along one axis.
  const auto weight = [&](int axis, int k) {
    if (ratio[axis] == 1) return k == 0 ? 1.0 : 0.0;
    return kBurt[size_t(k + 1)];
  };
  Scalars coarse(cells_of(fine.size, ratio));
  for_each(coarse.size, [&](glm::ivec3 i) {
    for_each(glm::ivec3(4), [&](glm::ivec3 tap) {
      const glm::ivec3 k = tap - 1;
      coarse.at(i) += weight(0, k.x) * weight(1, k.y) * weight(2, k.z) * fine.held(i * ratio + k);
    });
  });
  return coarse;
}

Texels moments(const Scalars& image, glm::ivec3 cell) {
  Texels result(cells_of(image.size, cell));
  Scalars inside(result.size);
  for_each(image.size, [&](glm::ivec3 i) {
    const double value = image.at(i);
    result.at(i / cell) += glm::dvec4(value, value * value, 0.0, 0.0);
    inside.at(i / cell) += 1.0;
  });
  for (size_t i = 0; i < result.values.size(); ++i) result.values[i] /= inside.values[i];
  return result;
}

Texels gauss(const Texels& image, int axis, double sigma) {
  constexpr double kNothingBelow = 0.3;
  if (sigma < kNothingBelow) return image;
  const int radius = std::min(shaders::kMaxRadius, int(std::ceil(3.0 * sigma)));
  const auto weight = [&](int k) { return std::exp(-0.5 * k * k / (sigma * sigma)); };
  glm::ivec3 along(0);
  along[axis] = 1;
  Texels result(image.size);
  for_each(image.size, [&](glm::ivec3 i) {
    double all = 0.0;
    for (int k = -radius; k <= radius; ++k) {
      result.at(i) += weight(k) * image.held(i + k * along);
      all += weight(k);
    }
    result.at(i) /= all;
  });
  return result;
}

Texels gauss(const Texels& image, glm::dvec3 sigma) {
  return gauss(gauss(gauss(image, 0, sigma.x), 1, sigma.y), 2, sigma.z);
}

Scalars normalise(const Scalars& image, const Texels& moments, glm::ivec3 cell, double noise_sd) {
  Scalars result(image.size);
  for_each(image.size, [&](glm::ivec3 i) {
    const glm::dvec4 m = sample(moments, cell_index(glm::dvec3(i), cell));
    const double variance = std::max(0.0, m.y - m.x * m.x);
    result.at(i) = (image.at(i) - m.x) / std::sqrt(variance + noise_sd * noise_sd);
  });
  return result;
}

Texels pack(const Scalars& image, glm::dvec3 spacing_mm, const Scalars* mask,
            bool outermost_count) {
  constexpr double kLargest = shaders::kLargestGradient;
  Texels result(image.size);
  for_each(image.size, [&](glm::ivec3 i) {
    bool outside = mask && mask->at(i) == 0.0;
    for (int axis = 0; axis < 3 && !outermost_count; ++axis) {
      const int last = image.size[axis] - 1;
      outside |= last + 1 >= shaders::kLeastForOutermost && (i[axis] == 0 || i[axis] == last);
    }
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 step(0);
      step[axis] = 1;
      const double slope = (image.held(i + step) - image.held(i - step)) / (2.0 * spacing_mm[axis]);
      result.at(i)[axis] = outside ? kOutside : std::clamp(slope, -kLargest, kLargest);
    }
    result.at(i).w = image.at(i);
  });
  return result;
}

}  // namespace palpate::oracle
