#pragma once

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/stability/map.h"

/// Maps as parts of a report.
namespace palpate::stability {

/// A section with the map's meaning as its answer and one picture: the methods side by side in the
/// same colours, dots for reported failures, crosses for silent ones, and the theoretical border.
/// Errors: as report::drawn().
Result<report::Section> section_of(const StabilityMap& map);

/// Every cell as a row.
report::Table table_of(const StabilityMap& map);

/// The cells of all methods and maps together, in one sentence.
std::string whole_meaning(const std::vector<StabilityMap>& maps);

}  // namespace palpate::stability
