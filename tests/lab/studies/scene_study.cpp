#include "tests/lab/studies/scene_study.h"

#include <cmath>

#include <fmt/format.h>

#include "compute/motion/estimator.h"
#include "compute/volume/phantom.h"
#include "integration/app/choice/motion_settings.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/studies/feel_runs.h"
#include "tests/lab/studies/fit.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

const char* word(Moves moves) {
  switch (moves) {
    case Moves::kNothing:
      return "still";
    case Moves::kTransform:
      return "transforms move";
    case Moves::kBoth:
      return "transforms and data move";
  }
  return "";
}

/// The voxels nearest to the heart's middle that make up the given share.
Mask ball(const Grid& grid, double share) {
  Mask mask{grid, std::vector<uint8_t>(grid.count(), 1)};
  if (share >= 1.0) return mask;
  const double wide_mm = grid.size.x * grid.spacing_mm.x;
  // Ratio of the volumes of a ball and the cube. Beyond the inscribed ball corners are cut off, so
  // a cube is used.
  const double half_mm = 0.5 * wide_mm * std::cbrt(share);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 away = glm::abs(grid.lps_from_index({i, j, k}));
        mask.values[grid.offset(i, j, k)] = std::max(away.x, std::max(away.y, away.z)) <= half_mm;
      }
  return mask;
}

/// The same pair repeatedly through one estimator; the medians, without the first.
SceneMeasures::Region estimated(const StudyRun& run, const Volume& fixed, const Volume& moving,
                                const std::optional<Mask>& mask, double share) {
  EstimatorOptions options;
  options.motion = *motion_preset("balanced");
  options.mask = mask;
  std::vector<double> solve, prepare;
  SceneMeasures::Region region;
  const auto take = [&](const PairMotion& motion) {
    // Odd pairs lead back.
    if (motion.fixed_frame % 2 != 0 || motion.fixed_frame == 0) return;
    solve.push_back(motion.report.seconds);
    prepare.push_back(motion.report.prepare_seconds);
    region.bricks = 0.0;
    for (const LevelReport& level : motion.report.levels) region.bricks += level.brick_iterations;
  };
  auto estimator = SequenceEstimator::open(run.context, fixed.grid, options, take);
  if (!estimator) throw Mismatch(estimator.error().message);
  for (size_t k = 0; k < size_t(2 * (run.quick ? 1 : run.runs) + 2); ++k)
    if (const Status pushed = (*estimator)->push(k, k % 2 ? moving : fixed); !pushed)
      throw Mismatch(pushed.error().message);
  if (const Status done = (*estimator)->finish(); !done) throw Mismatch(done.error().message);
  if (solve.empty()) throw Mismatch("The estimator delivered no pair.");
  region.share = share;
  region.solve_s = median(solve);
  region.prepare_s = median(prepare);
  return region;
}

Result<report::Part> felt_figure(const SceneMeasures& all) {
  report::Chart chart;
  chart.title = "What is felt: a haptic frame by what is in the scene";
  chart.x = {"Volumes (1)", false, 0.5, 4.5};
  chart.y = {"One haptic frame, median (us)", false, 0.0, {}};
  report::Table table{
      chart.title, "", {{"volumes", "volumes"}, {"moves", "what moves"}, {"median_us", "us"}}, {}};
  for (const Moves moves : {Moves::kNothing, Moves::kTransform, Moves::kBoth}) {
    report::Series series{word(moves), {}, report::Line::kStraight, {}, {}};
    for (const auto& felt : all.felt) {
      if (felt.moves != moves) continue;
      series.points.push_back(
          {double(felt.volumes), felt.median_us, fmt::format("{:.2f} us", felt.median_us)});
      table.rows.push_back({report::number(felt.volumes, 0), report::words(word(moves)),
                            report::number(felt.median_us, 2)});
    }
    chart.series.push_back(series);
  }
  auto svg = drawn(chart, "scenefelt");
  if (!svg) return svg.error();
  return report::Part(
      report::Figure{chart.title, std::move(*svg), "Hearts of 128^3 voxels, a wall each.", table});
}

Result<report::Part> region_figure(const SceneMeasures& all) {
  report::Chart chart;
  chart.title = "What is estimated: a pair by the region that counts";
  chart.x = {"Region of interest (% of the volume)", true, {}, {}};
  chart.y = {"Time of a pair (s)", false, 0.0, {}};
  report::Series solve{"iterations", {}, report::Line::kStraight, {}, {}},
      prepare{"preparing the frame", {}, report::Line::kStraight, {}, {}};
  report::Table table{chart.title,
                      "",
                      {{"region_percent", "region, %"},
                       {"solve_s", "iterations, s"},
                       {"prepare_s", "preparing, s"},
                       {"brick_iterations", "brick iterations"}},
                      {}};
  for (const auto& region : all.regions) {
    const double percent = 100.0 * region.share;
    solve.points.push_back({percent, region.solve_s, fmt::format("{:g} %", percent)});
    prepare.points.push_back({percent, region.prepare_s, fmt::format("{:g} %", percent)});
    table.rows.push_back({report::number(percent, 0), report::number(region.solve_s, 3),
                          report::number(region.prepare_s, 3), report::number(region.bricks, 0)});
  }
  chart.series = {solve, prepare};
  auto svg = drawn(chart, "sceneregion");
  if (!svg) return svg.error();
  return report::Part(report::Figure{chart.title, std::move(*svg),
                                     "A cube about the middle of the beating heart counts: bricks "
                                     "that it does not touch are left out of the iterations, and "
                                     "frames are prepared as far around it as things may move.",
                                     table});
}

double felt_us(const SceneMeasures& all, int volumes, Moves moves) {
  for (const auto& felt : all.felt)
    if (felt.volumes == volumes && felt.moves == moves) return felt.median_us;
  return NAN;
}

}  // namespace

SceneMeasures measure_scene(const StudyRun& run) {
  SceneMeasures all;
  for (const Moves moves : {Moves::kNothing, Moves::kTransform, Moves::kBoth}) {
    for (int volumes = 1; volumes <= 4 && !run.stop.stop_requested(); ++volumes) {
      run.tell(0.03 * double(all.felt.size()),
               fmt::format("scene: {} volumes, {}", volumes, word(moves)));
      all.felt.push_back({volumes, moves, hearts_us(volumes, 1, moves, run.quick ? 4000 : 40000)});
    }
  }
  // A brick is 32 voxels wide on the finest level: smaller volumes would have too few bricks to
  // leave out.
  const Sequence heart = shell_phantom(run.quick ? 128 : 192);
  const Volume &fixed = heart.frames[0], &moving = heart.frames[1];
  const std::vector<double> shares =
      run.quick ? std::vector<double>{1.0, 0.3, 0.1, 0.01}
                : std::vector<double>{1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01};
  std::string left_out;
  for (const double share : shares) {
    if (run.stop.stop_requested()) return all;
    if (run.left_s() == 0.0 && share != shares.front() && share != shares.back()) {
      left_out += fmt::format("{}{:g} %", left_out.empty() ? "" : ", ", 100.0 * share);
      continue;
    }
    run.tell(0.4 + 0.07 * double(all.regions.size()),
             fmt::format("scene: {:g} % of the volume", 100.0 * share));
    all.regions.push_back(estimated(run, fixed, moving, ball(fixed.grid, share), share));
  }
  if (!left_out.empty())
    all.missing.push_back(
        fmt::format("The time was over before all regions were measured (more: "
                    "--minutes). Left out: {} of the volume.",
                    left_out));
  run.tell(0.9, "scene: a pair that does not move");
  all.moving_s = all.regions.front().solve_s;
  all.still_s = estimated(run, fixed, fixed, ball(fixed.grid, 1.0), 1.0).solve_s;
  return all;
}

std::vector<std::string> scene_sentences(const SceneMeasures& all) {
  std::vector<std::string> sentences;
  const double still = felt_us(all, 1, Moves::kNothing), both = felt_us(all, 1, Moves::kBoth),
               transform = felt_us(all, 1, Moves::kTransform);
  if (std::isfinite(still) && std::isfinite(both) && std::isfinite(transform)) {
    sentences.push_back(
        fmt::format("On the wall of a heart a still volume costs the hand {:.2g} us; a moving "
                    "transform adds {:.2g} us, and moving data another {:.2g} us.",
                    still, transform - still, both - transform));
  }
  for (const Moves moves : {Moves::kNothing, Moves::kBoth}) {
    std::vector<std::pair<double, double>> points;
    for (const auto& felt : all.felt)
      if (felt.moves == moves) points.emplace_back(felt.volumes, felt.median_us);
    if (points.size() > 1)
      sentences.push_back(fmt::format("Each further volume ({}) adds {:.2g} us.", word(moves),
                                      line_through(points).slope));
  }
  if (all.regions.size() > 1) {
    const auto &whole = all.regions.front(), &least = all.regions.back();
    sentences.push_back(fmt::format(
        "Where only {:g} % of the volume counts, the iterations take {:.0f} % of the time of the "
        "whole ({:.2g} s of {:.2g} s) for {:.0f} % of its bricks; preparing the frame takes {:.2g} "
        "s instead of {:.2g} s.",
        100.0 * least.share, 100.0 * least.solve_s / whole.solve_s, least.solve_s, whole.solve_s,
        100.0 * least.bricks / whole.bricks, least.prepare_s, whole.prepare_s));
  }
  if (all.moving_s > 0.0 && all.still_s > 0.0)
    sentences.push_back(
        fmt::format("A pair in which nothing moves is solved in {:.2g} % of the "
                    "time of one that does.",
                    100.0 * all.still_s / all.moving_s));
  return sentences;
}

Result<report::Section> scene_section(const SceneMeasures& all) {
  report::Section section{"scene", "Scene: does it pay only for what is there?", "", {}};
  for (const std::string& sentence : scene_sentences(all))
    section.answer += (section.answer.empty() ? "" : " ") + sentence;
  for (const auto& make : {felt_figure, region_figure}) {
    auto part = make(all);
    if (!part) return part.error();
    section.parts.push_back(std::move(*part));
  }
  for (const std::string& sentence : all.missing)
    section.parts.push_back(report::Note{sentence, true});
  return section;
}

}  // namespace palpate::studies
