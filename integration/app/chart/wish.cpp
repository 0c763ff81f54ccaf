#include "integration/app/chart/wish.h"

#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "integration/app/chart/front_file.h"

namespace palpate::app {
namespace {

Error bad(std::string message) {
  return {ErrorKind::kBadInput, std::move(message)};
}

/// A number above zero followed by one of the units, or by none.
Result<double> parse(const std::string& text,
                     std::initializer_list<std::pair<const char*, double>> units,
                     const char* example) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  const std::string unit(rest, end);
  const Error refused =
      bad(fmt::format("'{}' can not be understood: give a number above zero with "
                      "its unit, like {}.",
                      text, example));
  if (error != std::errc() || !std::isfinite(value) || value <= 0.0) return refused;
  for (const auto& [name, factor] : units)
    if (unit == name) return value * factor;
  return refused;
}

}  // namespace

Result<double> parse_seconds(const std::string& text) {
  return parse(text, {{"", 1.0}, {"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}}, "2s or 500ms");
}

Result<double> parse_millimetres(const std::string& text) {
  return parse(text, {{"", 1.0}, {"mm", 1.0}, {"um", 1e-3}, {"cm", 10.0}}, "0.5mm");
}

Result<studies::Choice> choose_setting(const std::string& within, const std::string& error,
                                       const Grid& grid, const std::string& device) {
  const auto limit = within.empty() ? parse_millimetres(error) : parse_seconds(within);
  if (!limit) return limit.error();
  const auto front = read_front(device);
  if (!front) return front.error();
  return within.empty() ? choose_error(*front, *limit, grid.count(), grid.finest_mm())
                        : choose_within(*front, *limit, grid.count(), grid.finest_mm());
}

}  // namespace palpate::app
