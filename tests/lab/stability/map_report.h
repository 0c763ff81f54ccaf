#pragma once

#include "compute/volume/result.h"
#include "tests/lab/report/page.h"
#include "tests/lab/stability/map.h"

/// Maps as parts of a report.
namespace palpate::stability {

/// A section with the map's meaning as its answer and one picture: the methods beside each other
/// in the same colours, dots where a method failed and said so, crosses where it failed unseen, and
/// the border of theory. Errors: as report::drawn(). Starts gnuplot once a method.
Result<report::Section> section_of(const StabilityMap& map);

/// Every cell as a row.
report::Table table_of(const StabilityMap& map);

/// All methods' cells of all maps together, in one sentence.
std::string whole_meaning(const std::vector<StabilityMap>& maps);

}  // namespace palpate::stability
