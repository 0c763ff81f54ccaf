#include "compute/volume/sheet_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

#include "compute/volume/parallel.h"
#include "compute/volume/portable.h"

namespace palpate {
namespace {

// Lengths here are in voxels (of the mask's grid, along each axis).

// SD of the weights of the voxels to which a plane is fitted, and how far away they count.
constexpr double kSpread = 1.1;
constexpr int kReach = 3;
// Sheets that are a smaller share of the voxels that count are left to the plain distance.
constexpr double kLeastShare = 0.1;
// What counts in favour of the plain distance where nothing is near: so sheets end smoothly.
constexpr double kFar = 0.1;
// The variance across the plane over the smaller one along it, up to which voxels are a sheet, and
// from which on they are not.
constexpr double kFlat = 0.3, kNotFlat = 0.6;
// Of the voxels per area of a whole sheet: below kWhole it becomes thinner, at kHole it ends.
constexpr double kWhole = 0.5, kHole = 0.36;
// A plate is at most this thick; what is thicker has a plain distance that is as good.
constexpr double kThickest = 1.7;
// On either side of a plate: makes up for what samples half a voxel apart miss of its ridge.
constexpr double kForRidge = 0.08;

enum class Kind : uint8_t { kNothing, kBody, kSheet };

/// What is at each voxel: thick parts are those that cubes of 2 x 2 x 2 voxels cover.
std::vector<Kind> kinds_of(const Mask& mask) {
  const glm::ivec3 n = mask.grid.size;
  std::vector<Kind> kinds(mask.values.size());
  for (size_t i = 0; i < kinds.size(); ++i)
    kinds[i] = mask.values[i] ? Kind::kSheet : Kind::kNothing;
  for (int k = 0; k + 1 < n.z; ++k)
    for (int j = 0; j + 1 < n.y; ++j)
      for (int i = 0; i + 1 < n.x; ++i) {
        std::array<size_t, 8> corners;
        for (int c = 0; c < 8; ++c)
          corners[size_t(c)] = mask.grid.offset(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        if (std::all_of(corners.begin(), corners.end(),
                        [&](size_t at) { return mask.values[at] != 0; }))
          for (const size_t at : corners) kinds[at] = Kind::kBody;
      }
  return kinds;
}

/// The direction in which a symmetric matrix, positive semidefinite, is smallest. The powers of its
/// adjugate converge to the projection onto it.
glm::dvec3 smallest_direction(const glm::dmat3& m) {
  glm::dmat3 power(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
  for (int squared = 0; squared < 4; ++squared) {
    const double trace = power[0][0] + power[1][1] + power[2][2];
    if (!(trace > 0.0)) return glm::dvec3(0.0);
    power *= 1.0 / trace;
    power = power * power;
  }
  int longest = 0;
  for (int a = 1; a < 3; ++a)
    if (power[a][a] > power[longest][longest]) longest = a;
  const double length = glm::length(power[longest]);
  return length > 0.0 ? power[longest] / length : glm::dvec3(0.0);
}

/// A plate near a place.
struct Plate {
  double depth = 0.0;  ///< distance to its border, above 0 inside, voxels along its normal
  double share = 0.0;  ///< of the place that is its own, 0 to 1
  glm::dvec3 normal{0.0};
};

class Sheets {
 public:
  explicit Sheets(const Mask& mask) : size_(mask.grid.size), kinds_(kinds_of(mask)) {}

  /// The plate near an index.
  Plate at(glm::dvec3 index) const {
    const glm::ivec3 nearest(glm::round(index));
    const glm::ivec3 low = glm::max(nearest - kReach, glm::ivec3(0));
    const glm::ivec3 high = glm::min(nearest + kReach, size_ - 1);
    std::array<std::array<double, 2 * kReach + 1>, 3> weights;
    for (int a = 0; a < 3; ++a)
      for (int d = low[a]; d <= high[a]; ++d) {
        const double away = (d - index[a]) / kSpread;
        weights[size_t(a)][size_t(d - low[a])] = portable::exp(-0.5 * away * away);
      }
    double thin = 0.0, thick = 0.0;
    glm::dvec3 sum(0.0);
    glm::dmat3 squares(0.0);
    for (int k = low.z; k <= high.z; ++k)
      for (int j = low.y; j <= high.y; ++j) {
        const Kind* const row = &kinds_[offset({0, j, k})];
        const double of_row = weights[1][size_t(j - low.y)] * weights[2][size_t(k - low.z)];
        for (int i = low.x; i <= high.x; ++i) {
          if (row[i] == Kind::kNothing) continue;
          const double w = of_row * weights[0][size_t(i - low.x)];
          if (row[i] == Kind::kBody) {
            thick += w;
            continue;
          }
          const glm::dvec3 away = glm::dvec3(i, j, k) - index;
          thin += w;
          sum += w * away;
          squares += glm::outerProduct(w * away, away);
        }
      }
    Plate plate;
    if (!(thin > 0.0)) return plate;
    const glm::dvec3 middle = sum / thin;
    const glm::dmat3 spread = squares / thin - glm::outerProduct(middle, middle);
    plate.normal = smallest_direction(spread);
    // The variances across the plane and along it.
    const double across = glm::dot(plate.normal, spread * plate.normal);
    const double both = spread[0][0] + spread[1][1] + spread[2][2] - across;
    const double product = glm::dot(
        plate.normal, glm::dmat3(glm::cross(spread[1], spread[2]), glm::cross(spread[2], spread[0]),
                                 glm::cross(spread[0], spread[1])) *
                          plate.normal);
    const double along =
        0.5 * (both - std::sqrt(std::max(0.0, both * both - 4.0 * std::max(product, 0.0))));
    if (!(along > 0.0)) return plate;
    const double sure = std::clamp((kNotFlat - across / along) / (kNotFlat - kFlat), 0.0, 1.0);
    plate.share = sure * thin / (thin + thick + kFar);

    // Voxels per area of the plane, and what they are where one voxel lies on each line.
    const double off = std::abs(glm::dot(plate.normal, middle));
    const double per_area = thin / (glm::two_pi<double>() * kSpread * kSpread *
                                    portable::exp(-0.5 * off * off / (kSpread * kSpread)));
    const glm::dvec3 n = glm::abs(plate.normal);
    const double whole = per_area / std::max({n.x, n.y, n.z});
    const double half = 0.5 * std::clamp(per_area, 1.0, kThickest) + kForRidge;
    const double beside = half * std::clamp((kWhole - whole) / (kWhole - kHole), 0.0, 2.0);
    plate.depth = half - std::sqrt(off * off + beside * beside);
    return plate;
  }

  /// The share of the voxels that count in sheets.
  double share() const {
    std::vector<size_t> counted(size_t(size_.z)), in_sheets(size_t(size_.z));
    parallel_ranges(size_.z, 100.0 * size_.x * size_.y, [&](int begin, int end) {
      for (int k = begin; k < end; ++k)
        for (int j = 0; j < size_.y; ++j)
          for (int i = 0; i < size_.x; ++i) {
            const Kind kind = kinds_[offset({i, j, k})];
            counted[size_t(k)] += kind != Kind::kNothing;
            in_sheets[size_t(k)] += kind == Kind::kSheet && at({i, j, k}).share > 0.5;
          }
    });
    size_t all = 0, sheets = 0;
    for (size_t k = 0; k < counted.size(); ++k) {
      all += counted[k];
      sheets += in_sheets[k];
    }
    return all ? double(sheets) / double(all) : 0.0;
  }

 private:
  size_t offset(glm::ivec3 at) const {
    return size_t(at.x) + size_t(size_.x) * (size_t(at.y) + size_t(size_.y) * size_t(at.z));
  }
  glm::ivec3 size_;
  std::vector<Kind> kinds_;
};

/// Twice the samples along an axis: the cubic through the four nearest.
Volume doubled(const Volume& volume, int axis) {
  Volume out{volume.grid, {}};
  const glm::ivec3 from = volume.grid.size;
  out.grid.size[axis] = 2 * from[axis] - 1;
  out.grid.spacing_mm[axis] *= 0.5;
  out.values.resize(out.grid.count());
  parallel_ranges(out.grid.size.z, 10.0 * out.grid.size.x * out.grid.size.y,
                  [&](int begin, int end) {
                    for (int k = begin; k < end; ++k)
                      for (int j = 0; j < out.grid.size.y; ++j)
                        for (int i = 0; i < out.grid.size.x; ++i) {
                          glm::ivec3 at(i, j, k);
                          const int before = at[axis] / 2;
                          const auto sample = [&](int along) {
                            at[axis] = std::clamp(along, 0, from[axis] - 1);
                            return volume.at(at.x, at.y, at.z);
                          };
                          const bool between = at[axis] % 2;
                          out.values[out.grid.offset(i, j, k)] =
                              between ? 0.5625F * (sample(before) + sample(before + 1)) -
                                            0.0625F * (sample(before - 1) + sample(before + 2))
                                      : sample(before);
                        }
                  });
  return out;
}

}  // namespace

Volume with_sheets(const Mask& mask, Volume distance) {
  const glm::dvec3 n(2 * mask.grid.size - 1);
  if (n.x * n.y * n.z > double(kMostSheetSamples)) return distance;
  const Sheets sheets(mask);
  if (sheets.share() < kLeastShare) return distance;
  for (int axis = 0; axis < 3; ++axis) distance = doubled(distance, axis);
  const Grid& grid = distance.grid;
  const glm::dvec3 h = mask.grid.spacing_mm;
  parallel_ranges(grid.size.z, 1e3 * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          float& value = distance.values[grid.offset(i, j, k)];
          if (value < -float(kReach) * float(std::max({h.x, h.y, h.z}))) continue;
          const Plate plate = sheets.at(0.5 * glm::dvec3(i, j, k));
          if (plate.share > 0.0)
            value = std::lerp(value, float(plate.depth / glm::length(plate.normal / h)),
                              float(plate.share));
        }
  });
  return distance;
}

}  // namespace palpate
