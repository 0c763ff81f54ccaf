#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "integration/files/scene/number_range.h"

namespace palpate::app {

/// Validators of options, each with a sentence that names the valid range. --help shows them after
/// the option's type.

/// A number in the range.
CLI::Validator number_in(const files::NumberRange& range);

/// A whole number from low to high.
CLI::Validator whole_number_in(int64_t low, int64_t high);
CLI::Validator whole_number_in(const files::NumberRange& range);

/// --nan-as VALUE, which sets nan_as.
void add_nan_as(CLI::App& app, std::optional<float>& nan_as, const std::string& what_for);

/// One of the words; the error names the nearest one. `{a,b,c}` in --help.
CLI::Validator one_of(std::vector<std::string> words);

/// One of the presets of palpate::motion_preset().
CLI::Validator one_of_the_presets();

/// An existing file, or folder. --help shows it by the option's type.
CLI::Validator an_existing_file();
CLI::Validator an_existing_folder();
CLI::Validator an_existing_path();

/// A core of this machine that the program may use. Not shown in --help, which is the same on every
/// machine.
CLI::Validator a_core();

}  // namespace palpate::app
