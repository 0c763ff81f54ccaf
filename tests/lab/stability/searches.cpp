#include "tests/lab/stability/searches.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

namespace palpate::stability {
namespace {

constexpr int kSearches = 2000;
// A point is right if it is this near to the target, in cells of the field.
constexpr double kRight_cells = 1e-3;
constexpr double kSliver = 0.05;

Grid field_grid() {
  Grid grid;
  grid.size = glm::ivec3(24);
  grid.origin_mm = glm::dvec3(-11.5);
  return grid;
}

/// Six waves of 4 mm and longer.
Field wavy_field(const Grid& grid, test::Random& random) {
  struct Wave {
    glm::dvec3 k, amplitude;
    double phase;
  };
  std::vector<Wave> waves;
  for (int w = 0; w < 6; ++w) {
    const double k = 2.0 * std::numbers::pi / random.draw(4.0, 24.0);
    const glm::dvec3 along = random.direction(), towards = random.direction();
    waves.push_back({k * along, towards / k, random.draw(0.0, 2.0 * std::numbers::pi)});
  }
  Field field = still_field(grid);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        glm::dvec3 u(0.0);
        for (const Wave& w : waves) u += w.amplitude * std::sin(glm::dot(w.k, x) + w.phase);
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(u);
      }
  return field;
}

/// Independent random vectors: the roughest field possible.
Field rough_field(const Grid& grid, test::Random& random) {
  Field field = still_field(grid);
  for (glm::vec3& u : field.u_mm) u = glm::vec3(random.vector(1.0));
  return field;
}

Field scaled(Field field, double factor) {
  for (glm::vec3& u : field.u_mm) u *= float(factor);
  return field;
}

/// Whether the determinant of the motion at x is above `least`.
bool upright(const MotionMap& map, double phase, glm::dvec3 x, double least) {
  return glm::determinant(glm::dmat3(1.0) + phase * map.sample(x).jacobian) > least;
}

/// No fold on the straight way from a to b: beyond a fold there is other material, however well it
/// fits. (Beyond the field's end nearly every point has such a result.) Sampled every 1/20 cell. A
/// determinant just below zero is a fold thinner than the 1/32 cell at which back_track() samples,
/// over which it changes by a tenth at most.
bool unfolded(const MotionMap& map, double phase, glm::dvec3 a, glm::dvec3 b) {
  const int looks = 1 + int(20.0 * glm::length(b - a) / map.cell_m());
  for (int k = 0; k <= looks; ++k) {
    const glm::dvec3 x = a + double(k) / looks * (b - a);
    if (!upright(map, phase, x, -kSliver)) return false;
  }
  return true;
}

/// A target point, and the start of its search.
struct Ask {
  double phase;
  glm::dvec3 target, start;
};

}  // namespace

Field flow_field(Flow flow, double q, test::Random& random) {
  const Grid grid = field_grid();
  if (flow == Flow::kWaves || flow == Flow::kRough) {
    const Field field = flow == Flow::kWaves ? wavy_field(grid, random) : rough_field(grid, random);
    return scaled(field, q / double(MotionMap::of(field)->worst_contraction()));
  }
  Field field = still_field(grid);
  const double slope = flow == Flow::kStretch ? q : -q;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        field.u_mm[grid.offset(i, j, k)] = glm::vec3(slope * grid.lps_from_index({i, j, k}));
  return field;
}

int Searches::quantile(double q) const {
  int64_t left = count;
  for (size_t s = 0; s < steps.size(); ++s)
    if ((left -= steps[s]) <= int64_t((1.0 - q) * double(count))) return int(s);
  return int(steps.size());
}

void Searches::operator+=(const Searches& other) {
  for (size_t s = 0; s < steps.size(); ++s) steps[s] += other.steps[s];
  count += other.count;
  missed += other.missed;
  unseen += other.unseen;
  wrong += other.wrong;
  worst_cells = std::max(worst_cells, other.worst_cells);
  seconds += other.seconds;
}

Searches searched(const MotionMap& map, double phase, BackTracking method, test::Random random,
                  int count) {
  std::vector<Ask> asks;
  for (int i = 0; i < count; ++i) {
    const double at = phase < 0.0 ? random.draw(0.0, 1.0) : phase;
    const glm::dvec3 x = random.vector(0.010);
    const glm::dvec3 u = map.displacement(x);
    const glm::dvec3 aside = random.vector(5e-4);
    asks.push_back({at, x + at * u, x + aside + random.draw(-0.1, 0.1) * u});
  }
  std::vector<BackTrack> answers(asks.size());
  const auto begin = std::chrono::steady_clock::now();
  for (size_t i = 0; i < asks.size(); ++i)
    answers[i] =
        back_track(map, asks[i].phase, asks[i].target, asks[i].start, glm::dvec3(0.0), method);
  Searches all;
  all.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  all.count = count;
  for (size_t i = 0; i < asks.size(); ++i) {
    const auto& [at, target, start] = asks[i];
    const BackTrack& found = answers[i];
    const double left =
        glm::length(found.x_m + at * map.displacement(found.x_m) - target) / map.cell_m();
    const bool right = left <= kRight_cells && unfolded(map, at, start, found.x_m);
    const bool fits = left <= kRight_cells && upright(map, at, found.x_m, 0.0);
    // The paper's fixed point can not report a failure: it continues with the better of its
    // guesses.
    const bool says = method == BackTracking::kNewton && !found.ok;
    ++all.steps[size_t(std::min(found.steps, 64))];
    all.missed += !right || says;
    all.unseen += !right && !says;
    all.wrong += !fits && !says;
    if (!says) all.worst_cells = std::max(all.worst_cells, left);
  }
  return all;
}

Cell search_cell(Flow flow, double q, double phase, BackTracking method, uint32_t seed) {
  test::Random random(seed);
  const auto map = MotionMap::of(flow_field(flow, q, random));
  const Searches all = searched(*map, phase, method, random, kSearches);
  Cell cell{100.0 * double(all.missed) / kSearches, Outcome::kHeld};
  if (all.missed) cell.outcome = all.unseen ? Outcome::kSilent : Outcome::kFlagged;
  return cell;
}

}  // namespace palpate::stability
