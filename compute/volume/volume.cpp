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

}  // namespace palpate
