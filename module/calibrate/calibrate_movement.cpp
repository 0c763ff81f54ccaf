#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "module/calibrate/calibrate.h"
#include "module/calibrate/least_squares.h"
#include "module/calibrate/principal_axes.h"
#include "module/calibrate/rotation_spread.h"
#include "module/calibrate/tukey.h"

namespace palpate {
namespace {

constexpr size_t kFewest = 100;
constexpr double kDelayLow = -0.02, kDelayHigh = 0.1, kDelayStep = 0.01;  // s
constexpr int kSubsets = 150, kSubset = 10;
constexpr size_t kScored = 200;
constexpr double kLeastTurn = 0.087;   // rad, RMS, about the second axis: 5 degrees
constexpr double kLeastReach = 0.005;  // m, RMS, along the direction of least movement
constexpr double kSlope = 2e-3;  // s: half the interval over which the tip's velocity is computed

/// The ten unknowns.
struct MovementModel {
  Pose stage_from_device;
  glm::dvec3 tip{0.0};  ///< in the controller's frame
  double delay_s = 0.0;
};

/// A controller pose with the tip at the same time.
struct Pair {
  Pose controller;
  glm::dvec3 tip, velocity;
};

glm::dvec3 tip_at(std::span<const TipSample> tip, double time) {
  const auto after =
      std::lower_bound(tip.begin(), tip.end(), time,
                       [](const TipSample& sample, double at) { return sample.time_s < at; });
  if (after == tip.begin()) return tip.front().device_m;
  if (after == tip.end()) return tip.back().device_m;
  const TipSample &a = *(after - 1), &b = *after;
  const double share = (time - a.time_s) / (b.time_s - a.time_s);
  return glm::mix(a.device_m, b.device_m, share);
}

std::vector<Pair> pairs_at(std::span<const TipSample> tip,
                           std::span<const ControllerSample> controller, double delay_s) {
  std::vector<Pair> pairs;
  pairs.reserve(controller.size());
  for (const ControllerSample& sample : controller) {
    const double t = sample.time_s - delay_s;
    const glm::dvec3 slope = (tip_at(tip, t + kSlope) - tip_at(tip, t - kSlope)) / (2.0 * kSlope);
    pairs.push_back({sample.stage_from_controller, tip_at(tip, t), slope});
  }
  return pairs;
}

/// stage_from_controller x - stage_from_device tip.
glm::dvec3 residual(const MovementModel& model, const Pair& pair) {
  return pair.controller(model.tip) - model.stage_from_device(pair.tip);
}

/// The rotation nearest to a matrix, by Horn's closed form on the images of the axes and their
/// opposites.
glm::dquat nearest_rotation(const glm::dmat3& m) {
  std::array<TouchedPoint, 6> axes;
  for (int i = 0; i < 3; ++i) {
    glm::dvec3 axis(0.0);
    axis[i] = 1.0;
    axes[size_t(2 * i)] = {axis, m[i]};
    axes[size_t(2 * i + 1)] = {-axis, -m[i]};
  }
  return fit_rigid(axes).rotation;
}

/// Linear least squares with the nine elements of the rotation as unknowns: R_B x - M p - t = -p_B.
std::optional<MovementModel> linear_model(const std::vector<Pair>& pairs,
                                          const std::vector<size_t>& which) {
  LeastSquares fit(15);
  for (const size_t i : which) {
    const Pair& pair = pairs[i];
    const glm::dmat3 b = glm::mat3_cast(pair.controller.rotation);
    for (int c = 0; c < 3; ++c) {
      std::array<double, 15> row{};
      for (int k = 0; k < 3; ++k) {
        row[size_t(3 * c + k)] = -pair.tip[k];
        row[size_t(12 + k)] = b[k][c];
      }
      row[size_t(9 + c)] = -1.0;
      fit.add(row, -pair.controller.position_m[c]);
    }
  }
  const auto x = fit.solve();
  if (!x) return std::nullopt;
  glm::dmat3 m;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) m[k][c] = (*x)[size_t(3 * c + k)];
  MovementModel model;
  model.stage_from_device = {glm::dvec3((*x)[9], (*x)[10], (*x)[11]), nearest_rotation(m)};
  model.tip = glm::dvec3((*x)[12], (*x)[13], (*x)[14]);
  return model;
}

double median_off(const MovementModel& model, const std::vector<Pair>& pairs,
                  const std::vector<size_t>& which) {
  std::vector<double> off;
  off.reserve(which.size());
  for (const size_t i : which) off.push_back(glm::length(residual(model, pairs[i])));
  return tukey::scale(std::move(off));
}

/// The best fit to random subsets over all delays.
std::optional<MovementModel> start(std::span<const TipSample> tip,
                                   std::span<const ControllerSample> controller, uint32_t seed) {
  std::mt19937 random(seed);
  const auto draw = [&](size_t n) {
    std::vector<size_t> which(n);
    for (size_t& i : which) i = random() % controller.size();
    return which;
  };
  std::optional<MovementModel> best;
  double least = std::numeric_limits<double>::infinity();
  for (double delay = kDelayLow; delay <= kDelayHigh + 1e-9; delay += kDelayStep) {
    const std::vector<Pair> pairs = pairs_at(tip, controller, delay);
    const std::vector<size_t> scored = draw(kScored);
    for (int i = 0; i < kSubsets; ++i) {
      std::optional<MovementModel> model = linear_model(pairs, draw(kSubset));
      if (!model) continue;
      model->delay_s = delay;
      const double off = median_off(*model, pairs, scored);
      if (off >= least) continue;
      least = off;
      best = model;
    }
  }
  return best;
}

/// One weighted step of Gauss-Newton; false if the data do not determine all unknowns.
bool improve(MovementModel& model, const std::vector<Pair>& pairs,
             const std::vector<double>& weights) {
  LeastSquares fit(10);
  const glm::dquat& r = model.stage_from_device.rotation;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (weights[i] <= 0.0) continue;
    const glm::dvec3 off = residual(model, pairs[i]);
    const glm::dmat3 b = glm::mat3_cast(pairs[i].controller.rotation);
    const glm::dvec3 p = r * pairs[i].tip, v = r * pairs[i].velocity;
    // A rotation w after the present one changes the residual by -w x p; a later tip by -R v.
    const glm::dvec3 by_turn[3] = {{0.0, -p.z, p.y}, {p.z, 0.0, -p.x}, {-p.y, p.x, 0.0}};
    for (int c = 0; c < 3; ++c) {
      std::array<double, 10> row{};
      for (int k = 0; k < 3; ++k) {
        row[size_t(k)] = -by_turn[k][c];
        row[size_t(6 + k)] = b[k][c];
      }
      row[size_t(3 + c)] = -1.0;
      row[9] = v[c];
      fit.add(row, -off[c], weights[i]);
    }
  }
  const auto x = fit.solve();
  if (!x) return false;
  const glm::dvec3 turn((*x)[0], (*x)[1], (*x)[2]);
  const double angle = glm::length(turn);
  if (angle > 0.0) {
    model.stage_from_device.rotation =
        glm::normalize(glm::angleAxis(angle, turn / angle) * model.stage_from_device.rotation);
  }
  model.stage_from_device.position_m += glm::dvec3((*x)[3], (*x)[4], (*x)[5]);
  model.tip += glm::dvec3((*x)[6], (*x)[7], (*x)[8]);
  model.delay_s += std::clamp((*x)[9], -0.01, 0.01);
  return true;
}

/// RMS movement of the tip along the direction in which it moved least, m.
double least_reach(std::span<const TipSample> tip) {
  std::vector<glm::dvec3> places;
  places.reserve(tip.size());
  for (const TipSample& sample : tip) places.push_back(sample.device_m);
  return std::sqrt(principal_axes(places).variance[0]);
}

}  // namespace

Result<Calibration> calibrate_by_movement(std::span<const TipSample> tip,
                                          std::span<const ControllerSample> controller,
                                          const CalibrationOptions& options) {
  if (controller.size() < kFewest || tip.size() < kFewest)
    return Error{ErrorKind::kBadInput,
                 "The recorded movement is too short: move the stylus for half a minute."};
  for (size_t i = 1; i < tip.size(); ++i)
    if (!(tip[i].time_s > tip[i - 1].time_s))
      return Error{ErrorKind::kBadInput,
                   "The times of the device's samples do not rise: record the movement again."};
  if (least_reach(tip) < kLeastReach)
    return Error{ErrorKind::kBadInput,
                 "The stylus hardly moved in one direction: move it through the whole workspace."};
  if (rotation_spread_rad(controller) < kLeastTurn)
    return Error{
        ErrorKind::kBadInput,
        "The stylus was hardly turned: turn it about two axes while moving it, or calibrate "
        "by touched points."};
  std::optional<MovementModel> model = start(tip, controller, options.seed);
  if (!model)
    return Error{ErrorKind::kBadInput,
                 "The recorded movement does not tell where the device is: move and turn more."};

  std::vector<double> off(controller.size()), weights(controller.size());
  for (int round = 0; round < 40; ++round) {
    const std::vector<Pair> pairs = pairs_at(tip, controller, model->delay_s);
    for (size_t i = 0; i < pairs.size(); ++i) off[i] = glm::length(residual(*model, pairs[i]));
    // The first fit is coarse: at first everything within options.agree_m counts.
    const double scale =
        round < 3 ? std::max(tukey::scale(off), options.agree_m) : tukey::scale(off);
    for (size_t i = 0; i < pairs.size(); ++i)
      weights[i] = round < 30 ? tukey::weight(off[i], scale) : tukey::belongs(off[i], scale);
    if (!improve(*model, pairs, weights))
      return Error{ErrorKind::kBadInput,
                   "The recorded movement does not tell where the device is: move and turn more."};
  }
  Calibration found;
  found.stage_from_device = model->stage_from_device;
  found.controller_from_tip_m = model->tip;
  found.delay_s = model->delay_s;
  found.all = int(controller.size());
  double sum = 0.0;
  for (size_t i = 0; i < off.size(); ++i) {
    if (weights[i] <= 0.0 || off[i] > 2.0 * options.agree_m) continue;
    sum += off[i] * off[i];
    ++found.used;
  }
  if (2 * found.used <= found.all)
    return Error{
        ErrorKind::kBadInput,
        "The controller's path and the device's do not fit: is the controller clipped tightly "
        "to the stylus, and tracked?"};
  found.rms_m = std::sqrt(sum / double(found.used));
  return found;
}

}  // namespace palpate
