// Tables of synthetic data: heart, sliding organ, and the classic method's rate.
#include <algorithm>

#include <fmt/format.h>

#include "compute/motion/options.h"
#include "compute/motion/quality.h"
#include "compute/volume/phantom.h"
#include "tests/lab/bench/accuracy_tables.h"
#include "tests/lab/bench/contender.h"

namespace palpate::bench {
namespace {

Spread error_in(const Field& field, const Field& truth, const Mask& mask) {
  const auto error = endpoint_error(field, truth, &mask);
  if (!error) throw Mismatch(error.error().message);
  return error->voxels;
}

std::vector<Cell> row(const std::string& what, const std::string& who, const Spread& error,
                      size_t folded, double seconds) {
  return {words(what),
          words(who),
          number(error.mean, 3),
          number(error.p95, 3),
          number(double(folded), 0),
          number(seconds, 3)};
}

std::vector<std::unique_ptr<Contender>> contenders_on(const AccuracyBench& bench,
                                                      const peers::KnownPair& pair) {
  std::vector<std::unique_ptr<Contender>> result;
  for (const std::string_view preset : kMotionPresets) {
    result.push_back(
        palpate_contender(bench.context, std::string(preset), *motion_preset(preset), pair));
  }
  result.push_back(itk_contender(itk_settings(bench.threads).front()));
  return result;
}

std::string short_name(const Contender& contender) {
  return contender.cold_s() > 0.0 ? contender.name() : "ITK";
}

void add_heart(AccuracyBench& bench, Table& table) {
  const Sequence heart = shell_phantom();
  const Grid& grid = heart.frames[0].grid;
  const peers::KnownPair pair{heart.frames[0], heart.frames[1], shell_truth(grid, 0, 1),
                              shell_mask(grid, 0)};
  for (auto& contender : contenders_on(bench, pair)) {
    const Outcome outcome = contender->run(pair.fixed, pair.moving);
    const Spread error = error_in(outcome.field, pair.truth, pair.body);
    const size_t folded = folds(outcome.field).folded;
    table.rows.push_back(row("heart, shell", contender->name(), error, folded, outcome.seconds));
    bench.found["heart"][short_name(*contender)] = error.mean;
    bench.found["folds"][short_name(*contender)] += double(folded);
  }
}

void add_sliding(AccuracyBench& bench, Table& table) {
  const SlidingPhantom slide = sliding_phantom();
  const peers::KnownPair pair{slide.fixed, slide.moving, slide.truth, slide.organ};
  for (auto& contender : contenders_on(bench, pair)) {
    const Outcome outcome = contender->run(pair.fixed, pair.moving);
    const Spread organ = error_in(outcome.field, slide.truth, slide.organ);
    const Spread wall = error_in(outcome.field, slide.truth, slide.wall);
    const size_t folded = folds(outcome.field).folded;
    const std::string who = contender->name();
    table.rows.push_back(row("sliding, organ", who, organ, folded, outcome.seconds));
    table.rows.push_back(row("sliding, wall", who, wall, folded, outcome.seconds));
    bench.found["organ"][short_name(*contender)] = organ.mean;
    bench.found["wall"][short_name(*contender)] = wall.mean;
    bench.found["folds"][short_name(*contender)] += double(folded);
  }
}

}  // namespace

Table made_table(AccuracyBench& bench) {
  Table table;
  table.title = "Synthetic data: beating heart, organ sliding 20 voxels past a still wall";
  table.note =
      "Endpoint error in voxels (1 mm, isotropic): on the heart's wall, 128^3; in the organ, and "
      "in "
      "the wall within 5 voxels of the border, 96^3, noise 2 %. One run each, kernels warm.";
  table.columns = {{"case", "case"},
                   {"method", "method"},
                   {"error_mean_voxels", "mean"},
                   {"error_p95_voxels", "p95"},
                   {"folds", "folds"},
                   {"seconds", "s"}};
  add_heart(bench, table);
  add_sliding(bench, table);
  return table;
}

Table rate_table(AccuracyBench& bench) {
  constexpr int kSize = 128, kIterations = 25, kItkIterations = 12;
  constexpr double kSigma = 1.0;
  const Sequence heart = shell_phantom(kSize);
  MotionOptions options = *motion_preset("classic");
  options.coarse_levels = 1;
  options.levels = {{kIterations, 1}};
  WarmPair pair(bench.context, heart.frames[0].grid, options);
  demand_same_as_public(bench.context, pair.run(heart.frames[0], heart.frames[1]), heart.frames[0],
                        heart.frames[1], options);
  std::vector<double> ours, itks;
  for (int run = 0; run < bench.runs; ++run) {
    ours.push_back(pair.run(heart.frames[0], heart.frames[1]).report.levels.at(0).seconds /
                   kIterations);
    const auto itk = peers::itk_demons_rate(kSize, kItkIterations, kSigma, bench.threads);
    if (!itk) throw Mismatch(itk.error().message);
    if (!(itk->mean_square_last < itk->mean_square_first))
      throw Mismatch("ITK's Demons did not register its pair, so its rate means nothing.");
    itks.push_back(itk->seconds_per_iteration);
  }
  const double ours_s = median(ours), itk_s = median(itks);
  const double voxels = double(kSize) * kSize * kSize;
  Table table;
  table.title = "classic against ITK's Demons, per iteration";
  table.note = fmt::format(
      "128^3, one level, every voxel computed, Gauss of 1 voxel, {} threads, medians of {} in "
      "alternation.",
      bench.threads, bench.runs);
  table.columns = {{"method", "method"},
                   {"iteration_s", "s per iteration"},
                   {"voxel_iterations_per_s", "million voxel-iterations/s"},
                   {"times", "times ITK"}};
  const auto add = [&](const char* who, double each_s) {
    table.rows.push_back({words(who),
                          number(each_s, 4),
                          {fmt::format("{:.1f}", 1e-6 * voxels / each_s), voxels / each_s},
                          number(itk_s / each_s, 2)});
  };
  add("palpate classic", ours_s);
  add("ITK DemonsRegistrationFilter", itk_s);
  bench.found["classic rate"]["classic"] = itk_s / ours_s;
  return table;
}

}  // namespace palpate::bench
