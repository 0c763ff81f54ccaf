#include <fmt/format.h>

#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/studies/feel_runs.h"

namespace palpate::bench {
namespace {

using stability::Made;

/// The sphere of the chart, still, or beating and rotating. Every point of palpate's must be found.
FeelMeasure against_sphere(const FeelBench& bench, Moves moves, Made made, bool paper) {
  FeelSetting setting{"sphere", paper ? "the paper's loop" : "palpate", paper, moves};
  setting.method = paper ? BackTracking::kPicard : BackTracking::kNewton;
  setting.made = made;
  FeelMeasure measure = feel(setting, int(bench.part(40)));
  if (!paper && measure.held > 0)
    throw Mismatch("A back-tracking failed on the sphere: it has no folds.");
  return measure;
}

}  // namespace

Findings force_rows(const FeelBench& bench) {
  Findings findings;
  for (const Moves moves : {Moves::kBoth, Moves::kNothing}) {
    const FeelMeasure paper = against_sphere(bench, moves, Made::kAnalytic, true);
    const bool moving = moves == Moves::kBoth;
    for (const Made made : {Made::kAnalytic, Made::kSampled}) {
      const FeelMeasure ours = against_sphere(bench, moves, made, false);
      const std::string what =
          fmt::format("{} sphere, {}, probe to 100 mm/s: force error ",
                      moving ? "beating and turning" : "still",
                      made == Made::kAnalytic ? "data as a formula" : "data sampled at 1 mm");
      if (moving) {
        findings.goals.push_back({what + "RMS", "", "N", 0.01, 0.003, ours.rms_n, 4,
                                  fmt::format("the paper's loop, formula: {:.3f}", paper.rms_n)});
      } else {
        findings.goals.push_back(
            {what + "RMS", "", "%", 0.5, 0.1, ours.percent(), 3,
             fmt::format("the paper's loop, formula: {:.2f}", paper.percent())});
      }
      findings.goals.push_back({what + "max",
                                "",
                                "N",
                                moving ? 0.05 : 0.02,
                                {},
                                ours.most_n,
                                4,
                                fmt::format("the paper's loop, formula: {:.3f}", paper.most_n)});
    }
  }
  return findings;
}

}  // namespace palpate::bench
