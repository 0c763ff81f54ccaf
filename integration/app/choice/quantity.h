#pragma once

#include <string>

#include "compute/volume/result.h"

namespace palpate::app {

/// "2s", "500ms", "1min", "2": seconds, above zero and finite. kBadInput otherwise, with an
/// example.
Result<double> parse_seconds(const std::string& text);

/// "0.5mm", "500um", "1cm", "0.5": mm. The same.
Result<double> parse_millimetres(const std::string& text);

}  // namespace palpate::app
