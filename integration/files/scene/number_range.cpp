#include "integration/files/scene/number_range.h"

#include <fmt/format.h>

#include <cmath>

namespace palpate::files {

bool is_in(double value, const NumberRange& range) {
  return std::isfinite(value) && value <= range.high &&
         (range.above_low ? value > range.low : value >= range.low);
}

std::string text_of(const NumberRange& range) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  const std::string unit = *range.unit ? fmt::format(" {}", range.unit) : "";
  if (low && high) return fmt::format("a number from {} to {}{}", range.low, range.high, unit);
  if (!low) return "a number";
  return fmt::format("a number {} {}{}", range.above_low ? "above" : "not below", range.low, unit);
}

std::string out_of_range(std::string_view name, double value, const NumberRange& range) {
  return fmt::format("{} is {}, but {} is expected", name, value, text_of(range));
}

}  // namespace palpate::files
