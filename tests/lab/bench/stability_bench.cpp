// How many of a seeded grid of devices, hands and delays hum against a spring wall of c times the
// stiffness b / (T/2 + delay): the plain loop and the loop with the lead, in the same run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include "module/haptics/delay_lead.h"
#include "tests/lab/stability/spring_wall_grid.h"

namespace palpate::stability {
namespace {

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + long(part * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void print_row(const char* loop, double c, const std::vector<StabilityOutcome>& runs) {
  int cycles = 0, hums = 0, felt = 0;
  std::vector<double> counts, forces;
  for (const auto& [at, r] : runs) {
    cycles += r.limit_cycle;
    hums += r.swing_m > at.resolution_m + 1e-6;
    felt += r.force_rms_n > 0.02;
    if (at.resolution_m > 0.0) counts.push_back(r.swing_m / at.resolution_m);
    forces.push_back(r.force_rms_n);
  }
  const double all = double(runs.size());
  fmt::print(
      "{:5}  {:4.2f}  {:7}  {:6}  {:8.3f} %  {:8.3f} %  {:6.2f}  {:6.2f}  {:6.2f}  {:8.4f}  "
      "{:8.4f}  {:6.1f} %\n",
      loop, c, runs.size(), cycles, 100.0 * (1.0 - cycles / all), 100.0 * hums / all,
      quantile(counts, 0.5), quantile(counts, 0.99), quantile(counts, 1.0), quantile(forces, 0.5),
      quantile(forces, 0.99), 100.0 * felt / all);
  std::fflush(stdout);
}

void write_rows(std::FILE* csv, const char* loop, double c,
                const std::vector<StabilityOutcome>& runs) {
  for (const auto& [at, r] : runs) {
    fmt::print(
        csv, "{},{},{:.6g},{:.6g},{:.6g},{:.6g},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{}\n",
        loop, c, at.body.mass_kg, at.body.damping_n_s_per_m, at.delay_s, at.resolution_m,
        hand_name(at.hand), at.body.hand.stiffness_n_per_m, at.stiffness_n_per_m, at.press_n,
        at.impact_m_per_s, r.swing_m, r.force_rms_n, int(r.limit_cycle));
  }
}

}  // namespace
}  // namespace palpate::stability

int main(int argc, char** argv) {
  using namespace palpate;
  using namespace palpate::stability;
  CLI::App app("Limit cycles of a sampled spring wall, over devices, hands and delays.");
  int runs = 10000;
  uint32_t seed = 0;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  std::vector<double> levels = {0.7, 0.8, 0.9, 0.98};
  double share = DelayLead::kShare;
  std::string file, loops = "both";
  app.add_option("--runs", runs, "runs of each row")->check(CLI::Range(1, 100'000'000));
  app.add_option("--seed", seed, "first seed");
  app.add_option("--c", levels, "stiffness in parts of b / (T/2 + delay)")->delimiter(',');
  app.add_option("--share", share, "of the delay that the lead takes back");
  app.add_option("--loop", loops, "plain, lead or both")
      ->check(CLI::IsMember({"plain", "lead", "both"}));
  app.add_option("--threads", threads, "at a time");
  app.add_option("--csv", file, "every run as a row of this file");
  CLI11_PARSE(app, argc, argv);
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> csv(nullptr, &std::fclose);
  if (!file.empty()) {
    csv.reset(std::fopen(file.c_str(), "w"));
    if (!csv) {
      fmt::print(stderr, "'{}' can not be written: check the folder and the permissions\n", file);
      return 2;
    }
    fmt::print(csv.get(),
               "loop,c,mass_kg,damping_n_s_per_m,delay_s,resolution_m,hand,hand_n_per_m,"
               "stiffness_n_per_m,press_n,impact_m_per_s,swing_m,force_rms_n,limit_cycle\n");
  }
  fmt::print(
      "loop      c     runs  cycles    without    > 1 count   swing, counts: p50  p99  max  "
      "force rms N: p50, p99   > 0.02 N\n");
  for (const double c : levels) {
    for (const bool leads : {false, true}) {
      if (loops == (leads ? "plain" : "lead")) continue;
      const auto done = run_stability_grid(runs, seed, c, leads ? share : 0.0, threads);
      print_row(leads ? "lead" : "plain", c, done);
      if (csv) write_rows(csv.get(), leads ? "lead" : "plain", c, done);
    }
  }
  return 0;
}
