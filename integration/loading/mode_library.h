#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/modes/modes.h"

namespace palpate::loading {

/// The kinds of mode that scenes may name: palpate's own and those of the libraries, which are made
/// with PALPATE_MODES and stay loaded until the program ends. Their code runs in this process and,
/// on the servo thread, in every tick. Errors: kBadInput, with one sentence: not a library, not a
/// library of modes, made for another version of palpate, or failed while it added its kinds. One
/// thread at a time.
Result<ModeKinds> load_modes(const std::vector<std::filesystem::path>& libraries);

/// The names of the kinds that are not palpate's own, in alphabetical order.
std::vector<std::string> added_kinds(const ModeKinds& kinds);

}  // namespace palpate::loading
