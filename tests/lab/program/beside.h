#pragma once

#include <filesystem>
#include <optional>

namespace palpate::app {

/// The program of a name in the folder of this one; nothing where there is none that may be run.
std::optional<std::filesystem::path> program_beside(const char* name);

/// Whether a program of this name is on PATH.
bool on_path(const char* name);

}  // namespace palpate::app
