#include "module/scene/wall_value.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "compute/volume/portable.h"

namespace palpate {

namespace {

constexpr int kPlaces = 800;  // of a surface that are looked at
// Times wall_scale():
constexpr double kAside_mm = 5.0;   // that a hand moves
constexpr double kAcross_mm = 4.0;  // before and behind, where the surface may be there
constexpr double kSample_mm = 0.5;  // between two looks
constexpr double kLarge_mm = 100.0;
constexpr int kDirections = 8;

struct Groups {
  WallValue otsu;
  double lower = 0.0, upper = 0.0;  // mean values
};

Groups groups_of(const Volume& frame);

/// Whether the values rise over `iso_value` on the line from `from` along `way`, LPS mm, and behind
/// it over `deep`.
bool rises(const Volume& frame, double iso_value, double deep, glm::dvec3 from, glm::dvec3 way) {
  const int samples = int(std::ceil(glm::length(way) / (kSample_mm * wall_scale(frame.grid))));
  bool is_low = false, has_risen = false;
  for (int n = 0; n <= samples; ++n) {
    const glm::dvec3 index = frame.grid.index_from_lps(from + way * (double(n) / samples));
    const double value = sample(frame, index);
    const bool is_high = value > iso_value;
    has_risen = is_high && (has_risen || is_low);
    if (has_risen && value > deep) return true;
    is_low = !is_high;
  }
  return false;
}

/// Places on an iso-surface, in samples: where neighbours along an axis lie on either side of the
/// iso-value, evenly thinned out.
std::vector<glm::dvec3> places_at(const Volume& frame, double iso_value) {
  struct Crossing {
    size_t from;
    int axis;
  };
  std::vector<Crossing> crossings;
  const glm::ivec3 n = frame.grid.size;
  const std::array<size_t, 3> stride{1, size_t(n.x), size_t(n.x) * size_t(n.y)};
  size_t v = 0;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i, ++v) {
        const bool is_high = frame.values[v] > iso_value;
        const auto look = [&](bool is_there, int axis) {
          if (is_there && (frame.values[v + stride[size_t(axis)]] > iso_value) != is_high)
            crossings.push_back({v, axis});
        };
        look(i + 1 < n.x, 0), look(j + 1 < n.y, 1), look(k + 1 < n.z, 2);
      }
  std::vector<glm::dvec3> places;
  const size_t every = 1 + crossings.size() / kPlaces;
  for (size_t c = 0; c < crossings.size(); c += every) {
    const auto [from, axis] = crossings[c];
    const double a = frame.values[from], b = frame.values[from + stride[size_t(axis)]];
    glm::dvec3 place(double(from % stride[1]), double(from / stride[1] % size_t(n.y)),
                     double(from / stride[2]));
    place[axis] += (iso_value - a) / (b - a);
    places.push_back(place);
  }
  return places;
}

}  // namespace

WallValue value_between_groups(const Volume& frame, double below) {
  Volume darker;
  std::copy_if(frame.values.begin(), frame.values.end(), std::back_inserter(darker.values),
               [&](float value) { return value < below; });
  darker.grid.size = {int(darker.values.size()), 1, 1};
  return darker.values.empty() ? value_between_groups(frame) : value_between_groups(darker);
}

double wall_scale(const Grid& grid) {
  const glm::dvec3 edges_mm = glm::dvec3(grid.size) * grid.spacing_mm;
  return std::min(1.0, std::max({edges_mm.x, edges_mm.y, edges_mm.z}) / kLarge_mm);
}

WallValue value_between_groups(const Volume& frame) {
  return groups_of(frame).otsu;
}

WallQuality wall_quality(const Volume& frame, WallValue at, double deeper) {
  const Grid& grid = frame.grid;
  const std::vector<glm::dvec3> places = places_at(frame, at.iso_value);
  const double scale = wall_scale(grid);
  WallQuality quality{at, 0.0, 1.0, kAside_mm * scale};
  if (places.empty()) return quality;
  const double h_mm = grid.finest_mm();
  int looked = 0, lost = 0;
  for (const glm::dvec3& index : places) {
    const glm::dvec3 place = grid.lps_from_index(index);
    glm::dvec3 slope(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 step(0.0);
      step[axis] = h_mm;
      slope[axis] = (sample(frame, grid.index_from_lps(place + step)) -
                     sample(frame, grid.index_from_lps(place - step))) /
                    (2.0 * h_mm);
    }
    const double steepness = glm::length(slope);
    if (!(steepness > 0.0)) continue;
    quality.slope_per_mm += steepness;
    const glm::dvec3 in = slope / steepness;
    const glm::dvec3 along = glm::normalize(
        glm::cross(in, std::abs(in.z) < 0.8 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
    const glm::dvec3 across = glm::cross(in, along);
    for (int d = 0; d < kDirections; ++d) {
      const double angle = 2.0 * std::numbers::pi * d / kDirections;
      const glm::dvec3 aside =
          place + quality.aside_mm * (portable::cos(angle) * along + portable::sin(angle) * across);
      // Beyond the data nobody feels.
      const glm::dvec3 there = grid.index_from_lps(aside);
      if (glm::any(glm::lessThan(there, glm::dvec3(0.0))) ||
          glm::any(glm::greaterThan(there, glm::dvec3(grid.size - 1))))
        continue;
      ++looked;
      lost += !rises(frame, at.iso_value, at.iso_value + deeper, aside - kAcross_mm * scale * in,
                     (2.0 * kAcross_mm * scale + deeper) * in);
    }
  }
  quality.slope_per_mm /= double(places.size());
  quality.ends = looked > 0 ? double(lost) / looked : 1.0;
  return quality;
}

WallQuality wall_of(const Volume& frame) {
  constexpr int kIsoValues = 8;
  constexpr double kGood = 0.05, kAsGood = 0.03;
  const Groups groups = groups_of(frame);
  const WallQuality otsu = wall_quality(frame, groups.otsu);
  if (otsu.ends <= kGood) return otsu;
  std::vector<WallQuality> walls = {otsu};
  double least = otsu.ends;
  for (int n = 1; n < kIsoValues; ++n) {
    const double iso_value = groups.lower + (groups.upper - groups.lower) * n / kIsoValues;
    walls.push_back(wall_quality(frame, {iso_value, groups.otsu.width}));
    least = std::min(least, walls.back().ends);
  }
  const auto is_good = [&](const WallQuality& w) { return w.ends <= least + kAsGood; };
  if (is_good(otsu)) return otsu;
  WallQuality best = otsu;
  for (const WallQuality& wall : walls)
    if (is_good(wall) && (!is_good(best) || wall.slope_per_mm > best.slope_per_mm)) best = wall;
  return best;
}

namespace {

Groups groups_of(const Volume& frame) {
  const auto [low, high] = std::minmax_element(frame.values.begin(), frame.values.end());
  if (low == frame.values.end() || !(*high > *low))
    return {{frame.values.empty() ? 0.0 : double(*low), 0.0}, 0.0, 0.0};
  constexpr int kBins = 512;
  std::array<double, kBins> bins{};
  const double first = *low, width = (double(*high) - first) / kBins;
  for (const float value : frame.values)
    bins[size_t(std::clamp(int((value - first) / width), 0, kBins - 1))] += 1.0;
  double all = 0.0, sum = 0.0;
  for (int b = 0; b < kBins; ++b) all += bins[size_t(b)], sum += bins[size_t(b)] * b;
  double below = 0.0, sum_below = 0.0, best = -1.0;
  Groups found;
  for (int b = 0; b + 1 < kBins; ++b) {
    below += bins[size_t(b)];
    sum_below += bins[size_t(b)] * b;
    if (below == 0.0 || below == all) continue;
    const double mean_below = sum_below / below;
    const double mean_above = (sum - sum_below) / (all - below);
    const double between =
        below * (all - below) * (mean_above - mean_below) * (mean_above - mean_below);
    if (between <= best) continue;
    best = between;
    found.otsu.iso_value = first + width * 0.5 * (mean_below + mean_above + 1.0);
    found.otsu.width = 0.25 * width * (mean_above - mean_below);
    found.lower = first + width * (mean_below + 0.5);
    found.upper = first + width * (mean_above + 0.5);
  }
  return found;
}

}  // namespace

}  // namespace palpate
