#pragma once

#include "integration/report/table.h"
#include "integration/studies/measuring.h"
#include "integration/studies/other_load.h"

namespace palpate::bench {

/// Tables and clocks are those of the report.
using namespace palpate::report;
using namespace palpate::studies;

}  // namespace palpate::bench
