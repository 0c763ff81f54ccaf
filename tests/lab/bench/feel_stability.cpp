#include <algorithm>

#include <fmt/format.h>

#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/stability/loop_maps.h"
#include "tests/lab/stability/spring_wall_grid.h"

namespace palpate::bench {
namespace {

using stability::StabilityOutcome;

// Of c: below it the limit for cycles is the goal called reach, beyond it the one called aim.
constexpr double kGoalBelow = 0.95;

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + long(part * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

int cycles_of(const std::vector<StabilityOutcome>& runs) {
  return int(std::count_if(runs.begin(), runs.end(),
                           [](const auto& run) { return run.result.limit_cycle; }));
}

std::vector<Cell> cycles_row(const char* loop, double c,
                             const std::vector<StabilityOutcome>& runs) {
  int hums = 0, felt = 0;
  std::vector<double> counts, forces;
  for (const auto& [at, r] : runs) {
    hums += r.swing_m > at.resolution_m + 1e-6;
    felt += r.force_rms_n > 0.02;
    if (at.resolution_m > 0.0) counts.push_back(r.swing_m / at.resolution_m);
    forces.push_back(r.force_rms_n);
  }
  const auto all = double(runs.size());
  return {words(loop),
          number(c, 2),
          number(all, 0),
          number(cycles_of(runs), 0),
          number(100.0 * hums / all, 3),
          number(quantile(counts, 0.5), 2),
          number(quantile(counts, 0.99), 2),
          number(quantile(counts, 1.0), 2),
          number(quantile(forces, 0.5), 4),
          number(quantile(forces, 0.99), 4),
          number(100.0 * felt / all, 1)};
}

/// A seeded grid of devices, hands and delays against a spring wall.
void limit_cycles(const FeelBench& bench, Findings& findings) {
  Table table{"Limit cycles of a sampled spring wall, over devices, hands and delays",
              fmt::format("K = c b / (T/2 + delay). Lead: the loop takes {:.2f} of the delay back. "
                          "Swing in counts of the encoder.",
                          bench.lead_share),
              {{"loop", "loop"},
               {"c", "c"},
               {"runs", "runs"},
               {"cycles", "cycles"},
               {"over_a_count_percent", "> 1 count, %"},
               {"swing_p50_counts", "swing p50"},
               {"swing_p99_counts", "p99"},
               {"swing_most_counts", "most"},
               {"force_p50_n", "force rms N p50"},
               {"force_p99_n", "p99"},
               {"felt_percent", "> 0.02 N, %"}},
              {}};
  for (const double c : {0.7, 0.8, 0.9, 0.98}) {
    const auto runs_of = [&](double share, int runs) {
      return stability::run_stability_grid(runs, 0, c, share, bench.threads);
    };
    const auto lead = runs_of(bench.lead_share, bench.stability_runs);
    const auto plain = runs_of(0.0, std::max(1, bench.stability_runs / 5));
    table.rows.push_back(cycles_row("plain", c, plain));
    table.rows.push_back(cycles_row("lead", c, lead));
    if (c < 0.9) continue;
    const std::optional<double> none = 0.0;
    findings.goals.push_back(
        {fmt::format("limit cycles at K = {} b / (T/2 + delay), seeded grid", c), "", "runs",
         c < kGoalBelow ? none : std::nullopt, c < kGoalBelow ? std::nullopt : none,
         double(cycles_of(lead)), 0,
         fmt::format("of {} runs; the plain loop {:.1f} % of {}", lead.size(),
                     100.0 * cycles_of(plain) / double(plain.size()), plain.size())});
  }
  findings.details.push_back(std::move(table));
}

/// The worst cell of the maps of a leaning hand, without the tank and with it.
void energy(const FeelBench& bench, Findings& findings) {
  stability::Making making;
  making.quick = bench.quick;
  making.threads = bench.threads;
  double worst_j[2] = {};
  size_t scenes = 0;
  for (const auto& map : {swing_map(making), beat_map(making)}) {
    scenes += map.sides[0].cells.size();
    for (size_t side = 0; side < 2; ++side)
      for (const stability::Cell& cell : map.sides[side].cells)
        worst_j[side] = std::max(worst_j[side], cell.value);
  }
  findings.goals.push_back(
      {"energy that a moving scene makes beyond the tank",
       "unbounded",
       "J",
       1e-6,
       {},
       worst_j[1],
       9,
       fmt::format("without the tank {:.3f}; all {} cells of the maps 'dragged' and 'beating'",
                   worst_j[0], scenes)});
}

}  // namespace

Findings stability_rows(const FeelBench& bench) {
  Findings findings;
  limit_cycles(bench, findings);
  energy(bench, findings);
  return findings;
}

}  // namespace palpate::bench
