#pragma once

#include <filesystem>

namespace palpate::files {

/// The folder for data that the program keeps between runs: $XDG_STATE_HOME/palpate, or
/// ~/.local/state/palpate; empty if neither is known. It need not exist.
std::filesystem::path state_folder();

}  // namespace palpate::files
