#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "compute/volume/result.h"

namespace palpate::files {

/// "'path' rest": the start of every sentence about a file that can not be used.
template <class... Args>
Error bad_input(const std::filesystem::path& path, fmt::format_string<Args...> rest,
                Args&&... args) {
  return Error{ErrorKind::kBadInput, fmt::format("'{}' {}", path.string(),
                                                 fmt::format(rest, std::forward<Args>(args)...))};
}

/// The same for a file that can not be written.
template <class... Args>
Error bad_output(const std::filesystem::path& path, fmt::format_string<Args...> rest,
                 Args&&... args) {
  return Error{ErrorKind::kBadOutput, fmt::format("'{}' {}", path.string(),
                                                  fmt::format(rest, std::forward<Args>(args)...))};
}

/// 37 -> "37 bytes", 5000000 -> "5.0 MB".
inline std::string bytes_for_people(double bytes) {
  if (bytes < 1e4) return fmt::format("{:.0f} bytes", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  if (bytes < 1e9) return fmt::format("{:.1f} MB", bytes / 1e6);
  return fmt::format("{:.1f} GB", bytes / 1e9);
}

}  // namespace palpate::files
