#pragma once

#include <memory>

#include "module/haptics/haptics.h"
#include "tests/haptics/shell_scene.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/studies/hearts.h"

namespace palpate::bench {

using stability::PaperHand;
using stability::PaperLoop;

/// Options without guards, tank and lead: the scene's own force.
HapticsOptions bare();

/// Two figures of many errors.
struct Errors {
  double worst = 0.0, squares = 0.0;
  int64_t count = 0;
  void add(double error) {
    worst = std::max(worst, error);
    squares += error * error;
    ++count;
  }
  double rms() const { return count ? std::sqrt(squares / double(count)) : 0.0; }
};

}  // namespace palpate::bench
