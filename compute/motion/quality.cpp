#include "compute/motion/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "compute/volume/parallel.h"
#include "shaders/interface/motion.h"

namespace palpate {
namespace {

/// Enough points for percentiles: 2,500 lie above the 99th.
constexpr size_t kPoints = 250000;

Error bad_input(const char* message) {
  return {ErrorKind::kBadInput, message};
}

bool counts(const Mask* mask, size_t offset) {
  return !mask || mask->values[offset] != 0;
}

/// Every n-th sample of a grid that counts, so that kPoints to 2 kPoints remain.
std::vector<glm::ivec3> thinned(const Grid& grid, const Mask* mask) {
  size_t voxels = grid.count();
  if (mask) voxels -= size_t(std::count(mask->values.begin(), mask->values.end(), uint8_t(0)));
  const size_t every = std::max<size_t>(1, voxels / kPoints);
  std::vector<glm::ivec3> points;
  points.reserve(voxels / every + 1);
  size_t seen = 0, offset = 0;
  for (int k = 0; k < grid.size.z; ++k) {
    for (int j = 0; j < grid.size.y; ++j) {
      for (int i = 0; i < grid.size.x; ++i) {
        if (counts(mask, offset++) && seen++ % every == 0) points.emplace_back(i, j, k);
      }
    }
  }
  return points;
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

Distances distances_of(std::span<const glm::vec3> offsets_mm, const Grid& grid) {
  const glm::dmat3 axes_from_lps = glm::transpose(grid.direction);
  std::vector<float> mm(offsets_mm.size()), own(offsets_mm.size());
  for (size_t n = 0; n < offsets_mm.size(); ++n) {
    const glm::dvec3 offset(offsets_mm[n]);
    mm[n] = float(glm::length(offset));
    own[n] = float(glm::length(axes_from_lps * offset / grid.spacing_mm));
  }
  Distances distances;
  distances.mm = spread_of(mm);
  distances.own_voxels = spread_of(own);
  const double scale = 1.0 / grid.finest_mm();
  const Spread& s = distances.mm;
  distances.voxels = {s.count,       s.mean * scale, s.median * scale,
                      s.p95 * scale, s.p99 * scale,  s.max * scale};
  return distances;
}

Spread lengths_mm(const Field& u, const Mask* mask) {
  std::vector<float> lengths;
  lengths.reserve(u.u_mm.size());
  for (size_t n = 0; n < u.u_mm.size(); ++n)
    if (counts(mask, n)) lengths.push_back(glm::length(u.u_mm[n]));
  return spread_of(lengths);
}

Result<Distances> endpoint_error(const Field& u, const Field& truth, const Mask* mask) {
  const Grid& grid = truth.grid;
  if (mask && !same_geometry(mask->grid, grid)) {
    return bad_input(
        "The mask and the truth lie on different grids; use a mask of the truth's grid.");
  }
  const Field fine = resampled(u, grid);
  std::vector<glm::vec3> errors;
  for (size_t offset = 0; offset < fine.u_mm.size(); ++offset) {
    if (counts(mask, offset)) errors.push_back(fine.u_mm[offset] - truth.u_mm[offset]);
  }
  if (errors.empty())
    return bad_input("The mask is empty, so there is nothing to compare; check it.");
  return distances_of(errors, grid);
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
  const std::vector<glm::ivec3> points = thinned(image, mask);
  std::vector<glm::vec3> misses(points.size());
  std::vector<uint8_t> known(points.size());
  parallel_ranges(int(points.size()), 150.0, [&](int begin, int end) {
    for (auto n = size_t(begin); n < size_t(end); ++n) {
      const glm::dvec3 x_mm = image.lps_from_index(points[n]);
      const glm::dvec3 step = sample_at_lps(u, x_mm);
      const glm::dvec3 there = w.grid.index_from_lps(x_mm + step);
      // NaN has no place in the grid, but must reach the statistics.
      known[n] = glm::any(glm::isnan(step)) || inside(w.grid, there);
      misses[n] = glm::vec3(step + sample(w, there));
    }
  });
  size_t kept = 0;
  for (size_t n = 0; n < misses.size(); ++n)
    if (known[n]) misses[kept++] = misses[n];
  misses.resize(kept);
  if (misses.empty()) {
    return bad_input(
        "No point of the mask stays inside the backward field, so the two fields can not be "
        "compared; "
        "check that they belong to the same pair.");
  }
  return distances_of(misses, image);
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
  std::vector<float> drift;
  for (const glm::dvec3& start : points_lps_mm)
    drift.push_back(float(glm::length(followed(fields, start) - start)));
  return spread_of(drift);
}

CyclePoints::CyclePoints(const Grid& grid, const Mask* mask) : grid_(grid) {
  for (const glm::ivec3 index : thinned(grid, mask))
    start_mm_.push_back(grid.lps_from_index(index));
  now_mm_ = start_mm_;
}

void CyclePoints::follow(const Field& u) {
  parallel_ranges(int(now_mm_.size()), 150.0, [&](int begin, int end) {
    for (auto n = size_t(begin); n < size_t(end); ++n) now_mm_[n] += sample_at_lps(u, now_mm_[n]);
  });
}

Distances CyclePoints::drift() const {
  std::vector<glm::vec3> drift(start_mm_.size());
  for (size_t n = 0; n < drift.size(); ++n) drift[n] = glm::vec3(now_mm_[n] - start_mm_[n]);
  return distances_of(drift, grid_);
}

Result<Distances> cycle_drift(std::span<const Field> fields, const Grid& grid, const Mask* mask) {
  if (mask && !same_geometry(mask->grid, grid)) {
    return bad_input("The mask and the grid differ; use a mask on the grid of the points.");
  }
  CyclePoints points(grid, mask);
  for (const Field& field : fields) points.follow(field);
  const Distances drift = points.drift();
  if (fields.empty() || drift.mm.count == 0)
    return bad_input("Cycle drift needs the fields of a whole cycle and at least one point.");
  return drift;
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

double error_radius_mm(glm::dvec2 deviation_mm) {
  const glm::dvec2 squares = deviation_mm * deviation_mm;
  return double(shaders::kErrorRadius) * std::sqrt(squares.x + 2.0 * squares.y);
}

Result<double> error_radius_mm(const Deviation& deviation, const Mask* mask, double share) {
  // 1. The radius of each cell in the mask, to the power that the distribution has.
  constexpr double kTail = shaders::kErrorTail;
  const std::optional<Mask> cells =
      mask ? std::optional(resampled(*mask, deviation.grid)) : std::nullopt;
  std::vector<double> powers;
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (size_t i = 0; i < deviation.mm.size(); ++i) {
    if (cells && !cells->values[i]) continue;
    const double radius = error_radius_mm(glm::dvec2(deviation.mm[i]));
    least = std::min(least, radius);
    most = std::max(most, radius);
    powers.push_back(std::pow(radius, kTail));
  }
  if (powers.empty())
    return bad_input(
        "The mask contains no cell of the deviation, so there is no radius; check it.");

  // 2. By bisection of its logarithm: the radius at which the mean of P is the share.
  const double odds = share / (1.0 - share) / 19.0;
  double low = least * std::pow(odds, 1.0 / kTail), high = most * std::pow(odds, 1.0 / kTail);
  for (int step = 0; step < 24 && high > low; ++step) {
    const double middle = std::sqrt(low * high);
    const double scale = 1.0 / (19.0 * std::pow(middle, kTail));
    double sum = 0.0;
    for (const double power : powers) sum += 1.0 / (1.0 + scale * power);
    (sum < share * double(powers.size()) ? low : high) = middle;
  }
  return high;
}

}  // namespace palpate
