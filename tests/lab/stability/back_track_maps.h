#pragma once

#include "module/scene/scene_spec.h"
#include "tests/lab/stability/map.h"

/// Where inverting the motion fails (equations (26) to (29)), and its effect on the force.
namespace palpate::stability {

/// The kind of motion; |u(b) - u(a)| / |b - a| is q.
enum class Flow {
  /// u = q x: never folds, for any q.
  kStretch,
  /// u = -q x: compressed into a point at q times phase = 1, inverted beyond.
  kPress,
  /// Random smooth waves; the bound of the worst cell is q.
  kWaves,
  /// Independent vectors; the bound of the worst cell is q.
  kRough,
};

/// 2,000 seeded searches in such a field at a phase, as the haptic loop makes them: the share that
/// fails, %. kPicard is the paper's fixed point, which continues with its better guess and reports
/// nothing; kNewton is palpate's, which reports the failure.
Cell search_cell(Flow flow, double q, double phase, BackTracking method, uint32_t seed);

/// A hand strokes (m/s) a beating shell whose material moves along its surface, in one step of four
/// with a gradient of q: the largest change of its force in a millisecond beyond that of the hand's
/// own motion, N. A change above 0.05 N is a failure, and so is a frozen point.
Cell stroke_cell(double q, double hand_m_per_s, bool palpate, uint32_t seed);

/// A hand moves fast (up to hand_m_per_s) around a beating shell 1 mm thin that moves at up to
/// wall_m_per_s: how often per second of contact the proxy passes through below the wall's
/// strength.
Cell dart_cell(double hand_m_per_s, double wall_m_per_s, bool palpate, int ticks, uint32_t seed);

StabilityMap stretch_map(const Making& making);
StabilityMap press_map(const Making& making);
StabilityMap waves_map(const Making& making);
StabilityMap stroke_map(const Making& making);
StabilityMap dart_map(const Making& making);

}  // namespace palpate::stability
