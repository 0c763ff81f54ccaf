#pragma once

#include "integration/app/commands.h"

namespace palpate::app {

/// `palpate chart stability`: maps of where methods fail.
Command add_chart_stability(CLI::App& chart);

}  // namespace palpate::app
