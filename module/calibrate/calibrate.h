#pragma once

#include <span>
#include <vector>

#include "compute/volume/result.h"
#include "module/scene/pose.h"

namespace palpate {

/// Registration of the force device to the room: finds stage_from_device, so that objects are seen
/// where they are felt. Values; any thread; allocates. All in metres and seconds; "stage" is any
/// frame of the headset's runtime that is fixed in the room.

/// A place touched with the device's tip and with a controller's tip (or with a marker held to the
/// place).
struct TouchedPoint {
  glm::dvec3 device_m{0.0};
  glm::dvec3 stage_m{0.0};
};

struct Calibration {
  Pose stage_from_device;
  double rms_m = 0.0;     ///< over the samples used, three-dimensional
  int used = 0, all = 0;  ///< number of samples that agree, and of all
  /// Only from movement: by how much the headset's poses are later than the device's at the same
  /// instant, on their clocks; and the device's tip in the controller's frame, m.
  double delay_s = 0.0;
  glm::dvec3 controller_from_tip_m{0.0};
};

struct CalibrationOptions {
  /// A sample further off is taken for a slip or a tracking error while the consensus is searched;
  /// three to four times the tracker's noise.
  double agree_m = 0.004;
  uint32_t seed = 1;  ///< of the random subsets
};

/// Calibration from touched points. The rigid motion of least squares is Horn's closed form (JOSA A
/// 4, 1987: the unit quaternion is the eigenvector of a 4 x 4 matrix); outliers are found by
/// fitting triples (RANSAC) and at the end weighted by Tukey's function of their distance. Works
/// with up to about a third of outliers. Errors, with a sentence: kBadInput: fewer than 5 points,
/// points on a line, no majority that agrees.
Result<Calibration> calibrate_by_points(std::span<const TouchedPoint> points,
                                        const CalibrationOptions& options = {});

/// Only Horn's closed form over all points with their weights (empty: 1 each). Needs three points
/// that are not on a line; otherwise the result is one of many solutions.
Pose fit_rigid(std::span<const TouchedPoint> points, std::span<const double> weights = {});

/// A position of the device's tip, at a time of the device's clock.
struct TipSample {
  double time_s = 0.0;
  glm::dvec3 device_m{0.0};
};
/// A pose of the controller that is clipped to the stylus, at a time of the headset's clock.
struct ControllerSample {
  double time_s = 0.0;
  Pose stage_from_controller;
};

/// Calibration from free movement with a controller clipped to the stylus. The tip has a fixed
/// place x in the controller's frame: stage_from_controller(t) x = stage_from_device tip(t -
/// delay), the translational part of the robot-world and hand-eye equation A X = Z B, with the
/// delay as an additional unknown. First a linear fit (rotation as nine unknowns) to random subsets
/// for delays 10 ms apart; then Gauss-Newton in all ten unknowns with Tukey's weights. Errors:
/// kBadInput: too few samples; a controller that was hardly rotated (below about 15 degrees x and
/// the translation can not be separated: a device that does not rotate needs touched points); too
/// little movement; no majority that agrees. tip: rising times, dense (1 kHz); delays from -20 to
/// 100 ms are searched.
Result<Calibration> calibrate_by_movement(std::span<const TipSample> tip,
                                          std::span<const ControllerSample> controller,
                                          const CalibrationOptions& options = {});

/// The touching tip of a controller, found by rotating the controller about the fixed place of the
/// tip.
struct Pivot {
  glm::dvec3 controller_from_tip_m{0.0};
  glm::dvec3 stage_m{0.0};  ///< the place of the tip
  double rms_m = 0.0;       ///< over the poses used, three-dimensional
  int used = 0, all = 0;    ///< number of poses that agree, and of all
};

/// Pivot calibration: the tip x in the controller's frame and its place p are constant, R_i x + t_i
/// = p for every pose, linear in both; outliers are found by random subsets and weighted by Tukey's
/// function of their distance. Errors, with a sentence: kBadInput: too few poses; a controller that
/// was hardly rotated about two axes (then x along one axis is undetermined); a tip that did not
/// rest.
Result<Pivot> find_pivot(std::span<const ControllerSample> controller,
                         const CalibrationOptions& options = {});

/// Error at a touched point, m; for points that were not used in the calibration.
double off_m(const Calibration& calibration, const TouchedPoint& point);

/// Expected error at a place in the device's frame, m, RMS: Fitzpatrick, West and Maurer 1998,
/// TRE^2 = FLE^2 / N (1 + 1/3 sum d_k^2 / f_k^2) with FLE from the residuals of the points.
double expected_error_m(std::span<const TouchedPoint> points, const Calibration& calibration,
                        glm::dvec3 device_m);

}  // namespace palpate
