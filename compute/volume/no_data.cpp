#include "compute/volume/no_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "compute/volume/portable.h"

namespace palpate {
namespace {

constexpr double kOnFaces = 0.5, kOnFacesAcross = 0.9;
constexpr double kFillsHull = 0.93;
constexpr double kOfTheGrid = 0.9;  // its extent along each axis
constexpr double kOpening = 1.5;    // samples
constexpr int kRim = 2;             // samples
constexpr int kHullSides = 300;  // planes that bound the hull: it is up to 0.2 % larger than exact

/// Calls work(offset, axis) for each sample on each face; a sample at an edge is on several.
template <class Work>
void on_faces(const Grid& grid, const Work& work) {
  const glm::ivec3 n = grid.size;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i) {
        // Inside a row only its ends are on a face.
        if (j > 0 && j < n.y - 1 && k > 0 && k < n.z - 1 && i == 1) i = n.x - 1;
        const glm::ivec3 at(i, j, k);
        for (int axis = 0; axis < 3; ++axis)
          if (at[axis] == 0 || at[axis] == n[axis] - 1) work(grid.offset(i, j, k), axis);
      }
}

/// Calls work(neighbour's offset) for the six neighbours.
template <class Work>
void beside(const Grid& grid, size_t at, const Work& work) {
  const glm::ivec3 n = grid.size;
  const size_t row = size_t(n.x), slice = row * size_t(n.y);
  const int i = int(at % row), j = int(at / row % size_t(n.y)), k = int(at / slice);
  if (i > 0) work(at - 1);
  if (i + 1 < n.x) work(at + 1);
  if (j > 0) work(at - row);
  if (j + 1 < n.y) work(at + row);
  if (k > 0) work(at - slice);
  if (k + 1 < n.z) work(at + slice);
}

/// What counts within kOpening samples of one that does not, no longer counts (grow: the other way
/// round). Beyond the grid nothing changes it.
std::vector<uint8_t> by_a_ball(const Grid& grid, const std::vector<uint8_t>& from, bool grow) {
  std::vector<uint8_t> to = from;
  const glm::ivec3 n = grid.size;
  const int reach = int(kOpening);
  size_t v = 0;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i, ++v) {
        if (bool(from[v]) == grow) continue;
        for (int dk = -reach; dk <= reach && bool(to[v]) != grow; ++dk)
          for (int dj = -reach; dj <= reach && bool(to[v]) != grow; ++dj)
            for (int di = -reach; di <= reach; ++di) {
              const glm::ivec3 x(i + di, j + dj, k + dk);
              if (di * di + dj * dj + dk * dk > kOpening * kOpening ||
                  glm::any(glm::lessThan(x, glm::ivec3(0))) ||
                  glm::any(glm::greaterThanEqual(x, n)))
                continue;
              if (bool(from[grid.offset(x.x, x.y, x.z)]) == grow) {
                to[v] = grow;
                break;
              }
            }
      }
  return to;
}

/// The samples in the convex hull of those that count, which is bounded by planes in many
/// directions.
std::vector<uint8_t> hull_of(const Grid& grid, const std::vector<uint8_t>& counts) {
  const glm::ivec3 n = grid.size;
  // Evenly spread directions (a spherical spiral), in samples: a hull does not depend on spacing.
  std::array<glm::dvec3, kHullSides> sides;
  std::array<double, kHullSides> most;
  const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (size_t d = 0; d < kHullSides; ++d) {
    const double z = 1.0 - 2.0 * (double(d) + 0.5) / kHullSides, r = std::sqrt(1.0 - z * z);
    sides[d] = {r * portable::cos(turn * double(d)), r * portable::sin(turn * double(d)), z};
    most[d] = -std::numeric_limits<double>::infinity();
  }
  // Only the first and the last sample of a row can touch a plane.
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j) {
      const auto row = counts.begin() + ptrdiff_t(grid.offset(0, j, k));
      const auto first = std::find(row, row + n.x, 1);
      if (first == row + n.x) continue;
      int last = n.x - 1;
      while (!row[last]) --last;
      for (size_t d = 0; d < kHullSides; ++d) {
        const double rest = sides[d].y * j + sides[d].z * k;
        most[d] =
            std::max({most[d], rest + sides[d].x * double(first - row), rest + sides[d].x * last});
      }
    }
  // The part of each row behind all planes.
  std::vector<uint8_t> hull(counts.size(), 0);
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j) {
      double low = 0.0, high = n.x - 1.0;
      for (size_t d = 0; d < kHullSides && low <= high; ++d) {
        const double left = most[d] + 1e-9 - sides[d].y * j - sides[d].z * k;
        if (sides[d].x > 1e-12)
          high = std::min(high, left / sides[d].x);
        else if (sides[d].x < -1e-12)
          low = std::max(low, left / sides[d].x);
        else if (left < 0.0)
          high = -1.0;
      }
      for (int i = int(std::ceil(low)); i <= int(std::floor(high)); ++i)
        hull[grid.offset(i, j, k)] = 1;
    }
  return hull;
}

float most_frequent_on_faces(const Volume& frame) {
  std::vector<float> values;
  on_faces(frame.grid, [&](size_t v, int) { values.push_back(frame.values[v]); });
  std::sort(values.begin(), values.end());
  float most = 0.0F;
  std::ptrdiff_t longest = 0;
  for (auto run = values.begin(); run != values.end();) {
    const auto end = std::upper_bound(run, values.end(), *run);
    if (end - run > longest) {
      longest = end - run;
      most = *run;
    }
    run = end;
  }
  return most;
}

/// Whether what counts goes from end to end of the grid, but for a few samples.
bool spans_grid(const Grid& grid, const std::vector<uint8_t>& counts) {
  const glm::ivec3 n = grid.size;
  glm::ivec3 low = n, high(-1);
  size_t v = 0;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i, ++v)
        if (counts[v]) {
          low = glm::min(low, glm::ivec3(i, j, k));
          high = glm::max(high, glm::ivec3(i, j, k));
        }
  return glm::all(glm::greaterThanEqual(glm::dvec3(high - low + 1), kOfTheGrid * glm::dvec3(n)));
}

}  // namespace

void NoDataFinder::add(const Volume& frame) {
  if (constant_.empty()) {
    grid_ = frame.grid;
    value_ = most_frequent_on_faces(frame);
    constant_.assign(frame.values.size(), 1);
  }
  for (size_t v = 0; v < constant_.size(); ++v)
    constant_[v] = constant_[v] && frame.values[v] == value_;
}

std::optional<Mask> NoDataFinder::found() const {
  if (constant_.empty()) return std::nullopt;
  std::array<size_t, 3> on{}, all{};
  on_faces(grid_, [&](size_t v, int axis) {
    ++all[size_t(axis)];
    on[size_t(axis)] += constant_[v];
  });
  int across = 0;
  for (size_t axis = 0; axis < 3; ++axis)
    across += double(on[axis]) >= kOnFacesAcross * double(all[axis]);
  if (double(on[0] + on[1] + on[2]) < kOnFaces * double(all[0] + all[1] + all[2]) && across < 2)
    return std::nullopt;

  // What is connected to the faces, when opened: of the hull it takes what is no dark tissue.
  const std::vector<uint8_t> open = by_a_ball(grid_, by_a_ball(grid_, constant_, false), true);
  std::vector<uint8_t> outside(open.size(), 0);
  std::vector<size_t> next;
  const auto reach = [&](size_t v) {
    if (!open[v] || !constant_[v] || outside[v]) return;
    outside[v] = 1;
    next.push_back(v);
  };
  on_faces(grid_, [&](size_t v, int) { reach(v); });
  while (!next.empty()) {
    const size_t v = next.back();
    next.pop_back();
    beside(grid_, v, reach);
  }

  // All that is outside the hull of all others.
  std::vector<uint8_t> differs(constant_.size());
  std::transform(constant_.begin(), constant_.end(), differs.begin(), [](uint8_t c) { return !c; });
  const std::vector<uint8_t> hull = hull_of(grid_, differs);
  if (!spans_grid(grid_, differs)) return std::nullopt;
  size_t in_hull = 0, filled = 0, found = 0;
  Mask no_data{grid_, std::vector<uint8_t>(hull.size())};
  for (size_t v = 0; v < hull.size(); ++v) {
    in_hull += hull[v];
    filled += hull[v] && !outside[v];
    no_data.values[v] = constant_[v] && !hull[v];
    found += no_data.values[v];
  }
  if (found == 0 || in_hull == 0 || double(filled) < kFillsHull * double(in_hull))
    return std::nullopt;

  for (int n = 0; n < kRim; ++n) {
    const std::vector<uint8_t> before = no_data.values;
    for (size_t v = 0; v < before.size(); ++v)
      if (before[v]) beside(grid_, v, [&](size_t to) { no_data.values[to] = 1; });
  }
  return no_data;
}

double share_of(const Mask& mask) {
  const auto counts = std::count_if(mask.values.begin(), mask.values.end(),
                                    [](uint8_t value) { return value != 0; });
  return mask.values.empty() ? 0.0 : double(counts) / double(mask.values.size());
}

void continue_into(Volume& frame, const Mask& no_data) {
  std::vector<uint8_t> known(no_data.values.size());
  std::vector<size_t> front, next;
  for (size_t v = 0; v < known.size(); ++v) {
    known[v] = !no_data.values[v];
    if (!known[v]) continue;
    bool is_last = false;
    beside(frame.grid, v, [&](size_t to) { is_last |= no_data.values[to] != 0; });
    if (is_last) front.push_back(v);
  }
  while (!front.empty()) {
    for (const size_t v : front)
      beside(frame.grid, v, [&](size_t to) {
        if (known[to]) return;
        known[to] = 1;
        frame.values[to] = frame.values[v];
        next.push_back(to);
      });
    front.swap(next);
    next.clear();
  }
}

}  // namespace palpate
