#include "tests/lab/stability/spring_wall_grid.h"

#include <atomic>
#include <thread>

namespace palpate::stability {

std::vector<StabilityOutcome> run_stability_grid(int runs, uint32_t seed, double c,
                                                 double lead_share, unsigned threads) {
  std::vector<StabilityOutcome> done(size_t(runs), StabilityOutcome{});
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int n = next++; n < runs; n = next++) {
      StabilityOutcome& run = done[size_t(n)];
      run.at = stability_case(seed + uint32_t(n), c);
      run.result = run_stability(run.at, lead_share);
    }
  };
  std::vector<std::jthread> others;
  for (unsigned n = 1; n < threads; ++n) others.emplace_back(work);
  work();
  others.clear();
  return done;
}

}  // namespace palpate::stability
