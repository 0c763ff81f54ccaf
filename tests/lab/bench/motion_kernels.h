#pragma once

#include "tests/lab/bench/motion_tables.h"

namespace palpate::bench {

/// The time of a pair, kernel by kernel: each is run alone on every level of the plan, between
/// device time stamps, and counted as often as the estimation ran it. Bytes are the minimum: every
/// input once, every output once.
Table kernel_table(const MotionBench& bench, const std::string& preset);

}  // namespace palpate::bench
