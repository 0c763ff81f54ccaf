#include "tests/lab/studies/motion_study.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "integration/app/choice/motion_front.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

// Of the time that is left: one peer must not take it from all.
constexpr double kPeersShare = 0.25;

double there_and_back_mm(const Field& forward, const Field& backward, const MotionCase& known) {
  const Grid& grid = known.fixed.grid;
  const bool masked = known.mask && same_geometry(known.mask->grid, grid);
  const auto found = inverse_consistency(forward, backward, grid, masked ? &*known.mask : nullptr);
  return found ? found->mm.mean : std::numeric_limits<double>::quiet_NaN();
}

/// Times of one method; equal runs give equal fields, so the last one is scored.
struct Timed {
  PairResult result;
  std::vector<double> seconds;
};

bool agree(const std::vector<double>& seconds) {
  const auto [least, most] = std::minmax_element(seconds.begin(), seconds.end());
  return seconds.size() > 1 && *most - *least <= kTimeMargin * *least;
}

Result<Timed> timed(PairMethod& method, const MotionCase& known, int runs,
                    const report::Patience& patience) {
  Timed all;
  const bool once = method.runs_once();
  for (int n = once ? 0 : -1; n < (once ? 1 : runs) && !agree(all.seconds); ++n) {
    auto result = method.run(known.fixed, known.moving, patience);
    if (!result) return result.error();
    if (n >= 0) all.seconds.push_back(result->seconds);
    all.result = std::move(*result);
  }
  return all;
}

/// A row must be complete soon: a way back that takes longer than this is left out.
constexpr double kLongestWayBackS = 10.0;

/// Whether to estimate the way back: for palpate, in a quick run only for presets.
bool goes_back(const StudyRun& run, const PairMethod& method, const MotionMeasure& row) {
  if (row.seconds > std::min(kLongestWayBackS, run.left_s())) return false;
  return run.quick ? method.is_preset() : true;
}

Result<MotionMeasure> measured(const StudyRun& run, PairMethod& method, const MotionCase& known) {
  const report::Patience patience{run.stop,
                                  method.is_ours() ? run.left_s() : kPeersShare * run.left_s()};
  auto all = timed(method, known, run.runs, patience);
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
  row.device_bytes = all->result.device_bytes;
  const auto error = error_of(all->result.field, known);
  if (!error) return error.error();
  row.error_mm = error->mm.mean;
  row.error_p95_mm = error->mm.p95;
  row.own_voxels = error->own_voxels.mean;
  row.own_voxels_p95 = error->own_voxels.p95;
  if (method.is_preset() && known.truth && all->result.confidence)
    row.reliability =
        reliability_of(all->result.field, *all->result.confidence, *known.truth,
                       known.mask ? &*known.mask : nullptr, kRightVoxels * known.voxel_mm());
  const Field field = resampled(all->result.field, known.fixed.grid);
  row.folded = folds(field).folded;
  if (goes_back(run, method, row)) {
    auto way_back = method.run(known.moving, known.fixed, patience);
    if (way_back) row.there_and_back_mm = there_and_back_mm(field, way_back->field, known);
  }
  return row;
}

std::string comma_list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : "; ") + name;
  return text;
}

}  // namespace

std::vector<std::unique_ptr<PairMethod>> palpate_methods(const StudyRun& run, bool few) {
  std::vector<std::unique_ptr<PairMethod>> methods;
  for (app::MotionSetting& setting : app::motion_settings(few))
    methods.push_back(palpate_method(run.context, std::move(setting)));
  return methods;
}

MotionMeasures measure_motion(const StudyRun& run, const MotionCase& known,
                              std::vector<std::unique_ptr<PairMethod>> methods) {
  MotionMeasures all{known.id, known.name, known.fixed.grid.count(), known.voxel_mm(), 0.0, {}, {}};
  const auto still = error_of(still_field(known.fixed.grid), known);
  if (!still) throw Mismatch(still.error().message);
  all.still_error_mm = still->mm.mean;
  std::vector<std::string> left_out;
  double whole = 0.0, done = 0.0;
  for (const auto& method : methods) whole += method->weight();
  for (size_t n = 0; n < methods.size() && !run.stop.stop_requested(); ++n) {
    const std::unique_ptr<PairMethod> one = std::move(methods[n]);
    PairMethod& method = *one;
    if (run.left_s() == 0.0) {
      left_out.push_back(method.name());
      continue;
    }
    run.tell(done / whole, known.id + ": " + method.name());
    done += method.weight();
    auto row = measured(run, method, known);
    if (row) {
      all.rows.push_back(std::move(*row));
    } else if (run.stop.stop_requested()) {
      break;
    } else if (method.is_ours()) {
      throw Mismatch(row.error().message);
    } else {
      all.missing.push_back(fmt::format("{} ({}) was not measured: {}", method.name(),
                                        method.family(), row.error().message));
    }
  }
  if (!left_out.empty())
    all.missing.push_back(
        fmt::format("The time was over before all was measured (more: "
                    "--minutes). Left out: {}.",
                    comma_list(left_out)));
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
       {"there_and_back_mm", "inverse consistency, mm"},
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

app::MotionFront front_of(const MotionMeasures& measures, const std::string& device,
                          const std::string& version) {
  app::MotionFront front{device, version, measures.name, measures.voxels, {}};
  std::vector<report::Costs> costs;
  std::vector<const MotionMeasure*> ours;
  for (const MotionMeasure& row : measures.rows) {
    if (!row.ours || !row.careful || row.folded > 0) continue;
    ours.push_back(&row);
    costs.push_back(row.costs());
  }
  for (const size_t n : report::pareto_front(costs))
    front.points.push_back({ours[n]->name, ours[n]->seconds, ours[n]->error_voxels()});
  return front;
}

}  // namespace palpate::studies
