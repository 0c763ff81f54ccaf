#pragma once

#include <vector>

#include "tests/lab/report/page.h"
#include "tests/lab/studies/motion_study.h"

namespace palpate::studies {

/// Motion's part of the report: for each pair error over time with the front, what to take,
/// and the table. Errors: kBadInput if matplotlib is missing.
Result<report::Section> motion_section(const std::vector<MotionMeasures>& pairs);

}  // namespace palpate::studies
