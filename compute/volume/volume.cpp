#include "compute/volume/volume.h"

#include <cassert>

#include "compute/volume/resample.h"

namespace palpate {

double sample(const Volume& volume, glm::dvec3 index) {
  double value = 0.0;
  interpolation::sample_at<1>(volume.values.data(), volume.grid, index, &value);
  return value;
}

Volume resampled(const Volume& volume, const Grid& onto) {
  assert(volume.values.size() == volume.grid.count());
  if (same_geometry(volume.grid, onto)) return {onto, volume.values};
  Volume result{onto, std::vector<float>(onto.count())};
  interpolation::resample<1>(volume.values.data(), volume.grid, onto, result.values.data());
  return result;
}

Mask resampled(const Mask& mask, const Grid& onto) {
  assert(mask.values.size() == mask.grid.count());
  if (same_geometry(mask.grid, onto)) return {onto, mask.values};
  Mask result{onto, std::vector<uint8_t>(onto.count())};
  size_t offset = 0;
  for (int k = 0; k < onto.size.z; ++k) {
    for (int j = 0; j < onto.size.y; ++j) {
      for (int i = 0; i < onto.size.x; ++i, ++offset) {
        const glm::ivec3 at(glm::round(mask.grid.index_from_lps(onto.lps_from_index({i, j, k}))));
        if (glm::any(glm::lessThan(at, glm::ivec3(0))) ||
            glm::any(glm::greaterThanEqual(at, mask.grid.size)))
          continue;
        result.values[offset] = mask.values[mask.grid.offset(at.x, at.y, at.z)];
      }
    }
  }
  return result;
}

}  // namespace palpate
