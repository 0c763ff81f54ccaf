#pragma once

#include "module/scene/scene_spec.h"
#include "tests/lab/stability/map.h"

/// Where inverting the motion fails (equations (26) to (29)), and what of that a hand feels.
namespace palpate::stability {

/// How the material moves, so that |u(b) - u(a)| / |b - a| is q.
enum class Flow {
  kStretch,  ///< u = q x: never folds, whatever q is
  kPress,    ///< u = -q x: pressed into a point at q times phase = 1, inside out beyond
  kWaves,    ///< random smooth waves of which the worst cell's bound is q
  kRough,    ///< independent vectors of which the worst cell's bound is q
};

/// 2,000 seeded searches in such a field at a phase, as a hand asks for them: the share that does
/// not arrive, %. kPicard is the paper's fixed point, which goes on with its better guess and says
/// nothing; kNewton is palpate's, which refuses.
Cell search_cell(Flow flow, double q, double phase, BackTracking method, uint32_t seed);

/// A hand strokes (m/s) a beating shell whose material runs along its surface, in one step of four
/// with a gradient of q: the largest change of its force in a millisecond beyond what its own way
/// makes, N. A change above 0.05 N is a failure, and so is a point that is held.
Cell stroke_cell(double q, double hand_m_per_s, bool palpate, uint32_t seed);

/// A hand darts (up to m/s) about a beating shell 1 mm thin that moves at up to wall_m_per_s: how
/// often a second of contact the proxy goes through below the wall's strength.
Cell dart_cell(double hand_m_per_s, double wall_m_per_s, bool palpate, int ticks, uint32_t seed);

StabilityMap stretch_map(const Making& making);
StabilityMap press_map(const Making& making);
StabilityMap waves_map(const Making& making);
StabilityMap stroke_map(const Making& making);
StabilityMap dart_map(const Making& making);

}  // namespace palpate::stability
