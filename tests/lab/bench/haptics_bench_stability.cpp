#include <algorithm>

#include <fmt/format.h>

#include "module/haptics/delay_lead.h"
#include "tests/lab/bench/haptics_bench.h"
#include "tests/lab/stability/leaning_hand.h"
#include "tests/lab/stability/shell.h"
#include "tests/lab/stability/spring_wall_grid.h"

namespace palpate::bench {
namespace {

struct Cycles {
  int runs = 0, found = 0;
  double percent() const { return 100.0 * found / std::max(1, runs); }
};

Cycles cycles(int runs, double c, double share, unsigned threads) {
  Cycles cycles{runs, 0};
  for (const auto& run : stability::run_stability_grid(runs, 0, c, share, threads))
    cycles.found += run.result.limit_cycle;
  return cycles;
}

void limit_cycles(const HapticsBench& bench, Findings& findings) {
  for (const double c : {0.9, 0.98}) {
    const Cycles lead = cycles(bench.stability_runs, c, DelayLead::kShare, bench.threads);
    const Cycles plain = cycles(std::max(1, bench.stability_runs / 5), c, 0.0, bench.threads);
    findings.goals.push_back(
        {fmt::format("limit cycles at K = {} b / (T/2 + delay), seeded grid", c), "", "runs",
         c < 0.95 ? std::optional(0.0) : std::nullopt, c < 0.95 ? std::nullopt : std::optional(0.0),
         double(lead.found), 0,
         fmt::format("of {} runs; the plain loop {:.1f} % of {}", lead.runs, plain.percent(),
                     plain.runs)});
  }
}

void energy(const HapticsBench& bench, Findings& findings) {
  double with = 0.0, without = 0.0;
  int scenes = 0;
  const double seconds = bench.quick ? 2.0 : 10.0;
  for (const auto& data :
       {stability::shell(1, 1.0), stability::shell(4, 4.0), stability::shell(4, 20.0)})
    for (const double amplitude_m : {0.005, 0.02, 0.05})
      for (const double hz : {1.2, 3.0, 6.0, 10.0}) {
        const stability::LeaningCase at{
            .amplitude_m = amplitude_m, .swing_hz = hz, .seconds = seconds};
        with = std::max(with, stability::lean(at, true, data).beyond_j);
        without = std::max(without, stability::lean(at, false, data).beyond_j);
        ++scenes;
      }
  findings.goals.push_back(
      {"energy that a moving scene makes beyond the tank",
       "unbounded",
       "J",
       1e-6,
       {},
       with,
       9,
       fmt::format("without the tank {:.3f}; {} scenes, wall to 50 mm at 10 Hz", without, scenes)});
}

}  // namespace

Findings stability_rows(const HapticsBench& bench) {
  Findings findings;
  limit_cycles(bench, findings);
  energy(bench, findings);
  return findings;
}

}  // namespace palpate::bench
