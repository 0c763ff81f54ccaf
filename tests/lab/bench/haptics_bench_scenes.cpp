#include "tests/lab/bench/haptics_bench_scenes.h"

namespace palpate::bench {

HapticsOptions bare() {
  HapticsOptions options;
  options.meter_energy = false;
  options.lead = false;
  return options;
}

}  // namespace palpate::bench
