#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// Seconds per unit of time as people write it ("s", "ms", "us", "min", ...), or nothing if it is
/// no unit of time.
std::optional<double> seconds_per(std::string_view unit);

/// True if every time is finite and later than the one before.
bool is_rising(const std::vector<double>& times);

/// The sentence about times that do not rise, which no sequence can have.
Status check_rising(const std::filesystem::path& file, const std::vector<double>& times);

/// 0, 1, 2, ...: the times of a file that has none.
std::vector<double> counted_times(size_t frames);

}  // namespace palpate::files
