// Tables on the reliability of a field: followed points, the cycle, and the way back.
#include <fmt/format.h>

#include "compute/motion/estimator.h"
#include "compute/motion/quality.h"
#include "tests/lab/bench/motion_tables.h"

namespace palpate::bench {
namespace {

std::vector<const char*> presets(const MotionBench& bench) {
  if (bench.quick) return {"fast"};
  return {"fast", "balanced", "best"};
}

/// Returns a result's value, or ends the benchmark with its error.
template <class T>
T got(Result<T> result) {
  if (!result) throw Mismatch(result.error().message);
  return std::move(*result);
}

Field estimated(const MotionBench& bench, const Volume& fixed, const Volume& moving,
                const char* preset) {
  EstimatorOptions options;
  options.motion = *motion_preset(preset);
  return got(estimate_motion(bench.context, fixed, moving, options)).field;
}

/// The fields of a cycle, the last one leading back to frame 0.
std::vector<Field> cycle(const MotionBench& bench, const Sequence& frames, const char* preset) {
  EstimatorOptions options;
  options.motion = *motion_preset(preset);
  options.cyclic = true;
  std::vector<Field> fields(frames.frames.size());
  auto estimator = got(SequenceEstimator::open(
      bench.context, frames.frames[0].grid, options,
      [&](PairMotion motion) { fields[motion.fixed_frame] = std::move(motion.field); }));
  for (size_t k = 0; k < frames.frames.size(); ++k) got(estimator->push(k, frames.frames[k]));
  got(estimator->finish());
  return fields;
}

}  // namespace

Table cycle_table(MotionBench& bench, const CtData& ct) {
  Table table;
  table.title = "Real chest CT, the whole breathing cycle";
  table.note =
      "Target registration error of 400 points on edges, mm, mean of each pair and over all; drift "
      "after following the cycle's eight fields: from the points, and from every voxel of the body "
      "(from frame 1, where the body is known), voxels of the finest axis (1.366 mm).";
  table.columns = {{"preset", "preset"}};
  const size_t frames = ct.breathing.frames.size();
  for (size_t k = 0; k < frames; ++k) {
    table.columns.push_back(
        {fmt::format("tre_{}_mm", k), fmt::format("{} to {}", k, (k + 1) % frames)});
  }
  for (const auto& [key, heading] : {std::pair("tre_mean_mm", "all"),
                                     {"tre_p95_mm", "p95"},
                                     {"tre_max_mm", "max"},
                                     {"folds", "folds"},
                                     {"point_drift_mean_voxels", "points' drift"},
                                     {"point_drift_max_voxels", "max"},
                                     {"body_drift_mean_voxels", "body's drift"},
                                     {"body_drift_p99_voxels", "p99"}})
    table.columns.push_back({key, heading});
  const auto& points = ct.points_lps_mm;
  for (const char* preset : presets(bench)) {
    const std::vector<Field> fields = cycle(bench, ct.breathing, preset);
    std::vector<Cell> row = {words(preset)};
    std::vector<float> all;
    size_t folded = 0;
    for (size_t k = 0; k < frames; ++k) {
      const auto& to = points[(k + 1) % frames];
      const Spread tre = got(target_registration_error_mm(fields[k], points[k], to));
      row.push_back(number(tre.mean, 3));
      for (size_t p = 0; p < to.size(); ++p) {
        const glm::dvec3 arrived = points[k][p] + sample_at_lps(fields[k], points[k][p]);
        all.push_back(float(glm::length(arrived - to[p])));
      }
      folded += folds(resampled(fields[k], ct.breathing.frames[k].grid)).folded;
    }
    const Spread tre = spread_of(all);
    const Grid& grid = ct.breathing.frames[1].grid;
    const Spread of_points_mm = got(cycle_drift_mm(fields, points[0]));
    std::vector<Field> from_1(fields.begin() + 1, fields.end());
    from_1.push_back(fields[0]);
    const Distances of_body = got(cycle_drift(from_1, grid, &*ct.steps.front().mask));
    row.insert(row.end(),
               {number(tre.mean, 3), number(tre.p95, 3), number(tre.max, 2),
                number(double(folded), 0), number(of_points_mm.mean / grid.finest_mm(), 3),
                number(of_points_mm.max / grid.finest_mm(), 2), number(of_body.voxels.mean, 3),
                number(of_body.voxels.p99, 3)});
    table.rows.push_back(row);
    bench.found["drift"][preset] = of_body.voxels.mean;
    bench.found["folds"][preset] += double(folded);
  }
  return table;
}

Table consistency_table(MotionBench& bench, const CtData& ct) {
  Table table;
  table.title = "Inverse consistency, real chest CT, whole breath";
  table.note =
      "|u(x) + w(x + u(x))| inside the body, voxels of the finest axis: w estimated on its own "
      "from "
      "the swapped frames, and w the inverse of u.";
  table.columns = {{"preset", "preset"},          {"two_way_mean_voxels", "estimated backward"},
                   {"two_way_p99_voxels", "p99"}, {"own_mean_voxels", "own inverse"},
                   {"own_p99_voxels", "p99"},     {"not_converged", "voxels without an inverse"}};
  const MotionCase& pair = ct.breath;
  const Grid& grid = pair.fixed.grid;
  for (const char* preset : presets(bench)) {
    const Field u = estimated(bench, pair.fixed, pair.moving, preset);
    const Field w = estimated(bench, pair.moving, pair.fixed, preset);
    const Inverse own = inverse_of(u, grid);
    const Distances two_way = got(inverse_consistency(u, w, grid, &*pair.mask));
    const Distances with_own = got(inverse_consistency(u, own.w, grid, &*pair.mask));
    table.rows.push_back({words(preset), number(two_way.voxels.mean, 3),
                          number(two_way.voxels.p99, 3), number(with_own.voxels.mean, 4),
                          number(with_own.voxels.p99, 4), number(double(own.unconverged), 0)});
    bench.found["inverse mean"][preset] = two_way.voxels.mean;
    bench.found["inverse p99"][preset] = two_way.voxels.p99;
  }
  return table;
}

}  // namespace palpate::bench
