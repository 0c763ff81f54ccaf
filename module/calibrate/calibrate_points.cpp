#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "module/calibrate/calibrate.h"
#include "module/calibrate/principal_axes.h"
#include "module/calibrate/tukey.h"

namespace palpate {
namespace {

constexpr size_t kFewestPoints = 5;
constexpr int kTriples = 500;

double distance(const Pose& pose, const TouchedPoint& point) {
  return glm::distance(pose(point.device_m), point.stage_m);
}

PrincipalAxes axes_of(std::span<const TouchedPoint> points) {
  std::vector<glm::dvec3> places;
  places.reserve(points.size());
  for (const TouchedPoint& point : points) places.push_back(point.device_m);
  return principal_axes(places);
}

/// Whether a triple spans more than `least`, m; a smaller one determines no reliable rotation.
bool spans(const TouchedPoint& a, const TouchedPoint& b, const TouchedPoint& c, double least) {
  const glm::dvec3 across = glm::cross(b.device_m - a.device_m, c.device_m - a.device_m);
  return glm::length(across) > least * least;
}

/// The rigid motion of the triple that most points agree with.
Pose by_triples(std::span<const TouchedPoint> points, const CalibrationOptions& options,
                size_t& agreeing) {
  std::mt19937 random(options.seed);
  Pose best;
  agreeing = 0;
  double best_sum = 0.0;
  for (int i = 0; i < kTriples; ++i) {
    const std::array<TouchedPoint, 3> triple{points[random() % points.size()],
                                             points[random() % points.size()],
                                             points[random() % points.size()]};
    if (!spans(triple[0], triple[1], triple[2], 3.0 * options.agree_m)) continue;
    const Pose pose = fit_rigid(triple);
    size_t count = 0;
    double sum = 0.0;
    // A triple is noisier than the final fit: twice the distance is allowed.
    for (const TouchedPoint& point : points) {
      const double off = distance(pose, point);
      if (off > 2.0 * options.agree_m) continue;
      ++count;
      sum += off;
    }
    if (count < agreeing || (count == agreeing && sum >= best_sum)) continue;
    agreeing = count;
    best_sum = sum;
    best = pose;
  }
  return best;
}

}  // namespace

Pose fit_rigid(std::span<const TouchedPoint> points, std::span<const double> weights) {
  const auto weight = [&](size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  glm::dvec3 from(0.0), to(0.0);
  double sum = 0.0;
  for (size_t i = 0; i < points.size(); ++i) {
    from += weight(i) * points[i].device_m;
    to += weight(i) * points[i].stage_m;
    sum += weight(i);
  }
  from /= sum;
  to /= sum;
  glm::dmat3 s(0.0);  // s[b][a]: device a times stage b
  for (size_t i = 0; i < points.size(); ++i)
    s += weight(i) * glm::outerProduct(points[i].device_m - from, points[i].stage_m - to);
  const auto at = [&](int a, int b) { return s[b][a]; };
  const double xx = at(0, 0), yy = at(1, 1), zz = at(2, 2);
  const double yz = at(1, 2) - at(2, 1), zx = at(2, 0) - at(0, 2), xy = at(0, 1) - at(1, 0);
  const double n[4][4] = {{xx + yy + zz, yz, zx, xy},
                          {yz, xx - yy - zz, at(0, 1) + at(1, 0), at(2, 0) + at(0, 2)},
                          {zx, at(0, 1) + at(1, 0), yy - xx - zz, at(1, 2) + at(2, 1)},
                          {xy, at(2, 0) + at(0, 2), at(1, 2) + at(2, 1), zz - xx - yy}};
  const std::vector<double> q = symmetric_eigen({&n[0][0], 16}, 4).vectors.back();
  const glm::dquat rotation = glm::normalize(glm::dquat(q[0], q[1], q[2], q[3]));
  return {to - rotation * from, rotation};
}

Result<Calibration> calibrate_by_points(std::span<const TouchedPoint> points,
                                        const CalibrationOptions& options) {
  if (points.size() < kFewestPoints)
    return Error{ErrorKind::kBadInput,
                 "A calibration needs at least 5 touched points: touch more."};
  for (const TouchedPoint& point : points)
    if (!std::isfinite(glm::dot(point.device_m, glm::dvec3(1)) +
                       glm::dot(point.stage_m, glm::dvec3(1))))
      return Error{ErrorKind::kBadInput, "A touched point is not finite: touch it again."};
  if (std::sqrt(axes_of(points).variance[1]) < 3.0 * options.agree_m)
    return Error{ErrorKind::kBadInput,
                 "The touched points lie on a line or too close together: spread them over the "
                 "whole workspace."};
  size_t agreeing = 0;
  Pose pose = by_triples(points, options, agreeing);
  if (agreeing < kFewestPoints || 2 * agreeing <= points.size())
    return Error{
        ErrorKind::kBadInput,
        "The touched points do not agree with each other: touch them again, each with both "
        "tips on the same place."};
  std::vector<double> weights(points.size()), off(points.size());
  for (int round = 0; round < 30; ++round) {
    for (size_t i = 0; i < points.size(); ++i) off[i] = distance(pose, points[i]);
    const double scale = tukey::scale(off);
    for (size_t i = 0; i < points.size(); ++i)
      weights[i] = round < 20 ? tukey::weight(off[i], scale) : tukey::belongs(off[i], scale);
    pose = fit_rigid(points, weights);
  }
  Calibration found;
  found.stage_from_device = pose;
  found.all = int(points.size());
  double sum = 0.0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (weights[i] <= 0.0) continue;
    const double d = distance(pose, points[i]);
    sum += d * d;
    ++found.used;
  }
  found.rms_m = std::sqrt(sum / double(std::max(found.used, 1)));
  return found;
}

double off_m(const Calibration& calibration, const TouchedPoint& point) {
  return distance(calibration.stage_from_device, point);
}

double expected_error_m(std::span<const TouchedPoint> points, const Calibration& calibration,
                        glm::dvec3 device_m) {
  std::vector<TouchedPoint> used;
  for (const TouchedPoint& point : points)
    if (distance(calibration.stage_from_device, point) <= 4.0 * calibration.rms_m)
      used.push_back(point);
  const double n = double(used.size());
  if (n < 3.0) return std::numeric_limits<double>::infinity();
  const PrincipalAxes axes = axes_of(used);
  // FRE^2 = (1 - 2 / N) FLE^2.
  const double fle_2 = calibration.rms_m * calibration.rms_m / std::max(1.0 - 2.0 / n, 1e-3);
  const glm::dvec3 d = device_m - axes.centre;
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double along = glm::dot(d, axes.axes[k]);
    // Squared distances from axis k: of the place, and the mean over the points.
    const double d_2 = glm::dot(d, d) - along * along;
    const double f_2 = axes.variance.x + axes.variance.y + axes.variance.z - axes.variance[k];
    sum += d_2 / std::max(f_2, 1e-12);
  }
  return std::sqrt(fle_2 / n * (1.0 + sum / 3.0));
}

}  // namespace palpate
