#include <cmath>
#include <numbers>

#include "module/haptics/back_track.h"
#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/draws.h"

namespace palpate::stability {
namespace {

constexpr int kSearches = 2000;
// A point is right when it is this near to what was asked for, in cells of the field.
constexpr double kRight_cells = 1e-3;
constexpr double kSliver = 0.05;

Grid field_grid() {
  Grid grid;
  grid.size = glm::ivec3(24);
  grid.origin_mm = glm::dvec3(-11.5);
  return grid;
}

/// Six waves of 4 mm and longer.
Field wavy_field(const Grid& grid, Draws& draws) {
  struct Wave {
    glm::dvec3 k, amplitude;
    double phase;
  };
  std::vector<Wave> waves;
  for (int w = 0; w < 6; ++w) {
    const double k = 2.0 * std::numbers::pi / draws.even(4.0, 24.0);
    const glm::dvec3 along = draws.direction(), towards = draws.direction();
    waves.push_back({k * along, towards / k, draws.even(0.0, 2.0 * std::numbers::pi)});
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

Field scaled(Field field, double factor) {
  for (glm::vec3& u : field.u_mm) u *= float(factor);
  return field;
}

Field flow_field(Flow flow, double q, Draws& draws) {
  const Grid grid = field_grid();
  if (flow == Flow::kWaves) {
    const Field field = wavy_field(grid, draws);
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

/// No fold on the straight way from a to b: what lies behind one is other material, however well it
/// fits. (Beyond the field's end nearly every point has such an answer.) Looked at every 1/20 cell;
/// a determinant just below zero is a fold thinner than the 1/32 cell at which back_track() looks,
/// over which it changes by a tenth at most.
bool unfolded(const MotionMap& map, double phase, glm::dvec3 a, glm::dvec3 b) {
  const int looks = 1 + int(20.0 * glm::length(b - a) / map.cell_m());
  for (int k = 0; k <= looks; ++k) {
    const glm::dvec3 x = a + double(k) / looks * (b - a);
    const glm::dmat3 stretch = glm::dmat3(1.0) + phase * map.sample(x).jacobian;
    if (!(glm::determinant(stretch) > -kSliver)) return false;
  }
  return true;
}

}  // namespace

Cell search_cell(Flow flow, double q, double phase, BackTracking method, uint32_t seed) {
  Draws draws(seed);
  const auto map = MotionMap::of(flow_field(flow, q, draws));
  int missed = 0, unseen = 0;
  for (int i = 0; i < kSearches; ++i) {
    // As the hand asks: up to 1 m/s of its own, and up to a tenth of a step since the last time.
    const glm::dvec3 x = draws.vector(0.010);
    const glm::dvec3 u = map->displacement(x);
    const glm::dvec3 target = x + phase * u;
    const glm::dvec3 start = x + draws.vector(5e-4) + draws.even(-0.1, 0.1) * u;
    const BackTrack found = back_track(*map, phase, target, start, glm::dvec3(0.0), method);
    // Looked at afresh: the search's own word is not taken for it.
    const double left = glm::length(found.x_m + phase * map->displacement(found.x_m) - target);
    const bool right =
        left <= kRight_cells * map->cell_m() && unfolded(*map, phase, start, found.x_m);
    // The fixed point of the paper has no word for it: it goes on with the better of its guesses.
    const bool says = method == BackTracking::kNewton && !found.ok;
    missed += !right || says;
    unseen += !right && !says;
  }
  Cell cell{100.0 * missed / kSearches, Outcome::kHeld};
  if (missed) cell.outcome = unseen ? Outcome::kSilent : Outcome::kFlagged;
  return cell;
}

}  // namespace palpate::stability
