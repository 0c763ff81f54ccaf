#include "compute/motion/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr size_t kPointsToFollow = 250000;

Error bad_input(const char* message) {
  return {ErrorKind::kBadInput, message};
}

bool counts(const Mask* mask, size_t offset) {
  return !mask || mask->values[offset] != 0;
}

Distances distances(std::vector<float>& mm, const Grid& grid) {
  return in_voxels(spread_of(mm), grid);
}

/// Calls value(i, j, k, offset) for every sample that counts, on all cores, and collects what is
/// not negative.
template <class Value>
std::vector<float> collected(const Grid& grid, const Mask* mask, const Value& value) {
  std::vector<float> all(grid.count(), -1.0F);
  parallel_ranges(grid.size.z, 100.0 * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      for (int j = 0; j < grid.size.y; ++j) {
        for (int i = 0; i < grid.size.x; ++i) {
          const size_t offset = grid.offset(i, j, k);
          if (counts(mask, offset)) all[offset] = value(i, j, k, offset);
        }
      }
    }
  });
  // NaN stays: it must reach the statistics.
  std::erase_if(all, [](float distance) { return distance < 0.0F; });
  return all;
}

bool inside(const Grid& grid, glm::dvec3 index) {
  const glm::dvec3 last = glm::dvec3(grid.size) - 0.5;
  return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThanEqual(index, last));
}

}  // namespace

Spread spread_of(std::vector<float>& values) {
  Spread spread;
  spread.count = values.size();
  if (values.empty()) return spread;
  const auto finite_end =
      std::partition(values.begin(), values.end(), [](float value) { return !std::isnan(value); });
  spread.mean = std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
  const size_t known = size_t(finite_end - values.begin());
  const auto rank = [&](double share) {
    const size_t place = std::max<size_t>(1, size_t(std::ceil(share * double(values.size())))) - 1;
    if (place >= known) return std::numeric_limits<double>::quiet_NaN();
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(place), finite_end);
    return double(values[place]);
  };
  spread.median = rank(0.5);
  spread.p95 = rank(0.95);
  spread.p99 = rank(0.99);
  spread.max = rank(1.0);
  return spread;
}

Distances in_voxels(const Spread& mm, const Grid& grid) {
  const double scale = 1.0 / grid.finest_mm();
  return {mm,
          {mm.count, mm.mean * scale, mm.median * scale, mm.p95 * scale, mm.p99 * scale,
           mm.max * scale}};
}

Result<Distances> endpoint_error(const Field& u, const Field& truth, const Mask* mask) {
  const Grid& grid = truth.grid;
  if (mask && !same_geometry(mask->grid, grid)) {
    return bad_input(
        "The mask and the truth lie on different grids; use a mask of the truth's grid.");
  }
  const Field fine = resampled(u, grid);
  std::vector<float> errors = collected(grid, mask, [&](int, int, int, size_t offset) {
    return glm::length(fine.u_mm[offset] - truth.u_mm[offset]);
  });
  if (errors.empty())
    return bad_input("The mask is empty, so there is nothing to compare; check it.");
  return distances(errors, grid);
}

Result<Spread> target_registration_error_mm(const Field& u,
                                            std::span<const glm::dvec3> fixed_lps_mm,
                                            std::span<const glm::dvec3> moving_lps_mm) {
  if (fixed_lps_mm.empty() || fixed_lps_mm.size() != moving_lps_mm.size()) {
    return bad_input(
        "The landmark lists are empty or of different length; every fixed landmark needs its "
        "moving "
        "one, in the same order.");
  }
  std::vector<float> errors;
  errors.reserve(fixed_lps_mm.size());
  for (size_t n = 0; n < fixed_lps_mm.size(); ++n) {
    const glm::dvec3 found = fixed_lps_mm[n] + sample_at_lps(u, fixed_lps_mm[n]);
    errors.push_back(float(glm::length(found - moving_lps_mm[n])));
  }
  return spread_of(errors);
}

Result<Distances> inverse_consistency(const Field& u, const Field& w, const Grid& image,
                                      const Mask* mask) {
  if (mask && !same_geometry(mask->grid, image)) {
    return bad_input(
        "The mask and the image lie on different grids; use a mask of the image's grid.");
  }
  const Field forward = resampled(u, image);
  std::vector<float> errors = collected(image, mask, [&](int i, int j, int k, size_t offset) {
    const glm::dvec3 step = glm::dvec3(forward.u_mm[offset]);
    const glm::dvec3 there = w.grid.index_from_lps(image.lps_from_index({i, j, k}) + step);
    if (glm::any(glm::isnan(step))) return std::numeric_limits<float>::quiet_NaN();
    return inside(w.grid, there) ? float(glm::length(step + sample(w, there))) : -1.0F;
  });
  if (errors.empty()) {
    return bad_input(
        "No point of the mask stays inside the backward field, so the two fields can not be "
        "compared; "
        "check that they belong to the same pair.");
  }
  return distances(errors, image);
}

glm::dvec3 followed(std::span<const Field> fields, glm::dvec3 lps_mm) {
  for (const Field& field : fields) lps_mm += sample_at_lps(field, lps_mm);
  return lps_mm;
}

Result<Spread> cycle_drift_mm(std::span<const Field> fields,
                              std::span<const glm::dvec3> points_lps_mm) {
  if (fields.empty() || points_lps_mm.empty()) {
    return bad_input("Cycle drift needs the fields of a whole cycle and at least one point.");
  }
  std::vector<float> drift(points_lps_mm.size());
  parallel_ranges(int(drift.size()), 150.0 * double(fields.size()), [&](int begin, int end) {
    for (size_t n = size_t(begin); n < size_t(end); ++n) {
      drift[n] = float(glm::length(followed(fields, points_lps_mm[n]) - points_lps_mm[n]));
    }
  });
  return spread_of(drift);
}

Result<Distances> cycle_drift(std::span<const Field> fields, const Grid& image, const Mask* mask) {
  if (mask && !same_geometry(mask->grid, image)) {
    return bad_input(
        "The mask and the image lie on different grids; use a mask of the image's grid.");
  }
  size_t voxels = image.count();
  if (mask) voxels -= size_t(std::count(mask->values.begin(), mask->values.end(), uint8_t(0)));
  const size_t every = std::max<size_t>(1, voxels / kPointsToFollow);
  std::vector<glm::dvec3> points;
  size_t seen = 0;
  for (int k = 0; k < image.size.z; ++k) {
    for (int j = 0; j < image.size.y; ++j) {
      for (int i = 0; i < image.size.x; ++i) {
        if (!counts(mask, image.offset(i, j, k)) || seen++ % every != 0) continue;
        points.push_back(image.lps_from_index({i, j, k}));
      }
    }
  }
  const Result<Spread> drift = cycle_drift_mm(fields, points);
  if (!drift) return drift.error();
  return in_voxels(*drift, image);
}

Result<double> low_confidence_share(const Confidence& confidence, const Mask* mask, double low) {
  const Volume values{confidence.grid, confidence.values};
  const Grid& grid = mask ? mask->grid : confidence.grid;
  const Volume fine = resampled(values, grid);
  size_t seen = 0;
  size_t below = 0;
  for (size_t offset = 0; offset < fine.values.size(); ++offset) {
    if (!counts(mask, offset)) continue;
    ++seen;
    below += !(double(fine.values[offset]) >= low);
  }
  if (seen == 0)
    return bad_input("The mask is empty, so there is no confidence to count; check it.");
  return double(below) / double(seen);
}

}  // namespace palpate
