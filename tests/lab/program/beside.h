#pragma once

#include <filesystem>
#include <optional>

namespace palpate::app {

/// The program of this name in the folder of the running one; nothing if there is no executable.
std::optional<std::filesystem::path> program_beside(const char* name);

/// Whether a program of this name is on the PATH.
bool on_path(const char* name);

}  // namespace palpate::app
