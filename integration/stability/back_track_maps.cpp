#include "integration/stability/back_track_maps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "integration/stability/draws.h"
#include "integration/stability/paper_loop.h"
#include "integration/stability/shell.h"
#include "module/haptics/back_track.h"

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

StabilityMap search_map(const char* name, const char* title, const Making& making, Flow flow) {
  StabilityMap map;
  map.group = "back-tracking";
  map.name = name;
  map.title = title;
  map.failed = "one of the points asked for is not found to a thousandth of a cell";
  map.x = {"q", "", evenly(0.0, 3.0, making.quick ? 7 : 16), false, {}};
  map.y = {"phase", "", evenly(0.1, 1.0, making.quick ? 4 : 10), false, {}};
  map.colour = "points not found";
  map.colour_unit = "%";
  map.highest = 100.0;
  Border border{"q times phase = 1 (Banach)", {}};
  for (const double phase : evenly(0.05, 1.05, 81)) border.points.push_back({1.0 / phase, phase});
  map.borders = {border};
  map.sides = {{"the paper's fixed point", "", {}},
               {"palpate", "holds the point and fades the force with the cause 'field'", {}}};
  fill(map, making, [&](size_t side, double q, double phase) {
    return search_cell(flow, q, phase, side == 1 ? BackTracking::kNewton : BackTracking::kPicard,
                       cell_seed(making.seed, q, phase));
  });
  return map;
}

// Strokes ----------------------------------------------------------------------------------------

constexpr double kStrokeStiffness = 600.0;
constexpr double kMostChange_n = 0.05;  // in a millisecond: what a hand begins to take for an event
constexpr int kFrames = 4, kFoldedStep = 2;

/// The beating shell whose material, in its third step, also runs along its surface: turned about
/// an axis by (q / 6) sin(6 longitude). Its frames know no longitude, so they are right all the
/// same, and all that is felt of it is the motion's own doing.
std::shared_ptr<const MovingVolume> running_shell(double q, glm::dvec3 axis_lps) {
  const Grid grid = shell_grid(2.0);
  static const auto still = shell(kFrames, 2.0, Made::kAnalytic, 2.0);
  auto volume = std::make_shared<MovingVolume>(*still);
  const glm::dvec3 east = glm::normalize(glm::cross(axis_lps, glm::dvec3(0.3, 0.5, -0.8)));
  const glm::dvec3 north = glm::cross(axis_lps, east);
  Field field = heart_truth(grid, kFoldedStep, kFoldedStep + 1, kFrames);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        glm::vec3& u = field.u_mm[grid.offset(i, j, k)];
        const double longitude = std::atan2(glm::dot(x, north), glm::dot(x, east));
        const glm::dquat turn = glm::angleAxis(q / 6.0 * std::sin(6.0 * longitude), axis_lps);
        u = glm::vec3(turn * (x + glm::dvec3(u)) - x);
      }
  volume->motions.front().steps[kFoldedStep] = MotionMap::of(field);
  return volume;
}

struct Stroke {
  double worst_n = 0.0;
  bool held = false;
};

template <class AnyHand>
Stroke stroked(AnyHand& hand, glm::dvec3 axis, glm::dvec3 across, double hand_m_per_s) {
  Stroke stroke;
  glm::dvec3 last_n(0.0), last_m(0.0);
  for (int i = 0; i < 4000; ++i) {
    const double r = std::max(0.0225, 0.037 - 2e-5 * i);
    const glm::dvec3 probe = r * (glm::angleAxis(hand_m_per_s * 1e-3 * i / 0.03, axis) * across);
    const TickOutput out = hand.to(probe);
    stroke.held |= out.held;
    const double own_n = i ? kStrokeStiffness * glm::length(probe - last_m) : 0.0;
    if (i) stroke.worst_n = std::max(stroke.worst_n, glm::length(out.wanted_n - last_n) - own_n);
    last_n = out.wanted_n;
    last_m = probe;
  }
  return stroke;
}

// Darts ------------------------------------------------------------------------------------------

constexpr double kThin_m = 1e-3;
constexpr double kDartStrength_n = 20.0;

/// The ball's surface alone, one voxel thick.
Volume thin_frame(const Grid& grid, int k) {
  Volume frame{grid, std::vector<float>(grid.count())};
  const double radius = shell_radius_mm(k, kFrames);
  for (int z = 0; z < grid.size.z; ++z)
    for (int y = 0; y < grid.size.y; ++y)
      for (int x = 0; x < grid.size.x; ++x) {
        // What of a voxel the wall fills.
        const double r = glm::length(grid.lps_from_index({x, y, z}));
        const double share = 1.0 - std::abs(r - radius) / grid.finest_mm();
        frame.values[grid.offset(x, y, z)] = float(1000.0 * std::max(0.0, share));
      }
  return frame;
}

/// The same frames at any rate share data and motion. The fastest step goes at so many m/s.
std::shared_ptr<const MovingVolume> thin_shell(double wall_m_per_s) {
  static const MovingVolume made = [] {
    MovingVolume volume = *shell(kFrames, 1.0);
    volume.frames.clear();
    for (int k = 0; k < kFrames; ++k)
      volume.frames.push_back(sampled_scalar(thin_frame(shell_grid(1e3 * kThin_m), k)));
    return volume;
  }();
  double step_m = 0.0;
  for (int k = 0; k < kFrames; ++k)
    step_m = std::max(
        step_m, 1e-3 * std::abs(shell_radius_mm(k + 1, kFrames) - shell_radius_mm(k, kFrames)));
  const double frames_per_second = std::max(1e-6, wall_m_per_s / step_m);
  auto volume = std::make_shared<MovingVolume>(made);
  for (int k = 0; k < kFrames; ++k) volume->times.times_s[size_t(k)] = k / frames_per_second;
  volume->times.cycle_s = kFrames / frames_per_second;
  return volume;
}

/// A hand that darts about the wall, up to 15 mm inside of it. Straight ways between seeded points.
class Darting {
 public:
  explicit Darting(double speed_m_per_s) : step_m_(1e-3 * speed_m_per_s) {}
  /// Starts outside.
  glm::dvec3 next(Draws& draws, double radius_m) {
    if (glm::length(target_ - at_) < step_m_) {
      const glm::dvec3 to = glm::normalize(glm::normalize(at_) + draws.vector(0.5));
      target_ = to * (radius_m + draws.even(-0.015, 0.006));
    }
    const glm::dvec3 way = target_ - at_;
    const double length = glm::length(way);
    if (length > 0.0) at_ += way * std::min(1.0, step_m_ / length);
    return at_;
  }

 private:
  double step_m_;
  glm::dvec3 at_{0.05, 0.0, 0.0}, target_{0.04, 0.0, 0.0};
};

struct Darts {
  int64_t contact = 0, through = 0, unseen = 0;
};

/// A frame in which the force comes to the strength, or the proxy is behind the wall, starts the
/// hand anew outside.
template <class MakeHand>
Darts darted(double hand_m_per_s, int ticks, Draws draws, const MakeHand& make) {
  auto hand = make();
  Darting path(hand_m_per_s);
  Darts darts;
  double radius = 0.025;
  for (int i = 0; i < ticks; ++i) {
    const TickOutput out = hand->to(path.next(draws, radius));
    darts.contact += glm::length(out.wanted_n) > 0.0;
    radius = shell_radius_m(out.first, kFrames);
    const bool strong = glm::length(out.wanted_n) >= kDartStrength_n;
    const bool through = !strong && radius - glm::length(out.proxy_m) > 0.5 * kThin_m;
    darts.through += through;
    darts.unseen += through && !out.held;
    if (!strong && !through) continue;
    hand = make();
    path = Darting(hand_m_per_s);
  }
  return darts;
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

Cell stroke_cell(double q, double hand_m_per_s, bool palpate, uint32_t seed) {
  Draws draws(seed);
  const glm::dvec3 axis = draws.direction();
  const auto data = running_shell(q, glm::normalize(lps_from_volume(axis)));
  SceneSpec spec = shell_spec(20.0, 0.0, kStrokeStiffness);
  spec.modes.front().strength = *TransferFunction::window(500.0, 400.0, 20.0);
  const glm::dvec3 across = glm::normalize(glm::cross(axis, draws.direction()));
  Stroke stroke;
  if (palpate) {
    Hand hand(spec, {data});
    stroke = stroked(hand, axis, across, hand_m_per_s);
  } else {
    spec.volumes.front().back_tracking = BackTracking::kPicard;
    PaperHand hand(spec, {data});
    stroke = stroked(hand, axis, across, hand_m_per_s);
  }
  Cell cell{std::max(0.0, stroke.worst_n), Outcome::kHeld};
  const bool failed = stroke.worst_n > kMostChange_n + 1e-9;
  if (palpate && stroke.held)
    cell.outcome = Outcome::kFlagged;
  else if (failed)
    cell.outcome = Outcome::kSilent;
  return cell;
}

Cell dart_cell(double hand_m_per_s, double wall_m_per_s, bool palpate, int ticks, uint32_t seed) {
  const auto data = thin_shell(wall_m_per_s);
  SceneSpec spec = shell_spec(kDartStrength_n, 0.2, 600.0);
  spec.modes.front().strength = *TransferFunction::window(300.0, 200.0, kDartStrength_n);
  Darts darts;
  if (palpate) {
    darts = darted(hand_m_per_s, ticks, Draws(seed),
                   [&] { return std::make_unique<Hand>(spec, std::vector{data}); });
  } else {
    spec.volumes.front().back_tracking = BackTracking::kPicard;
    darts = darted(hand_m_per_s, ticks, Draws(seed),
                   [&] { return std::make_unique<PaperHand>(spec, std::vector{data}); });
  }
  Cell cell{1e3 * double(darts.through) / double(std::max<int64_t>(1, darts.contact)),
            Outcome::kHeld};
  if (darts.through) cell.outcome = darts.unseen || !palpate ? Outcome::kSilent : Outcome::kFlagged;
  return cell;
}

StabilityMap stretch_map(const Making& making) {
  StabilityMap map =
      search_map("stretched", "Turning a stretching motion around", making, Flow::kStretch);
  map.made =
      "Material that is stretched q-fold in a step, u = q x, which never folds: 2,000 points "
      "are sought where a hand would ask for them.";
  return map;
}

StabilityMap press_map(const Making& making) {
  StabilityMap map =
      search_map("pressed", "Turning a pressing motion around", making, Flow::kPress);
  map.made =
      "Material that is pressed together, u = -q x: at q times phase = 1 it is a point, beyond "
      "it is inside out and there is nothing to find.";
  return map;
}

StabilityMap waves_map(const Making& making) {
  StabilityMap map =
      search_map("waves", "Turning random smooth motion around", making, Flow::kWaves);
  map.made = "A random smooth field in each cell whose steepest place has the bound q.";
  return map;
}

StabilityMap stroke_map(const Making& making) {
  StabilityMap map;
  map.group = "back-tracking";
  map.name = "stroked";
  map.title = "Stroking data whose motion is steep or folded";
  map.made =
      "A hand 2.5 to 12 mm inside a beating shell strokes it for 4 s, 600 N/m; in one step of four "
      "the "
      "material also runs along the surface, with a gradient q.";
  map.failed =
      "the force changes by more than 0.05 N in a millisecond beyond what the hand's own way "
      "makes";
  map.x = {"q", "", evenly(0.0, 3.0, making.quick ? 5 : 13), false, {}};
  map.y = {"speed of the hand", "mm/s", log_evenly(5.0, 200.0, making.quick ? 3 : 9), true, {}};
  map.colour = "largest change of force in a ms";
  map.colour_unit = "N";
  map.logarithmic = true;
  map.lowest = 1e-3;
  map.highest = 10.0;
  map.borders = {{"q = 1 (Banach; here also where it folds)",
                  {{1.0, map.y.at.front() * 0.5}, {1.0, map.y.at.back() * 2.0}}}};
  map.sides = {{"the paper's loop", "", {}},
               {"palpate", "holds the point and fades the force with the cause 'field'", {}}};
  fill(map, making, [&](size_t side, double q, double mm_per_s) {
    return stroke_cell(q, 1e-3 * mm_per_s, side == 1, cell_seed(making.seed, q, mm_per_s));
  });
  return map;
}

StabilityMap dart_map(const Making& making) {
  StabilityMap map;
  map.group = "back-tracking";
  map.name = "pop-through";
  map.title = "A fast hand at a fast, thin wall";
  map.made =
      "A hand darts about a beating shell that is one voxel (1 mm) thin; counted is how often the "
      "proxy goes through although the force is below the wall's strength.";
  map.failed = "the proxy goes through once";
  map.x = {"speed of the hand", "m/s", log_evenly(0.02, 3.0, making.quick ? 5 : 12), true, {}};
  map.y = {"speed of the wall", "m/s", evenly(0.0, 0.6, making.quick ? 3 : 7), false, {}};
  map.colour = "times through, per second of contact";
  map.colour_unit = "1/s";
  map.logarithmic = true;
  map.lowest = 0.1;
  map.highest = 1e3;
  Border border{"hand and wall together go one voxel in a tick", {}};
  for (const double wall : evenly(-0.05, 0.65, 33)) border.points.push_back({1.0 - wall, wall});
  map.borders = {border};
  map.sides = {{"the paper's loop", "", {}}, {"palpate", "holds the point", {}}};
  fill(map, making, [&](size_t side, double hand, double wall) {
    return dart_cell(hand, wall, side == 1, making.quick ? 5000 : 40'000,
                     cell_seed(making.seed, hand, wall));
  });
  return map;
}

}  // namespace palpate::stability
