#include "integration/app/choice/quantity.h"

#include <charconv>
#include <cmath>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>

namespace palpate::app {
namespace {

Error bad_quantity(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

/// A number above zero followed by one of the units, or by none.
Result<double> parse(const std::string& text,
                     std::initializer_list<std::pair<const char*, double>> units,
                     const char* example) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  std::string unit(rest, end);
  if (unit.starts_with(' ')) unit.erase(0, 1);  // "2 s", as it is printed in texts
  const Error refused =
      bad_quantity(fmt::format("'{}' can not be understood: give a number above zero with "
                               "its unit, like {}.",
                               text, example));
  if (error != std::errc()) return refused;
  for (const auto& [name, factor] : units) {
    const double result = value * factor;  // 1e308cm is finite, but not in mm
    if (unit == name && std::isfinite(result) && result > 0.0) return result;
  }
  return refused;
}

}  // namespace

Result<double> parse_seconds(const std::string& text) {
  return parse(text, {{"", 1.0}, {"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}}, "2s or 500ms");
}

Result<double> parse_millimetres(const std::string& text) {
  return parse(text, {{"", 1.0}, {"mm", 1.0}, {"um", 1e-3}, {"cm", 10.0}}, "0.5mm");
}

}  // namespace palpate::app
