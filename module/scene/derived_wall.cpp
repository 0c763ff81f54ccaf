#include "module/scene/derived_wall.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "compute/volume/parallel.h"
#include "compute/volume/signed_distance.h"

namespace palpate {
namespace {

constexpr std::array kSmooth_mm{1.0, 2.0, 3.0, 4.0};
constexpr double kFewEnds = 0.1;
constexpr double kQualityShare = 0.67;  // of half_mm, which is for 3 N: for 2 N
constexpr double kThinShare = 0.5;      // of half_mm: for 1.5 N
constexpr double kSmallest_mm = 10.0;   // edge of a cube as large as the pieces and holes that stay
constexpr double kFar_mm = 3.0;         // from a ridge
constexpr double kSide = 0.003;  // weight of the side of the iso_value beside that of a ridge
constexpr int kMargin = 8;       // voxels beyond the ends of the data
constexpr double kLargestBall_mm = 8.0;  // what is larger is anatomy
constexpr double kClosing = 1.5;         // radius of the closing ball, of that of the opening one
constexpr double kRegionLeft = 0.5;      // of a region, at least, behind its opening
constexpr double kSmallerBall = 0.7;     // where less is left
constexpr int kBalls = 5;

/// Turns the pieces (6 neighbours) of the voxels that are `of` into the other, where they have
/// fewer voxels than that.
void drop_small(Mask& mask, bool of, size_t fewest) {
  const glm::ivec3 n = mask.grid.size;
  const size_t row = size_t(n.x), slice = row * size_t(n.y);
  std::vector<uint8_t> seen(mask.values.size(), 0);
  std::vector<size_t> piece;
  for (size_t start = 0; start < seen.size(); ++start) {
    if (seen[start] || bool(mask.values[start]) != of) continue;
    piece.assign(1, start);
    seen[start] = 1;
    for (size_t next = 0; next < piece.size(); ++next) {
      const size_t at = piece[next];
      const auto look = [&](bool is_there, size_t to) {
        if (!is_there || seen[to] || bool(mask.values[to]) != of) return;
        seen[to] = 1;
        piece.push_back(to);
      };
      const int i = int(at % row), j = int(at / row % size_t(n.y)), k = int(at / slice);
      look(i > 0, at - 1), look(i + 1 < n.x, at + 1);
      look(j > 0, at - row), look(j + 1 < n.y, at + row);
      look(k > 0, at - slice), look(k + 1 < n.z, at + slice);
    }
    if (piece.size() >= fewest) continue;
    for (const size_t at : piece) mask.values[at] = !of;
  }
}

/// The smooth distance to the border of the mask as if it went on beyond the ends of its grid, from
/// the grid's first sample to its last.
Volume distance_without_ends(const Mask& mask) {
  Mask wider{mask.grid, {}};
  wider.grid.size += 2 * kMargin;
  wider.grid.origin_mm = mask.grid.lps_from_index(glm::dvec3(-kMargin));
  wider.values.resize(wider.grid.count());
  size_t v = 0;
  for (int k = 0; k < wider.grid.size.z; ++k)
    for (int j = 0; j < wider.grid.size.y; ++j)
      for (int i = 0; i < wider.grid.size.x; ++i, ++v) {
        const glm::ivec3 from =
            glm::clamp(glm::ivec3(i, j, k) - kMargin, glm::ivec3(0), mask.grid.size - 1);
        wider.values[v] = mask.values[mask.grid.offset(from.x, from.y, from.z)];
      }
  const Volume around = signed_distance(wider);
  // Its samples are those of the mask's grid, and more between thick slices.
  Grid grid = mask.grid;
  grid.spacing_mm = around.grid.spacing_mm;
  grid.size = glm::ivec3(glm::round(glm::dvec3(mask.grid.size - 1) * mask.grid.spacing_mm /
                                    grid.spacing_mm)) +
              1;
  return resampled(around, grid);
}

/// What is within a radius of the voxels that are `of` becomes so, too. Nothing comes in from
/// beyond the grid.
Mask grown(Mask mask, bool of, double radius_mm) {
  if (!of)
    for (uint8_t& value : mask.values) value = !value;
  const Volume distance = exact_signed_distance(mask);
  for (size_t v = 0; v < mask.values.size(); ++v)
    mask.values[v] = (distance.values[v] > -float(radius_mm)) == of;
  return mask;
}

size_t voxels_of(const Mask& mask) {
  return size_t(std::count_if(mask.values.begin(), mask.values.end(),
                              [](uint8_t value) { return value != 0; }));
}

/// The region closed and opened by the largest balls that leave enough of it. Sets their radii.
Mask without_notches(const Mask& region, double half_mm, DerivedWall& wall) {
  for (int n = 0; n < kBalls && half_mm > 0.0; ++n, half_mm *= kSmallerBall) {
    const Mask closed = grown(grown(region, true, kClosing * half_mm), false, kClosing * half_mm);
    Mask opened = grown(grown(closed, false, half_mm), true, half_mm);
    if (double(voxels_of(opened)) < kRegionLeft * double(voxels_of(closed))) continue;
    wall.closed_mm = kClosing * half_mm;
    wall.opened_mm = half_mm;
    return opened;
  }
  return region;
}

std::optional<DerivedWall> region_at(const Volume& soft, double half_mm, double iso_value,
                                     double smooth_mm) {
  Mask region{soft.grid, std::vector<uint8_t>(soft.values.size())};
  std::transform(soft.values.begin(), soft.values.end(), region.values.begin(),
                 [&](float value) { return value > iso_value; });
  const glm::dvec3 h = soft.grid.spacing_mm;
  const double smallest_mm = kSmallest_mm * wall_scale(soft.grid);
  const size_t fewest =
      size_t(std::ceil(smallest_mm * smallest_mm * smallest_mm / (h.x * h.y * h.z)));
  const auto without_small = [&] {
    drop_small(region, true, fewest);
    drop_small(region, false, fewest);
    const auto [low, high] = std::minmax_element(region.values.begin(), region.values.end());
    return *low != *high;
  };
  if (!without_small()) return std::nullopt;
  DerivedWall wall;
  wall.iso_value = iso_value;
  wall.smooth_mm = smooth_mm;
  region = without_notches(region, half_mm, wall);
  if (!without_small()) return std::nullopt;
  wall.distance_mm = distance_without_ends(region);
  return wall;
}

/// d of ridge_wall() and how much it counts, for each voxel.
struct Ridges {
  std::vector<float> distance_mm, weight;
};

Ridges ridges_of(const Volume& soft, double smooth_mm) {
  const Grid& grid = soft.grid;
  const glm::ivec3 n = grid.size;
  const glm::dvec3 h = grid.spacing_mm;
  const double blur_mm2 = smooth_mm * smooth_mm + grid.finest_mm() * grid.finest_mm();
  const double far_mm = kFar_mm * wall_scale(grid);
  Ridges ridges{std::vector<float>(grid.count()), std::vector<float>(grid.count())};
  const auto at = [&](glm::ivec3 x) {
    x = glm::clamp(x, glm::ivec3(0), n - 1);
    return double(soft.values[grid.offset(x.x, x.y, x.z)]);
  };
  parallel_ranges(n.z, 300.0 * n.x * n.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < n.y; ++j)
        for (int i = 0; i < n.x; ++i) {
          const glm::ivec3 x(i, j, k);
          glm::dvec3 slope;
          glm::dmat3 bend;
          for (int a = 0; a < 3; ++a) {
            glm::ivec3 along(0);
            along[a] = 1;
            const double more = at(x + along), less = at(x - along);
            slope[a] = (more - less) / (2.0 * h[a]);
            bend[a][a] = (more + less - 2.0 * at(x)) / (h[a] * h[a]);
            for (int b = 0; b < a; ++b) {
              glm::ivec3 across(0);
              across[b] = 1;
              bend[a][b] = bend[b][a] = (at(x + along + across) - at(x + along - across) -
                                         at(x - along + across) + at(x - along - across)) /
                                        (4.0 * h[a] * h[b]);
            }
          }
          const double steep2 = glm::dot(slope, slope);
          if (!(steep2 > 0.0)) continue;
          const double d = -blur_mm2 * glm::dot(slope, bend * slope) / (steep2 * std::sqrt(steep2));
          if (std::abs(d) > far_mm) continue;
          const size_t v = grid.offset(i, j, k);
          ridges.distance_mm[v] = float(d);
          ridges.weight[v] = float(steep2);
        }
  });
  std::vector<float> sorted = ridges.weight;
  const auto strong = sorted.begin() + ptrdiff_t(0.9 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), strong, sorted.end());
  const float full = std::max(*strong, 1e-30F);
  for (float& w : ridges.weight) w = std::min(1.0F, w / full);
  return ridges;
}

/// The f that makes the sum of weight (f - wanted)^2 + reach^2 |grad f|^2 least, by Gauss-Seidel
/// over the two colours of a checkerboard, with over-relaxation. It starts at what is wanted.
void join(std::vector<float>& f, const Grid& grid, const std::vector<float>& weight,
          double reach_mm) {
  constexpr int kSweeps = 60;
  constexpr float kOver = 1.7F;
  const std::vector<float> wanted = f;
  const glm::ivec3 n = grid.size;
  const size_t row = size_t(n.x), slice = row * size_t(n.y);
  const glm::vec3 c = reach_mm * reach_mm / (grid.spacing_mm * grid.spacing_mm);
  for (int half = 0; half < 2 * kSweeps; ++half)
    parallel_ranges(n.z, 10.0 * n.x * n.y, [&](int begin, int end) {
      for (int k = begin; k < end; ++k)
        for (int j = 0; j < n.y; ++j)
          for (int i = (j + k + half) & 1; i < n.x; i += 2) {
            const size_t v = grid.offset(i, j, k);
            float sum = weight[v] * wanted[v], all = weight[v];
            const auto add = [&](bool is_there, size_t to, float by) {
              if (!is_there) return;
              sum += by * f[to];
              all += by;
            };
            add(i > 0, v - 1, c.x), add(i + 1 < n.x, v + 1, c.x);
            add(j > 0, v - row, c.y), add(j + 1 < n.y, v + row, c.y);
            add(k > 0, v - slice, c.z), add(k + 1 < n.z, v + slice, c.z);
            f[v] += kOver * (sum / all - f[v]);
          }
    });
}

std::optional<DerivedWall> ridges_at(const Volume& soft, double /*half_mm*/, double iso_value,
                                     double smooth_mm) {
  const auto [low, high] = std::minmax_element(soft.values.begin(), soft.values.end());
  if (*low == *high) return std::nullopt;
  Ridges ridges = ridges_of(soft, smooth_mm);
  const double scale = wall_scale(soft.grid), far_mm = kFar_mm * scale;
  for (size_t v = 0; v < soft.values.size(); ++v) {
    const double side_mm = soft.values[v] > iso_value ? far_mm : -far_mm;
    float &d = ridges.distance_mm[v], &w = ridges.weight[v];
    d = float((w * d + kSide * side_mm) / (w + kSide));
    w += float(kSide);
  }
  join(ridges.distance_mm, soft.grid, ridges.weight, scale);
  DerivedWall wall;
  wall.distance_mm = {soft.grid, std::move(ridges.distance_mm)};
  wall.iso_value = iso_value;
  wall.smooth_mm = smooth_mm;
  return wall;
}

using At = std::optional<DerivedWall> (*)(const Volume& soft, double half_mm, double iso_value,
                                          double smooth_mm);

std::optional<DerivedWall> best_of(const Volume& frame, double half_mm,
                                   std::optional<double> iso_value, std::optional<double> smooth_mm,
                                   At at, double depth_mm) {
  std::optional<DerivedWall> best;
  for (const double usual_mm : kSmooth_mm) {
    const double sigma_mm = smooth_mm.value_or(usual_mm * wall_scale(frame.grid));
    const Volume soft = smoothed(frame, sigma_mm);
    std::optional<DerivedWall> wall =
        at(soft, half_mm, iso_value ? *iso_value : wall_of(soft).at.iso_value, sigma_mm);
    if (!wall) break;  // a stronger one only blurs what is too small
    wall->ends = wall_quality(wall->distance_mm, {0.0, 1.0}, depth_mm).ends;
    if (!best || wall->ends < best->ends) best = std::move(wall);
    if (smooth_mm || best->ends <= kFewEnds) break;
  }
  return best;
}

}  // namespace

std::optional<DerivedWall> region_wall(const Volume& frame, double half_mm,
                                       std::optional<double> iso_value,
                                       std::optional<double> smooth_mm) {
  half_mm = std::min(half_mm, kLargestBall_mm);
  return best_of(frame, half_mm, iso_value, smooth_mm, region_at, kQualityShare * half_mm);
}

std::optional<DerivedWall> ridge_wall(const Volume& frame, double half_mm,
                                      std::optional<double> iso_value,
                                      std::optional<double> smooth_mm) {
  // Its distance ends kFar_mm behind the border.
  return best_of(frame, half_mm, iso_value, smooth_mm, ridges_at, 0.0);
}

double thin_share(const Volume& frame, double iso_value, double half_mm) {
  Mask brighter{frame.grid, std::vector<uint8_t>(frame.values.size())};
  std::transform(frame.values.begin(), frame.values.end(), brighter.values.begin(),
                 [&](float value) { return value > iso_value; });
  return wall_quality(distance_without_ends(brighter), {0.0, 1.0}, kThinShare * half_mm).ends;
}

}  // namespace palpate
