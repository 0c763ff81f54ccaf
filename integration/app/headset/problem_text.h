#pragma once

#include <string>

#include "module/xr/problem.h"

namespace palpate::app {

/// The sentence on a problem; with --verbose also the call that failed.
std::string problem_text(const xr::Problem& problem);

}  // namespace palpate::app
