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

}  // namespace palpate::files
