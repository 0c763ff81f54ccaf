#pragma once

#include <limits>
#include <string>
#include <string_view>

namespace palpate::files {

/// The numbers that an option or a key takes, in its unit.
struct NumberRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;  ///< low itself is not allowed
  const char* unit = "";   ///< of low and high; "" for a pure number
};
inline constexpr NumberRange kAnyNumber{};
inline constexpr NumberRange kNotNegative{0.0};
inline constexpr NumberRange kPositive{0.0, std::numeric_limits<double>::infinity(), true};

/// The same range in a unit of which `per_unit` are one of the range's own: {0.001, 1, "s"} is
/// {1, 1000, "ms"}.
constexpr NumberRange in_unit(const NumberRange& range, double per_unit, const char* unit) {
  return {per_unit * range.low, per_unit * range.high, range.above_low, unit};
}

/// False also for values that are not finite.
bool is_in(double value, const NumberRange& range);

/// "a number from 1 to 5 N", "a number above 0", "a number not below 0", "a number".
std::string text_of(const NumberRange& range);

/// "watchdog_s is 5, but a number from 0.001 to 1 s is expected".
std::string out_of_range(std::string_view name, double value, const NumberRange& range);

}  // namespace palpate::files
