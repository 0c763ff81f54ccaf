#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::files {

/// Small pieces of text handling that header parsers share. None depends on the locale, none
/// throws.

/// Without white space at both ends.
std::string_view trimmed(std::string_view text);

/// The parts between any of the separators; empty parts are left out.
std::vector<std::string_view> words(std::string_view text, std::string_view separators = " \t\r");

/// The parts between single separators, trimmed; empty parts are kept, as a table needs them.
std::vector<std::string_view> cells(std::string_view text, char separator);

/// ASCII letters in lower case.
std::string lowered(std::string_view text);

/// The whole text as one number, or nothing. "nan" and "inf" are numbers; the caller decides.
std::optional<double> to_number(std::string_view text);
std::optional<int64_t> to_integer(std::string_view text);

/// Every word as a number, or nothing if one of them is none.
std::optional<std::vector<double>> to_numbers(std::string_view text);

/// Cuts the first line off `rest` and returns it without its end (\n or \r\n).
std::string_view take_line(std::string_view& rest);

/// True if a stands before b where runs of digits count as numbers: "frame2" before "frame10".
bool natural_less(std::string_view a, std::string_view b);

}  // namespace palpate::files
