#pragma once

#include "tests/lab/report/table.h"
#include "tests/lab/studies/measuring.h"
#include "tests/lab/studies/other_load.h"

namespace palpate::bench {

/// Tables and clocks are those of the report.
using namespace palpate::report;
using namespace palpate::studies;

}  // namespace palpate::bench
