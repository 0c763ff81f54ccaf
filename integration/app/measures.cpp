#include "integration/app/measures.h"

namespace palpate::app {

Mask mask_on(const Mask& mask, const Grid& onto) {
  if (same_geometry(mask.grid, onto)) return {onto, mask.values};
  Mask result{onto, std::vector<uint8_t>(onto.count())};
  for (int k = 0; k < onto.size.z; ++k) {
    for (int j = 0; j < onto.size.y; ++j) {
      for (int i = 0; i < onto.size.x; ++i) {
        const glm::dvec3 at = mask.grid.index_from_lps(onto.lps_from_index({i, j, k}));
        const glm::ivec3 nearest(glm::round(at));
        if (glm::any(glm::lessThan(nearest, glm::ivec3(0))) ||
            glm::any(glm::greaterThanEqual(nearest, mask.grid.size)))
          continue;
        result.values[onto.offset(i, j, k)] =
            mask.values[mask.grid.offset(nearest.x, nearest.y, nearest.z)];
      }
    }
  }
  return result;
}

Result<Spread> endpoint_error_own_voxels(const Field& u, const Field& truth, const Mask* mask) {
  const Field compared = resampled(u, truth.grid);
  const glm::dmat3 index_from_lps = glm::transpose(truth.grid.direction);
  std::vector<float> errors;
  for (size_t n = 0; n < truth.u_mm.size(); ++n) {
    if (mask && !mask->values[n]) continue;
    const glm::dvec3 error_mm = glm::dvec3(compared.u_mm[n]) - glm::dvec3(truth.u_mm[n]);
    errors.push_back(float(glm::length(index_from_lps * error_mm / truth.grid.spacing_mm)));
  }
  if (errors.empty())
    return Error{ErrorKind::kBadInput, "The mask marks no voxel of the truth: name another mask"};
  return spread_of(errors);
}

}  // namespace palpate::app
