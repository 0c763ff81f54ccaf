#pragma once

#include "integration/report/table.h"

namespace palpate::bench {

/// The benchmarks' tables are the report's.
using namespace palpate::report;

}  // namespace palpate::bench
