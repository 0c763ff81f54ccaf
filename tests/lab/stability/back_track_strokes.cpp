#include <algorithm>
#include <cmath>

#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/stability/shell.h"
#include "tests/support/random.h"

namespace palpate::stability {
namespace {

constexpr double kStrokeStiffness = 600.0;
// Per millisecond: above this a hand notices an event.
constexpr double kMostChange_n = 0.05;
constexpr int kStrokeFrames = 4, kFoldedStep = 2;

/// The beating shell whose material, in its third step, also moves along its surface: rotated about
/// an axis by (q / 6) sin(6 longitude). Its frames do not depend on longitude, so they are correct,
/// and every effect on the force comes from the motion.
std::shared_ptr<const MovingVolume> running_shell(double q, glm::dvec3 axis_lps) {
  const Grid grid = shell_grid(2.0);
  static const auto still = shell(kStrokeFrames, 2.0, Made::kAnalytic, 2.0);
  auto volume = std::make_shared<MovingVolume>(*still);
  const glm::dvec3 east = glm::normalize(glm::cross(axis_lps, glm::dvec3(0.3, 0.5, -0.8)));
  const glm::dvec3 north = glm::cross(axis_lps, east);
  Field field = shell_truth(grid, kFoldedStep, kFoldedStep + 1, kStrokeFrames);
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
    stroke.held |= out.frozen;
    const double own_n = i ? kStrokeStiffness * glm::length(probe - last_m) : 0.0;
    if (i) stroke.worst_n = std::max(stroke.worst_n, glm::length(out.wanted_n - last_n) - own_n);
    last_n = out.wanted_n;
    last_m = probe;
  }
  return stroke;
}

}  // namespace

Cell stroke_cell(double q, double hand_m_per_s, bool palpate, uint32_t seed) {
  test::Random random(seed);
  const glm::dvec3 axis = random.direction();
  const auto data = running_shell(q, glm::normalize(lps_from_volume(axis)));
  SceneSpec spec = shell_spec(20.0, 0.0, kStrokeStiffness);
  spec.modes.front().strength = *TransferFunction::window(500.0, 400.0, 20.0);
  const glm::dvec3 across = glm::normalize(glm::cross(axis, random.direction()));
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

}  // namespace palpate::stability
