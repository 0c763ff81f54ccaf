#pragma once

#include "module/haptics/proxy/haptic_run.h"

namespace palpate {

/// What taking the proxy to its balance found.
struct Sweep {
  glm::dvec3 proxy{0.0};        ///< world, m
  int pieces = 0;               ///< into which the way was cut
  int primitives = 0;           ///< of the last balance
  double residual_n = 0.0;      ///< of the last balance
  bool touching = false;        ///< some primitive acts on the proxy
  double drag_n_s_per_m = 0.0;  ///< of the material at the start of the way
};

/// Moves the proxy from where its carriers have it to where spring and primitives balance (equation
/// (11)), sampling the data on the way. The paper solves once per frame and jumps to the result, so
/// it misses what lies between. Here the way is cut into pieces shorter than half a voxel, so
/// nothing is stepped over, however fast hand and data are. A surface that is newly met is found by
/// regula falsi, to a fifth of a micrometre. A piece along a surface is repeated with the mean of
/// the primitives at its ends (midpoint rule), so that sliding over a curved surface neither digs
/// in nor lifts off. Drag is an implicit damper, read where the frame begins: with the coefficient
/// b the proxy x minimizes b/(2 dt) |x - a|^2 beside the spring's k/2 |x - probe|^2 (a: where the
/// material has taken the proxy). So without other primitives k (probe - x) = b (x - a)/dt at
/// every step size. A carrier whose point can not be found stays where it is. Real-time safe;
/// after 48 pieces or 96 samples of the data (one per mode and place) the rest of the way is left
/// to the next frame.
/// point: the one of run.points that is swept; probe: where it is.
Sweep sweep(HapticRun& run, PointRun& point, glm::dvec3 probe, double stiffness_n_per_m,
            double dt_s) noexcept;

}  // namespace palpate
