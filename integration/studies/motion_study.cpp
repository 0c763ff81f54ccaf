#include "integration/studies/motion_study.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "integration/studies/measuring.h"

namespace palpate::studies {
namespace {

double there_and_back_mm(const Field& forward, const Field& backward, const MotionCase& known) {
  const Grid& grid = known.fixed.grid;
  const bool masked = known.mask && same_geometry(known.mask->grid, grid);
  const auto found = inverse_consistency(forward, backward, grid, masked ? &*known.mask : nullptr);
  return found ? found->mm.mean : std::numeric_limits<double>::quiet_NaN();
}

/// Times of one method; the fields of equal runs are equal, so the last one is scored.
struct Timed {
  PairResult result;
  std::vector<double> seconds;
};

Result<Timed> timed(PairMethod& method, const MotionCase& known, int runs) {
  Timed all;
  const int warm_up = method.runs_once() ? 0 : 1;
  for (int n = -warm_up; n < (method.runs_once() ? 1 : runs); ++n) {
    auto result = method.run(known.fixed, known.moving);
    if (!result) return result.error();
    if (n >= 0) all.seconds.push_back(result->seconds);
    all.result = std::move(*result);
  }
  return all;
}

Result<MotionMeasure> measured(PairMethod& method, const MotionCase& known, int runs, bool back) {
  auto all = timed(method, known, runs);
  if (!all) return all.error();
  MotionMeasure row;
  row.name = method.name();
  row.family = method.family();
  row.ours = method.is_ours();
  row.preset = method.is_preset();
  row.careful = method.is_careful();
  row.seconds = median(all->seconds);
  const auto [least, most] = std::minmax_element(all->seconds.begin(), all->seconds.end());
  row.spread_share = (*most - *least) / row.seconds;
  row.voxel_mm = known.voxel_mm();
  row.work_bytes = all->result.work_bytes;
  const auto error = error_mm(all->result.field, known);
  if (!error) return error.error();
  row.error_mm = error->mean;
  row.error_p95_mm = error->p95;
  const Field field = resampled(all->result.field, known.fixed.grid);
  row.folded = folds(field).folded;
  if (back) {
    auto way_back = method.run(known.moving, known.fixed);
    if (way_back) row.there_and_back_mm = there_and_back_mm(field, way_back->field, known);
  }
  return row;
}

}  // namespace

std::vector<std::unique_ptr<PairMethod>> palpate_methods(const StudyRun& run) {
  std::vector<std::unique_ptr<PairMethod>> methods;
  for (MotionSetting& setting : motion_settings(run.quick))
    methods.push_back(palpate_method(run.context, std::move(setting)));
  return methods;
}

MotionMeasures measure_motion(const StudyRun& run, const MotionCase& known,
                              std::vector<std::unique_ptr<PairMethod>> methods,
                              const MotionStudyOptions& options) {
  MotionMeasures all{known.id, known.name, known.fixed.grid.count(), known.voxel_mm(), 0.0, {}, {}};
  const auto still = error_mm(still_field(known.fixed.grid), known);
  if (!still) throw Mismatch(still.error().message);
  all.still_error_mm = still->mean;
  for (size_t n = 0; n < methods.size() && !run.stop.stop_requested(); ++n) {
    const std::unique_ptr<PairMethod> one = std::move(methods[n]);
    PairMethod& method = *one;
    run.tell(double(n) / double(methods.size()), known.id + ": " + method.name());
    // A quick run asks for the way back of what people use: the presets.
    const bool ours_back = !method.runs_once() && (method.is_preset() || !run.quick);
    const bool back = method.is_ours() ? ours_back : options.peers_back;
    auto row = measured(method, known, run.runs, back);
    if (row) {
      all.rows.push_back(std::move(*row));
    } else if (method.is_ours()) {
      throw Mismatch(row.error().message);
    } else {
      all.missing.push_back(fmt::format("{} ({}) was not measured: {}", method.name(),
                                        method.family(), row.error().message));
    }
  }
  return all;
}

report::Table motion_table(const MotionMeasures& measures) {
  using report::nothing;
  using report::number;
  report::Table table{
      "Every measurement: " + measures.name,
      fmt::format("Without any motion the error is {:.3f} mm. Spread: (longest - "
                  "shortest) / median of the timed runs. Work: bytes moved, counted "
                  "from what was iterated, without a clock.",
                  measures.still_error_mm),
      {{"method", "method"},
       {"family", "family"},
       {"seconds", "s"},
       {"spread_percent", "spread, %"},
       {"error_mean_mm", "error, mm"},
       {"error_p95_mm", "95 %, mm"},
       {"error_mean_voxels", "error, voxels"},
       {"folds", "folds"},
       {"there_and_back_mm", "there and back, mm"},
       {"work_gigabytes", "work, GB"}},
      {}};
  for (const MotionMeasure& row : measures.rows) {
    table.rows.push_back(
        {report::words(row.name), report::words(row.family), number(row.seconds, 3),
         row.spread_share > 0.0 ? number(100.0 * row.spread_share, 0) : nothing(),
         number(row.error_mm, 3), number(row.error_p95_mm, 3), number(row.error_voxels(), 3),
         number(double(row.folded), 0),
         std::isfinite(row.there_and_back_mm) ? number(row.there_and_back_mm, 3) : nothing(),
         std::isfinite(row.work_bytes) ? number(1e-9 * row.work_bytes, 2) : nothing()});
  }
  return table;
}

}  // namespace palpate::studies
