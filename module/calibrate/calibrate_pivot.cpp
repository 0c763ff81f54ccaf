#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "module/calibrate/calibrate.h"
#include "module/calibrate/least_squares.h"
#include "module/calibrate/rotation_spread.h"
#include "module/calibrate/tukey.h"

namespace palpate {
namespace {

constexpr size_t kFewestPivotSamples = 100;
constexpr int kPivotSubsets = 300, kPivotSubset = 6;
constexpr double kLeastPivotTurn = 0.17;  // rad, RMS, about the second axis: 10 degrees

struct PivotModel {
  glm::dvec3 tip{0.0}, place{0.0};
  double off_m(const Pose& controller) const { return glm::distance(controller(tip), place); }
};

/// Least squares of R x - p = -t over the poses with their weights.
std::optional<PivotModel> least_squares(std::span<const ControllerSample> controller,
                                        std::span<const double> weights) {
  LeastSquares fit(6);
  for (size_t i = 0; i < controller.size(); ++i) {
    if (weights[i] <= 0.0) continue;
    const Pose& pose = controller[i].stage_from_controller;
    const glm::dmat3 turn = glm::mat3_cast(pose.rotation);
    for (int c = 0; c < 3; ++c) {
      std::array<double, 6> row{};
      for (int k = 0; k < 3; ++k) row[size_t(k)] = turn[k][c];
      row[size_t(3 + c)] = -1.0;
      fit.add(row, -pose.position_m[c], weights[i]);
    }
  }
  const auto x = fit.solve();
  if (!x) return std::nullopt;
  return PivotModel{{(*x)[0], (*x)[1], (*x)[2]}, {(*x)[3], (*x)[4], (*x)[5]}};
}

std::vector<double> offs(const PivotModel& model, std::span<const ControllerSample> controller) {
  std::vector<double> off;
  off.reserve(controller.size());
  for (const ControllerSample& sample : controller)
    off.push_back(model.off_m(sample.stage_from_controller));
  return off;
}

/// The model of the subset that most poses agree with.
std::optional<PivotModel> start(std::span<const ControllerSample> controller, uint32_t seed) {
  std::mt19937 random(seed);
  std::optional<PivotModel> best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kPivotSubsets; ++i) {
    std::vector<ControllerSample> subset;
    for (int k = 0; k < kPivotSubset; ++k)
      subset.push_back(controller[random() % controller.size()]);
    const auto model = least_squares(subset, std::vector<double>(kPivotSubset, 1.0));
    if (!model) continue;
    const double off = tukey::scale(offs(*model, controller));
    if (off >= least) continue;
    least = off;
    best = model;
  }
  return best;
}

}  // namespace

Result<Pivot> find_pivot(std::span<const ControllerSample> controller,
                         const CalibrationOptions& options) {
  if (controller.size() < kFewestPivotSamples)
    return Error{ErrorKind::kBadInput,
                 "The headset saw the controller too seldom: turn it where the headset sees it."};
  if (rotation_spread_rad(controller) < kLeastPivotTurn)
    return Error{
        ErrorKind::kBadInput,
        "The controller was hardly turned: tilt it to all sides and roll it, with its tip at "
        "rest."};
  auto model = start(controller, options.seed);
  if (!model)
    return Error{ErrorKind::kBadInput,
                 "The turning does not tell where the tip is: turn the controller more."};
  std::vector<double> weights(controller.size());
  for (int round = 0; round < 30; ++round) {
    const std::vector<double> off = offs(*model, controller);
    // The first fit is coarse: at first everything within the allowed agreement counts.
    const double scale =
        round < 3 ? std::max(tukey::scale(off), options.agree_m) : tukey::scale(off);
    for (size_t i = 0; i < off.size(); ++i)
      weights[i] = round < 20 ? tukey::weight(off[i], scale) : tukey::belongs(off[i], scale);
    const auto better = least_squares(controller, weights);
    if (!better)
      return Error{ErrorKind::kBadInput,
                   "The turning does not tell where the tip is: turn the controller more."};
    model = better;
  }
  Pivot found{model->tip, model->place, 0.0, 0, int(controller.size())};
  double sum = 0.0;
  const std::vector<double> off = offs(*model, controller);
  for (size_t i = 0; i < off.size(); ++i) {
    if (weights[i] <= 0.0 || off[i] > 2.0 * options.agree_m) continue;
    sum += off[i] * off[i];
    ++found.used;
  }
  if (2 * found.used <= found.all)
    return Error{ErrorKind::kBadInput,
                 "The controller's tip did not rest: put it into a dent that holds it, and turn."};
  found.rms_m = std::sqrt(sum / double(found.used));
  return found;
}

}  // namespace palpate
