#include "compute/volume/field.h"

#include <cassert>

#include "compute/volume/resample.h"
#include "compute/volume/volume.h"

namespace palpate {
namespace {

static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "vectors are read as interleaved floats");

const float* interleaved(const std::vector<glm::vec3>& vectors) {
  return vectors.empty() ? nullptr : &vectors.front().x;
}

}  // namespace

glm::dvec3 sample(const Field& field, glm::dvec3 index) {
  glm::dvec3 u_mm(0.0);
  interpolation::sample_at<3>(interleaved(field.u_mm), field.grid, index, &u_mm.x);
  return u_mm;
}

glm::dvec3 sample_at_lps(const Field& field, glm::dvec3 lps_mm) {
  return sample(field, field.grid.index_from_lps(lps_mm));
}

Field resampled(const Field& field, const Grid& onto) {
  assert(field.u_mm.size() == field.grid.count());
  if (same_geometry(field.grid, onto)) return {onto, field.u_mm};
  Field result = still_field(onto);
  if (result.u_mm.empty()) return result;
  interpolation::resample<3>(interleaved(field.u_mm), field.grid, onto, &result.u_mm.front().x);
  return result;
}

Confidence resampled(const Confidence& confidence, const Grid& onto) {
  return {onto, resampled(Volume{confidence.grid, confidence.values}, onto).values};
}

Deviation resampled(const Deviation& deviation, const Grid& onto) {
  Deviation result{onto, std::vector<glm::vec2>(deviation.mm.empty() ? 0 : onto.count())};
  if (deviation.mm.empty()) return result;
  Volume part{deviation.grid, std::vector<float>(deviation.mm.size())};
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < deviation.mm.size(); ++i) part.values[i] = deviation.mm[i][c];
    const Volume fine = resampled(part, onto);
    for (size_t i = 0; i < fine.values.size(); ++i) result.mm[i][c] = fine.values[i];
  }
  return result;
}

Field still_field(const Grid& grid) {
  return {grid, std::vector<glm::vec3>(grid.count(), glm::vec3(0.0F))};
}

}  // namespace palpate
