#pragma once

#include <span>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/pose.h"

namespace palpate {

/// Where the force device stands in the room: stage_from_device, so that what is seen is where it
/// is felt. Values; any thread; allocates. Everything in metres and seconds; "stage" is any frame
/// of the headset's runtime that stays in the room.

/// One place, touched by the device's tip and by a controller's tip (or a marker held to it).
struct TouchedPoint {
  glm::dvec3 device_m{0.0};
  glm::dvec3 stage_m{0.0};
};

struct Calibration {
  Pose stage_from_device;
  double rms_m = 0.0;     ///< of the samples that were used, three-dimensional
  int used = 0, all = 0;  ///< samples that agree, and samples there were
  /// Only from movement: how much later the headset's poses are than the device's for the same
  /// moment on their clocks, and the device's tip in the controller's frame.
  double delay_s = 0.0;
  glm::dvec3 controller_from_tip_m{0.0};
};

struct CalibrationOptions {
  /// A sample further off than this is taken for a slip or a tracking error while looking for the
  /// rest; three to four times the tracker's noise.
  double agree_m = 0.004;
  uint32_t seed = 1;  ///< of the random subsets
};

/// From touched points. The rigid motion of least squares is Horn's closed form (JOSA A 4, 1987:
/// the unit quaternion is the eigenvector of a 4 x 4 matrix); slips are found by fitting triples
/// (RANSAC) and in the end weighed down by Tukey's function of their distance. Works up to about a
/// third of slips. kBadInput, in a sentence: fewer than 5 points, points on a line, no majority
/// that agrees.
Result<Calibration> calibrate_by_points(std::span<const TouchedPoint> points,
                                        const CalibrationOptions& options = {});

/// Horn's closed form alone, all points with their weights (none: 1 each); needs three points that
/// are not on a line, else what it returns is one of many.
Pose fit_rigid(std::span<const TouchedPoint> points, std::span<const double> weights = {});

/// The device's tip, as its own clock says.
struct TipSample {
  double time_s = 0.0;
  glm::dvec3 device_m{0.0};
};
/// The controller that is clipped to the stylus, as the headset's clock says.
struct ControllerSample {
  double time_s = 0.0;
  Pose stage_from_controller;
};

/// From free movement with a controller clipped to the stylus. The tip stays in one place x of the
/// controller: stage_from_controller(t) x = stage_from_device tip(t - delay), the translational
/// half of the robot-world and hand-eye equation A X = Z B, with the delay as one more unknown. The
/// start is linear (rotation as nine unknowns) on random subsets for delays 10 ms apart; the end is
/// Gauss-Newton in all ten unknowns with Tukey's weights. kBadInput: too few samples, a controller
/// that was hardly turned (below about 15 degrees: then x and the translation can not be told
/// apart: a device that does not turn needs touched points), too little movement, no majority that
/// agrees. tip: rising times, dense (1 kHz); delays from -20 to 100 ms are looked for.
Result<Calibration> calibrate_by_movement(std::span<const TipSample> tip,
                                          std::span<const ControllerSample> controller,
                                          const CalibrationOptions& options = {});

/// The touching tip of a controller, found by turning the controller about the tip's fixed place.
struct Pivot {
  glm::dvec3 controller_from_tip_m{0.0};
  glm::dvec3 stage_m{0.0};  ///< where the tip rested
  double rms_m = 0.0;       ///< of the poses that were used, three-dimensional
  int used = 0, all = 0;    ///< poses that agree, and poses there were
};

/// Pivot calibration: the tip x of the controller and its place p stay, R_i x + t_i = p for every
/// pose, linear in both; wild poses are found by random subsets and weighed down by Tukey's
/// function of their distance. kBadInput, in a sentence: too few poses, a controller that was
/// hardly turned about two axes (then x along the one axis can not be told), a tip that did not
/// rest.
Result<Pivot> find_pivot(std::span<const ControllerSample> controller,
                         const CalibrationOptions& options = {});

/// How far a touched point is off, m: to be asked of a point that was not used.
double off_m(const Calibration& calibration, const TouchedPoint& point);

/// Expected error at a place of the device's frame, m, RMS: Fitzpatrick, West and Maurer 1998,
/// TRE^2 = FLE^2 / N (1 + 1/3 sum d_k^2 / f_k^2) with FLE from the points' own residuals.
double expected_error_m(std::span<const TouchedPoint> points, const Calibration& calibration,
                        glm::dvec3 device_m);

}  // namespace palpate
